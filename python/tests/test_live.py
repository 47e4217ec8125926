# SPDX-License-Identifier: Apache-2.0
"""rw.LiveView, against `raywave view`."""

import json
import subprocess
import threading

import numpy as np
import pytest
from conftest import DATA, LASERS

import raywave as rw

STEPS = """
[[step]]
[[step]]
turn = [0, 30, -5]
move = ["0.1 mm", 0, 0]
[[step]]
focus = "101 mm"
eye = [0.4, 0.2]  # as a viewer sees it
part = 0.5
[[step]]
pupil = "0.4 mm"
direction = [0.5, 0, -1]
[[step]]
hologram = true
lens = true
stops = 1.5
preset = "draft"
refined = true
"""


@pytest.mark.parametrize("lasers", ([], LASERS))
def test_pictures_are_those_of_raywave_view_to_the_bit(program, tmp_path, lasers):
    image = pytest.importorskip("PIL.Image")
    values = {"hologram.resolution": [256, 192], "object.0.width": "0.8 mm"}
    if lasers:
        values["hologram.wavelength"] = lasers
    (tmp_path / "steps.toml").write_text(STEPS)
    sets = [f"--set={key}={json.dumps(value)}" for key, value in values.items()]
    words = ["view", DATA / "teapot.toml", *sets, "--record", tmp_path / "steps.toml"]
    subprocess.run([program, *words, "-o", tmp_path], check=True, capture_output=True)
    live = rw.LiveView(rw.load_scene(DATA / "teapot.toml", values))
    ((x, y, z), rotation), = live.poses
    turned = {0: ((x + 0.1e-3, y, z), rw._core.turned(rotation, (0, 30, -5)))}
    seen = {"focus": 0.101, "view": (-0.4, 0.2), "aperture": 0.5}
    lit = {"aperture": 1.0, "pupil": 0.4e-3, "lights": {0: {"direction": (0.5, 0, -1)}}}
    more = {"levels": True, "lens": True, "stops": 1.5, "preset": "draft", "refined": True}
    report = json.loads((tmp_path / "report.json").read_text())
    for number, look in enumerate(({}, {"poses": turned}, {"poses": turned, **seen},
                                   {"poses": turned, **seen, **lit},
                                   {"poses": turned, **seen, **lit, **more})):
        picture = live.look(**look)
        recorded = image.open(tmp_path / f"view_{number:05}.png")
        assert np.array_equal(picture.image, np.asarray(recorded))
        assert (picture.hologram_seconds > 0) == (number in (1, 3, 4))
        assert live.notes == report["pictures"][number]["notes"]
    assert live.focus == report["pictures"][0]["focus_m"]


@pytest.fixture
def live(scene):
    return rw.LiveView(scene, longest=48)


def test_threads_take_turns(live):
    depths = (0.009, 0.01, 0.011, 0.012)
    alone = [live.look(depth).image for depth in depths]
    together = [None] * len(depths)

    def look(i):
        together[i] = live.look(depths[i]).image

    threads = [threading.Thread(target=look, args=(i,)) for i in range(len(depths))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(alone, together)
    assert not np.array_equal(alone[0], alone[1])


NAN = float("nan")
HERE = (0, 0, 0.01)


@pytest.mark.parametrize("wrong, words", (
    ({"focus": 98}, "focus: must be a depth in metres, up to"),  # 98 mm
    ({"focus": NAN}, "focus: must be a depth in metres, up to"),
    ({"focus": 0}, "focus 0: the SLM's own plane"),
    ({"focus": "near"}, "focus: must be a number"),
    ({"view": (2, 0)}, "view: must be -1 to 1, in half holograms, got 2"),
    ({"aperture": 0}, "aperture: must be 0.01 to 1"),
    ({"pupil": 3}, "pupil: must be 1e-06 to 1 m, got 3"),
    ({"lights": {1: {}}}, "light 1: there are 1"),
    ({"lights": {0: {"color": 1}}}, "--set light.0.color=1: light 0: unknown key"),
    ({"stops": 21}, "stops: must be -20 to 20"),
    ({"preset": "best"}, 'preset "best"'),
    ({"poses": [HERE]}, "poses: must be a mapping by number, got ["),
    ({"poses": {0: HERE}}, "poses: must be (position, rotation) of an object, got (0, 0"),
    ({"poses": {1: (HERE, HERE)}}, "poses: object: must be 0 to 0, got 1"),
    ({"poses": {0: ((0, 0, 1e9), HERE)}}, "position: must be -10000 to 10000 m"),
    ({"poses": {0: (HERE, (0, NAN, 0))}}, "rotation:"),
))  # fmt: skip
def test_what_cannot_be_seen_is_refused_and_all_stays(live, wrong, words):
    before = live.look().image
    with pytest.raises(rw.InputError) as refused:
        live.look(**wrong)
    assert str(refused.value).startswith(words)
    after = live.look()
    assert np.array_equal(after.image, before) and after.hologram_seconds == 0


def test_the_scene_of_a_plan_keeps_its_values(scene):
    live = rw.LiveView(rw.plan(scene, "draft"), longest=48)
    assert live.look().image.shape[2] == 3
    with pytest.raises(rw.InputError, match="has its values chosen"):
        live.look(preset="balanced")
