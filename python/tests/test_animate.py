# SPDX-License-Identifier: Apache-2.0
import subprocess

import numpy as np
import pytest
from conftest import LASERS, square_file, square_values

import raywave as rw


def moving_values(**hologram):
    values = square_values(**hologram)
    track = {"of": "object.0.rotation", "at": [0, 3], "values": [[0, 0, 0], [0, 60, 0]]}
    values["animation"] = {"frames": 3, "rate": 10, "slm_rate": 15, "track": [track]}
    return values


def test_an_animation_has_the_bits_of_the_command_line(program, tmp_path):
    square_file(tmp_path)
    values = moving_values(wavelength=LASERS)
    values["object"][0]["mesh"] = "square.obj"
    scene = rw.Scene(values, folder=tmp_path)
    text, *_ = scene._core.source()
    (tmp_path / "scene.toml").write_text(text)
    out = tmp_path / "out"
    subprocess.run(
        [program, "animate", tmp_path / "scene.toml", "-o", out, "--stream", "--no-video",
         "--no-preview", "--quiet"],
        check=True,
    )
    stored = np.fromfile(out / "frames.raw", np.uint8).reshape(5, 3, 32, 48)
    animation = rw.animate(scene)
    assert len(animation) == 3 and animation.rate == 10 and animation.slm_rate == 15
    assert animation.wavelengths == scene.wavelengths
    last, first = animation[-1], animation[0]
    assert (last.levels == stored[3:].swapaxes(0, 1)).all()
    assert first.levels.shape == (3, 2, 32, 48) and last.time == pytest.approx(0.2)
    everything = [picture.levels.swapaxes(0, 1) for picture in animation]
    assert (np.concatenate(everything) == stored).all()
    assert [picture.number for picture in animation[1:]] == [1, 2]
    with pytest.raises(IndexError, match="there are 3"):
        animation[3]
    calls = []
    rw.animate(scene, progress=lambda what, share: calls.append(what))[0]
    assert calls
    with pytest.raises(rw.Cancelled):
        rw.animate(scene, progress=lambda what, share: False)


def test_what_does_not_move_or_lies_in_memory_is_no_animation(scene):
    with pytest.raises(rw.InputError, match="nothing moves"):
        rw.animate(scene)
    with pytest.raises(rw.InputError, match="object 0.*in memory"):
        rw.animate(rw.Scene(moving_values()))
