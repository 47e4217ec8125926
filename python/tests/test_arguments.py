# SPDX-License-Identifier: Apache-2.0
"""What is wrong with an argument is said by its name, before anything is computed."""

import numpy as np
import pytest
from conftest import square_values

import raywave as rw

NAN = float("nan")
PIXELS = {"pitch": 4e-6, "wavelength": 633e-9}
FIELD = np.ones((8, 8), np.complex64)
PICTURE = np.arange(64, dtype=np.float32).reshape(8, 8)

# Called with what a test adds or replaces
CALLS = {
    "plan": lambda **given: rw.plan(rw.Scene(square_values()), **given),
    "render": lambda **given: rw.render(rw.Scene(square_values()), **given),
    "lens": lambda **given: rw.lens(**{"scene": rw.Scene(square_values()), "z": 0.01, **given}),
    "preview": lambda **given: rw.preview(**{"scene": rw.Scene(square_values()), **given}),
    "propagate": lambda **given: rw.propagate(**{"u": FIELD, "distance": 1e-3, **PIXELS, **given}),
    "reconstruct": lambda **given: rw.reconstruct(FIELD, **{"z": 0.01, **PIXELS, **given}),
    "encode": lambda **given: rw.encode(FIELD, **{**PIXELS, **given}),
    "shown": lambda **given: rw.shown(np.zeros((8, 8), np.uint8), **{**PIXELS, **given}),
    "pattern": lambda **given: rw.pattern(
        **{"pattern": "lens", "shape": (8, 8), **PIXELS, **given}),
    "quality": lambda **given: rw.quality(
        rw.Scene(square_values()), **{"lens_points": 2, "border": 0, **given}),
    "compare": lambda **given: rw.compare(PICTURE, PICTURE + 1, **given),
    "trade": lambda **given: rw.trade(rw.Scene(square_values()), **given),
    "refine": lambda **given: rw.refine(rw.Scene(square_values()), **given),
    "refine a field": lambda **given: rw.refine(
        FIELD, **{"targets": {0.01: PICTURE}, **PIXELS, **given}),
}  # fmt: skip

WHOLE = (1.5, "many", NAN, None, (1, 2), 2**70, -(2**70), -(2**40))
REAL = ("soon", NAN, (1, 2, 3), b"1", 10**400)
TEXT = (3, b"name", 1.5, ["name"])
FUNCTION = (3, "print")
PAIR = (NAN, "wide", (1, 2, 3), (1, "x"))

BAD = [
    (("plan", "render", "refine"), "preset", (*TEXT, "best")),
    (("plan", "render"), "budget", (*REAL, 0, -1)),
    (("plan", "render"), "rate", (*REAL, 0, -1)),
    (("plan", "render"), "psnr", (*REAL, -1, 201)),
    (("plan", "render", "lens", "propagate", "reconstruct", "encode", "refine"), "device", TEXT),
    (("preview",), "device", TEXT),
    (("refine a field",), "device", TEXT),
    (("render", "propagate", "reconstruct", "refine", "refine a field"), "fft", (*TEXT, "none")),
    (("trade",), "renders", (*WHOLE, -1, 1001)),
    (("render",), "method", (*TEXT, "magic")),
    (("render",), "rays", (*WHOLE, 0, -1, 1001)),
    (("render", "lens", "reconstruct", "refine", "refine a field"), "progress", FUNCTION),
    (("lens", "preview"), "scene", (None, "scene.toml", {})),
    (("lens",), "points", (*WHOLE, 0, 4097)),
    (("lens",), "z", (*REAL, 0, None)),
    (("reconstruct",), "z", (*REAL, None)),
    (("preview",), "z", (*REAL, 0)),
    (("lens", "preview", "reconstruct"), "view", PAIR),
    (("lens", "reconstruct"), "aperture", (*PAIR, 0)),
    (("lens", "reconstruct"), "pupil", (3, "3", "-1mm", "2mm@1mm", "eye")),
    (("quality",), "pupils", (["-1mm"], "eye", [3])),
    (("lens", "preview", "reconstruct"), "window", (*PAIR, 0)),
    (("propagate", "reconstruct", "encode", "shown", "refine a field"), "pitch", (*PAIR, 0, -1)),
    (("propagate", "reconstruct", "encode", "shown", "refine a field"), "wavelength",
     (*REAL, 0, -1)),
    (("propagate",), "distance", (*REAL, None)),
    (("propagate",), "shift", (*PAIR, None)),
    (("propagate",), "padding", (*REAL, 0.5, 65, None)),
    (("encode", "shown"), "slm", (3, 1.5, ["slm"])),
    (("pattern",), "pattern", (*TEXT, "star", None)),
    (("pattern",), "shape", (8, (8,), (0, 8), (8, 2**17), (8, 1.5), "8x", None)),
    (("pattern",), "pitch", (*PAIR, 0, -1, None)),
    (("pattern",), "wavelength", (*REAL, 0, -1, None)),
    (("pattern",), "focal", (*REAL, 0, None)),
    (("pattern",), "to", (*TEXT, "back", None)),
    (("pattern", "quality"), "device", TEXT),
    (("quality",), "fft", (*TEXT, "none")),
    (("quality",), "depths", (3, "ab", (NAN,), (0,), ("near",), None)),
    (("quality",), "window", (*PAIR, 0)),
    (("quality",), "blur", (*REAL, -1)),
    (("quality",), "border", (*WHOLE, -1)),
    (("quality",), "lens_points", (*WHOLE, 0, 4097)),
    (("quality",), "progress", FUNCTION),
    (("compare",), "blur", (*REAL, -1)),
    (("compare",), "border", (*WHOLE, -1, 4)),
    (("compare",), "domain", (*TEXT, "log")),
    (("compare",), "region",
     (3, "all", (0, 0), (0, 0, 1.9, 2), (NAN, 0, 2, 2), (0, 0, 9, 9), (-1, 0, 2, 2),
      (0, 0, 2**70, 2))),
    (("refine", "refine a field"), "iterations", (*(w for w in WHOLE if w is not None), 0, -1)),
    (("refine",), "views", (*(w for w in WHOLE if w is not None), -1, 1001)),
    (("refine",), "lens_points", (*(w for w in WHOLE if w is not None), 1, 101)),
    (("refine",), "depths", (0.1, "near", (NAN,), (0.2, 0.1), (-1,), None)),
    (("refine", "refine a field"), "brightness", (*REAL, 0, -1)),
    (("refine", "refine a field"), "blur", (*REAL, 0, -1)),
    (("refine", "refine a field"), "refine_budget", (*REAL, 0, -1)),
    (("refine a field",), "targets",
     (None, {}, 3, [PICTURE], PICTURE, {0.01: None}, {NAN: PICTURE}, {"near": PICTURE},
      {0.01: PICTURE.astype(int)})),
]  # fmt: skip


@pytest.mark.parametrize(
    ("function", "keyword", "value"),
    [(f, keyword, value) for functions, keyword, values in BAD for f in functions
     for value in values],
    ids=lambda part: part if isinstance(part, str) else None,
)  # fmt: skip
def test_a_bad_argument_is_refused_by_its_name(function, keyword, value):
    with pytest.raises(rw.InputError, match=rf"^{keyword}\b"):
        CALLS[function](**{keyword: value})


@pytest.mark.parametrize("integer", [int, np.int8, np.int64, np.uint16])
def test_whole_numbers_of_numpy_are_whole_numbers(integer):
    scene = rw.Scene(square_values())
    scene.set({"sampling.frames": integer(2)})
    renderer = rw.Renderer(scene)
    renderer.set_pose(integer(0), (0, 0, 0.01))
    renderer.set_seed(integer(3))
    assert np.array_equal(renderer.render().for_slm(integer(1)), renderer.render().levels[1])
    assert np.array_equal(renderer.render().for_slm(), renderer.render().levels)
    region = tuple(integer(v) for v in (1, 1, 4, 4))
    assert rw.compare(PICTURE, PICTURE, border=integer(1), region=region).contrast_a > 0


def test_methods_refuse_what_is_no_whole_number_in_range(tmp_path):
    holo = rw.render(rw.Scene(square_values()))
    renderer = rw.Renderer(rw.Scene(square_values()))
    pose = ((0, 0, 0.01),)
    for call, name in [
        (lambda bad: holo.for_slm("all" if bad is None else bad), "frame"),
        (lambda bad: holo.save(tmp_path / "hologram.png", "" if bad is None else bad), "frame"),
        (lambda bad: renderer.set_pose(bad, *pose), "object"),
        (lambda bad: renderer.set_seed(bad), "seed"),
    ]:
        for bad in (*WHOLE, -1, 2**32):
            with pytest.raises(rw.InputError, match=f"^{name}\\b"):
                call(bad)
    assert not list(tmp_path.iterdir())
