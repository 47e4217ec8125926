# SPDX-License-Identifier: Apache-2.0
import pickle
import subprocess

import numpy as np
import pytest
from conftest import random_field

import raywave as rw

PITCH, WAVELENGTH = 4e-6, 633e-9


def places(shape, pitch):
    ny, nx = shape
    return (np.arange(nx) - (nx - 1) / 2) * pitch, ((ny - 1) / 2 - np.arange(ny)) * pitch


def direct_sum(u, distance, shift, out_pitch=PITCH, out_shape=None):
    """First Rayleigh-Sommerfeld integral over all pairs of samples, in double precision."""
    x, y = places(u.shape, PITCH)
    out_x, out_y = places(out_shape or u.shape, out_pitch)
    k = 2 * np.pi / WAVELENGTH
    result = np.zeros((len(out_y), len(out_x)), complex)
    for j in range(len(out_y)):
        for i in range(len(out_x)):
            r = np.sqrt((out_x[i] + shift[0] - x[None, :]) ** 2
                        + (out_y[j] + shift[1] - y[:, None]) ** 2 + distance**2)
            h = distance / (2 * np.pi * r**2) * np.exp(1j * k * r) * (1 / r - 1j * k)
            result[j, i] = (u * h).sum() * PITCH**2
    return result


def gaussian(shape, waist, dtype):
    x, y = places(shape, PITCH)
    return np.exp(-(x[None, :] ** 2 + y[:, None] ** 2) / waist**2).astype(dtype)


def relative(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_propagation_is_the_direct_sum_with_its_phase(dtype):
    u = gaussian((48, 64), 30e-6, dtype)
    # So far away that the sum over samples has its replicas beyond the window
    for distance, shift in [(2e-3, (0, 0)), (2e-3, (20e-6, -12e-6)), (-2e-3, (0, 0))]:
        arrived = rw.propagate(u, PITCH, WAVELENGTH, distance, shift)
        assert arrived.dtype == dtype and arrived.shape == u.shape
        expected = (direct_sum(u, distance, shift) if distance > 0
                    else direct_sum(u.conj(), -distance, shift).conj())
        assert relative(arrived, expected) < 2e-4  # of the Gaussian's tail beyond the window


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("pitch, shape", [(PITCH / 2, (47, 62)), (1.7 * PITCH, (45, 64))])
def test_points_of_another_pitch_have_the_direct_sums_field(dtype, pitch, shape):
    u = rw.Field(gaussian((48, 63), 20e-6, dtype), PITCH, WAVELENGTH)
    shift = (20e-6, -12e-6)
    arrived = rw.propagate(u, distance=3e-3, shift=shift, out_pitch=pitch, out_shape=shape)
    assert arrived.dtype == dtype and arrived.shape == shape and arrived.pitch == (pitch, pitch)
    assert relative(arrived, direct_sum(u, 3e-3, shift, pitch, shape)) < 6e-7
    assert rw.propagate(u, distance=3e-3, out_shape=shape).pitch == (PITCH, PITCH)
    for bad, name in [({"out_pitch": -1}, "out_pitch"), ({"out_pitch": "fine"}, "out_pitch"),
                      ({"out_shape": 5}, "out_shape"), ({"out_shape": (0, 5)}, "out_shape")]:
        with pytest.raises(rw.InputError, match="^" + name):
            rw.propagate(u, distance=3e-3, **bad)


def test_both_precisions_agree_and_pitches_may_differ(device):
    u = random_field((27, 40))
    for pitch in (PITCH, (4e-6, 5e-6)):
        single = rw.propagate(u, pitch, WAVELENGTH, 2e-3, (3e-5, 1e-5), device=device)
        double = rw.propagate(u.astype(complex), pitch, WAVELENGTH, 2e-3, (3e-5, 1e-5))
        assert relative(single, double) < 1e-6


def test_the_adjoint_is_the_propagation_back():
    x, y = random_field((21, 34), complex, 1), random_field((21, 34), complex, 2)
    there = rw.propagate(x, PITCH, WAVELENGTH, 3e-3, (2e-5, -4e-5))
    back = rw.propagate(y, PITCH, WAVELENGTH, -3e-3, (-2e-5, 4e-5))
    assert np.vdot(y, there) == pytest.approx(np.vdot(back, x), rel=1e-12)


def test_arrays_of_other_libraries_go_in_as_they_are():
    u = random_field((16, 24))
    expected = rw.propagate(u, PITCH, WAVELENGTH, 1e-3)
    read_only = u.copy()
    read_only.flags.writeable = False
    buffer = memoryview(u.view(np.float32))  # of another type: refused below

    class Dlpack:
        def __dlpack__(self, **options):
            return u.__dlpack__(**options)

        def __dlpack_device__(self):
            return u.__dlpack_device__()

    for given in (read_only, Dlpack(), rw.Field(u), memoryview(u), u.astype(">c8")):
        assert np.array_equal(rw.propagate(given, PITCH, WAVELENGTH, 1e-3), expected)
    with pytest.raises(rw.InputError, match="^u: must be complex64"):
        rw.propagate(buffer, PITCH, WAVELENGTH, 1e-3)
    assert np.array_equal(np.from_dlpack(rw.propagate(u, PITCH, WAVELENGTH, 1e-3)), expected)


BAD = {
    "another type": np.zeros((4, 4)),
    "integers": np.zeros((4, 4), int),
    "objects": np.zeros((4, 4), object),
    "text": "field",
    "nothing": None,
    "a list": [[1j, 2j], [3j, 4j]],
    "NaN": np.full((4, 4), np.nan, np.complex64),
    "infinity": np.full((4, 4), np.inf * 1j, np.complex64),
    "masked": np.ma.masked_less(np.ones((4, 4), np.complex64), 0),
    "no rows": np.zeros((0, 4), np.complex64),
    "no columns": np.zeros((4, 0), np.complex64),
    "one dimension": np.zeros(4, np.complex64),
    "a scalar": np.complex64(1),
    "four dimensions": np.zeros((1, 1, 4, 4), np.complex64),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_arrays_are_refused_by_name(what):
    bad, pixels = BAD[what], {"pitch": PITCH, "wavelength": WAVELENGTH}
    with pytest.raises(rw.InputError, match="^u: "):
        rw.propagate(bad, PITCH, WAVELENGTH, 1e-3)
    for call in (
        lambda: rw.reconstruct(bad, z=0.1, **pixels),
        lambda: rw.encode(bad, **pixels),
        lambda: rw.refine(bad, targets={0.1: np.zeros((4, 4), np.float32)}, **pixels),
    ):
        with pytest.raises(rw.InputError, match="^field: "):
            call()
    good = np.ones((4, 4), np.complex64)
    for a, b in ((bad, good), (good, bad)):
        with pytest.raises(rw.InputError, match="^[ab]: "):
            rw.compare(a, b)
    with pytest.raises(rw.InputError, match="^levels: "):
        rw.shown(bad, **pixels)


APART = [
    lambda a: a.repeat(2, -1)[..., ::2], lambda a: a.repeat(3, -2)[..., ::3, :],
    lambda a: a.swapaxes(-1, -2).copy().swapaxes(-1, -2), lambda a: a[..., ::-1].copy()[..., ::-1],
    lambda a: rw.Field(a.repeat(2, -1), PITCH)[..., ::2], np.asfortranarray,
]  # fmt: skip


@pytest.mark.parametrize("apart", APART)
def test_samples_apart_count_as_those_side_by_side(apart):
    u, pixels = random_field((12, 17)), {"pitch": PITCH, "wavelength": WAVELENGTH}
    levels, picture = rw.encode(u, **pixels), abs(u)
    assert not apart(u).flags.c_contiguous and np.array_equal(apart(u), u)
    for call, array in [
        (lambda a: rw.propagate(a, distance=1e-3, **pixels), u),
        (lambda a: rw.propagate(a, distance=1e-3, **pixels), u.astype(np.complex128)),
        (lambda a: rw.reconstruct(a, z=1e-3, **pixels), u),
        (lambda a: rw.encode(a, **pixels), np.stack([u, 2 * u[::-1]])),
        (lambda a: rw.shown(a, **pixels), levels),
        (lambda a: rw.compare(a, picture + 1, border=2).ssim, picture),
        (lambda a: rw.compare(u + 1, a).error, u),
    ]:
        assert np.array_equal(call(apart(array)), call(array))
    class Dlpack:  # as torch's tensors, which NumPy's own methods do not know
        def __dlpack__(self, **options):
            return apart(u).__dlpack__()

        def __dlpack_device__(self):
            return u.__dlpack_device__()

    assert np.array_equal(rw.propagate(Dlpack(), distance=1e-3, **pixels),
                          rw.propagate(u, distance=1e-3, **pixels))


def test_double_precision_is_taken_as_single():
    u, pixels = random_field((12, 16)), {"pitch": PITCH, "wavelength": WAVELENGTH}
    target = abs(u)
    for call, array in [
        (lambda a: rw.reconstruct(a, z=1e-3, **pixels), u),
        (lambda a: rw.encode(a, **pixels), u),
        (lambda a: rw.refine(a, targets={1e-3: target}, iterations=1, **pixels), u),
        (lambda a: rw.refine(u, targets={1e-3: a}, iterations=1, **pixels), target),
        (lambda a: rw.compare(a, u + 1).error, u),
        (lambda a: rw.compare(a, target + 1, border=2).psnr_db, target),
    ]:
        double = array.astype(np.complex128 if array is u else np.float64)
        for given in (double, double.repeat(2, 1)[:, ::2]):
            assert np.array_equal(call(given), call(array))
    # What double precision holds and single does not is refused, not lost.
    overflow = pytest.raises(rw.InputError, match="^field: holds NaN or infinity")
    with overflow, np.errstate(all="ignore"):
        rw.encode(np.full((4, 4), 1e300 + 0j), **pixels)


def test_a_field_propagates_with_the_pixels_it_knows():
    u = random_field((24, 32))
    field = rw.Field(u, (PITCH, 2 * PITCH), WAVELENGTH)
    expected = rw.propagate(u, (PITCH, 2 * PITCH), WAVELENGTH, 1e-3)
    arrived = rw.propagate(field, distance=1e-3)
    assert np.array_equal(arrived, expected) and arrived.pitch == field.pitch
    assert arrived.wavelength == WAVELENGTH
    with pytest.raises(rw.InputError, match="^pitch: is needed"):
        rw.propagate(u, distance=1e-3)
    with pytest.raises(rw.InputError, match="^distance: is needed"):
        rw.propagate(field)


def test_three_dimensions_are_frames_or_refused():
    frames = np.ones((3, 8, 8), np.complex64)
    with pytest.raises(rw.InputError, match=r"^u: must have the shape \(ny, nx\), got \(3, 8, 8\)"):
        rw.propagate(frames, PITCH, WAVELENGTH, 1e-3)
    assert rw.encode(frames, pitch=PITCH, wavelength=WAVELENGTH).shape == frames.shape
    picture = np.ones((3, 8, 8), np.float32)
    with pytest.raises(rw.InputError, match="^a: "):
        rw.compare(picture, picture)


def test_numbers_that_are_not_possible_are_refused_by_name():
    u = np.ones((8, 8), np.complex64)
    nan = float("nan")
    for pitch, wavelength, distance, shift, name in [
        (0, WAVELENGTH, 1e-3, (0, 0), "pitch"), (nan, WAVELENGTH, 1e-3, (0, 0), "pitch"),
        ((1, 2, 3), WAVELENGTH, 1e-3, (0, 0), "pitch"), ("8 um", WAVELENGTH, 1e-3, (0, 0), "pitch"),
        (PITCH, -1, 1e-3, (0, 0), "wavelength"), (PITCH, "red", 1e-3, (0, 0), "wavelength"),
        (PITCH, WAVELENGTH, nan, (0, 0), "distance"), (PITCH, WAVELENGTH, 1e-3, (nan, 0), "shift"),
        (PITCH, WAVELENGTH, 1e-3, (1, 2, 3), "shift"), (PITCH, WAVELENGTH, 1e-3, (1, 0), "shift"),
    ]:
        for dtype in (np.complex64, np.complex128):
            if name == "shift" and shift == (1, 0) and dtype is np.complex128:
                continue
            with pytest.raises(rw.InputError, match=name):
                rw.propagate(u.astype(dtype), pitch, wavelength, distance, shift)
    with pytest.raises(rw.InputError, match="padding"):
        rw.propagate(u, PITCH, WAVELENGTH, 1e-3, padding=0.5)
    with pytest.raises(rw.InputError, match="^pitch: is needed"):
        rw.reconstruct(u, z=0.1)
    with pytest.raises(rw.InputError, match="^z: must be finite"):
        rw.reconstruct(u, z=nan, pitch=PITCH, wavelength=WAVELENGTH)


def test_a_field_keeps_its_pixels_where_they_still_hold():
    field = rw.Field(np.ones((2, 6, 8), np.complex64), 8e-6, WAVELENGTH)
    assert field.pitch == (8e-6, 8e-6)
    assert (2 * field).pitch == field.pitch and field[0].wavelength == WAVELENGTH
    assert field.ravel().pitch is None and field.reshape(2, 8, 6).pitch is None
    again = pickle.loads(pickle.dumps(field))
    assert again.pitch == field.pitch and np.array_equal(again, field)
    arrived = rw.propagate(field[0], 8e-6, WAVELENGTH, 1e-3)
    assert isinstance(arrived, rw.Field) and arrived.pitch == field.pitch


def turned(field):
    return field.swapaxes(-1, -2)


KNOWN = [  # changes that leave samples at equal distances
    turned, lambda f: turned(f)[..., ::2, ::3], lambda f: turned(f)[..., ::2] + 0,
    lambda f: f[..., ::2], lambda f: f[..., ::-2, 1:], lambda f: f[..., 2:5, 1:7].copy(),
    lambda f: np.rot90(f, axes=(-2, -1)), lambda f: np.rot90(f, 3, (-1, -2)) * 2 / 2,
    lambda f: np.flip(f, -1), lambda f: turned(turned(f).copy())[..., ::2],
    lambda f: np.moveaxis(f, -1, -2),
]  # fmt: skip
OTHERS = [
    np.transpose, lambda f: f.T[::2].T, lambda f: f[..., 0, :], lambda f: f[..., 0],
    lambda f: f.reshape(-1, 4), lambda f: f.view(float), lambda f: f[..., None, :],
]  # fmt: skip


def test_the_pitch_of_a_field_is_the_distance_of_its_samples():
    # The values are the places of the samples: a second way to their distances.
    for sides in ((6, 8), (8, 8), (2, 6, 8), (8, 8, 8)):
        places = 3e-6 * np.arange(sides[-1]) + 5e-6j * np.arange(sides[-2])[:, None]
        field = rw.Field(np.broadcast_to(places, sides).copy(), (3e-6, 5e-6), WAVELENGTH)
        for change in KNOWN + OTHERS:
            changed = change(field)
            assert changed.pitch or change in OTHERS
            if changed.pitch is None:
                continue
            assert changed.wavelength == WAVELENGTH
            for axis, pitch in ((-1, changed.pitch[0]), (-2, changed.pitch[1])):
                assert np.allclose(abs(np.diff(np.asarray(changed), axis=axis)), pitch, 1e-9, 0)
    field = rw.Field(np.zeros((6, 8), np.complex64), (3e-6, 5e-6), WAVELENGTH)
    assert field.T.pitch == np.rot90(field).pitch == field.T.copy().pitch == (5e-6, 3e-6)
    assert field[::4, ::2].pitch == (6e-6, 20e-6) and (field[2:, 1:] * 2).pitch == (3e-6, 5e-6)
    assert rw.Field(np.zeros((2, 6, 8)), 1).T.pitch is None
    with pytest.raises(rw.InputError, match="^samples: is masked"):
        rw.Field(np.ma.zeros((4, 4)), 1e-6)


def test_levels_show_the_field_that_they_encode():
    u = np.exp(1j * random_field((24, 32)).real).astype(np.complex64)
    pixels = {"pitch": PITCH, "wavelength": WAVELENGTH}
    levels = rw.encode(u, **pixels)
    assert levels.dtype == np.uint8
    assert np.abs(rw.shown(levels, **pixels) - u).max() < np.pi / 256 + 1e-3
    deep = rw.encode(u, {"encoding": "phase", "bits": 10, "levels": 1024}, **pixels)
    assert deep.dtype == np.uint16
    slm = {"encoding": "phase", "bits": 10, "levels": 1024}
    assert np.abs(rw.shown(deep, slm, **pixels) - u).max() < np.pi / 1024 + 1e-3
    with pytest.raises(rw.InputError, match="slm"):
        rw.encode(u, {"encodin": "phase"}, **pixels)
    with pytest.raises(rw.InputError, match="^slm: must be"):
        rw.encode(u, 3, **pixels)
    with pytest.raises(rw.InputError, match="levels: the SLM has levels up to 1023"):
        rw.shown(np.full((4, 4), 1024, np.uint16), slm, **pixels)


def test_slm_of_a_scene_a_file_and_a_mapping_are_one(scene, tmp_path):
    keys = {"encoding": "double-phase", "invert": True}
    scene.set({f"slm.{key}": value for key, value in keys.items()})
    (tmp_path / "slm.toml").write_text('[slm]\nencoding = "double-phase"\ninvert = true\n')
    holo = rw.render(scene)
    pictures = [rw.encode(holo.field, slm) for slm in (scene, keys, tmp_path / "slm.toml")]
    assert all(np.array_equal(p, pictures[0]) for p in pictures)
    assert np.mean(pictures[0] == holo.levels) > 0.99  # the field's brightness is rounded anew
    assert np.allclose(rw.shown(holo.levels, scene, pitch=scene.pitch, wavelength=scene.wavelength),
                       holo.shown)


def test_comparisons_have_the_values_of_their_formulas():
    random = np.random.default_rng(3)
    a, b = (random.random((32, 40)).astype(np.float32) for _ in range(2))
    c = rw.compare(a, b)
    scale = (a.astype(float) * b).sum() / (b.astype(float) ** 2).sum()
    assert c.scale == pytest.approx(scale, rel=1e-6)
    error = ((scale * b - a) ** 2).mean()
    assert c.psnr_db == pytest.approx(10 * np.log10(a.max() ** 2 / error), rel=1e-6)
    assert rw.compare(a, 3 * a).psnr_db > 100
    x, y = random_field((8, 9)), random_field((8, 9), seed=5)
    f = rw.compare(x, y)
    expected = abs(np.vdot(x, y)) / np.linalg.norm(x) / np.linalg.norm(y)
    assert f.correlation == pytest.approx(expected, rel=1e-5)
    for options in ({"domain": "log"}, {"region": (0, 0)}, {"border": 99}, {"blur": -1}):
        with pytest.raises(rw.InputError):
            rw.compare(a, b, **options)
    with pytest.raises(rw.InputError, match="fields"):
        rw.compare(x, y, blur=2)


@pytest.mark.parametrize("noise", (0.02, 0.2))
@pytest.mark.parametrize("channels", (1, 3))
def test_flip_is_that_of_flip_evaluator(channels, noise):
    flip_evaluator = pytest.importorskip("flip_evaluator")  # NVIDIA's own
    rng = np.random.default_rng(7)
    y, x = np.mgrid[:96, :128]
    a = np.stack([(1 + np.sin(x / (5 + c)) * np.cos(y / 9)) / 3 for c in range(3)], -1)
    a[10:30, 20:50] = 0.9, 0.1, 0.2
    b = np.clip(a + rng.normal(0, noise, a.shape), 0, 1)
    b[40:50, 60:64] = 1
    if channels == 1:
        a, b = a[..., :1].repeat(3, -1), b[..., :1].repeat(3, -1)
    luminance = [picture @ (0.2126, 0.7152, 0.0722) for picture in (a, b)]
    scale = np.vdot(*luminance) / np.vdot(luminance[1], luminance[1])

    def on_screen(linear):
        v = np.clip(linear / luminance[0].max(), 0, 1)
        return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055).astype("f4")

    expected = flip_evaluator.evaluate(on_screen(a), on_screen(scale * b), "LDR")[1]
    given = (a, b) if channels == 3 else (a[..., 0], b[..., 0])
    c = rw.compare(*(np.ascontiguousarray(picture, "f4") for picture in given))
    assert abs(c.flip - expected) < 1e-4
    assert expected > 0.03


def test_refinement_of_a_field_shows_its_target(scene):
    scene.set({"hologram.resolution": [96, 64]})
    holo = rw.render(scene)
    target = rw.lens(scene, z=0.01, points=4)
    refined = rw.refine(holo.field, targets={0.01: target}, iterations=12)
    assert np.allclose(abs(np.asarray(refined)), 1, atol=1e-5)

    def psnr(field):
        return rw.compare(target, rw.reconstruct(field, z=0.01), blur=4).psnr_db

    assert psnr(refined) > psnr(holo.shown) + 2
    whole = rw.refine(scene, iterations=20, lens_points=2)
    assert psnr(whole.shown) > psnr(holo.shown) + 2
    assert np.allclose(abs(np.asarray(whole.refined)), 1, atol=1e-5)
    for wrong in ({"targets": {}}, {"targets": {0.01: target.astype(int)}},
                  {"targets": {-1: target}}, {"targets": {0.01: target}, "iterations": 0},
                  {"targets": {0.01: target}, "views": 3}):
        with pytest.raises(rw.InputError):
            rw.refine(holo.field, **wrong)
    with pytest.raises(rw.InputError, match="^targets"):
        rw.refine(scene, targets={0.01: target})


@pytest.mark.parametrize("to, slope", {"right": (1, 0), "left": (-1, 0), "up": (0, -1),
                                       "down": (0, 1)}.items())
def test_a_blaze_rises_by_a_turn_in_each_period(to, slope):
    x, y = np.meshgrid(np.arange(40), np.arange(24))
    turns = (slope[0] * x + slope[1] * y) / 8
    levels = rw.pattern("blaze", (24, 40), PITCH, WAVELENGTH, period=8, to=to)
    steps = np.round((levels - levels[0, 0]) / 256.0 - (turns - turns[0, 0]), 6) % 1
    assert levels.dtype == np.uint8 and np.minimum(steps, 1 - steps).max() <= 1 / 256


def test_a_pattern_is_what_the_command_line_writes_turned_as_the_slm_is_sent_it(program, tmp_path):
    slm = tmp_path / "slm.toml"
    slm.write_text('[slm]\nrotate = 90\nflip = "x"\ninvert = true\n')
    subprocess.run(
        [program, "pattern", "lens", "--slm", slm, "--size", "64x40", "--pitch", "8um",
         "--wavelength", "520nm", "--focal", "50mm", "-o", tmp_path, "--quiet"], check=True,
    )  # fmt: skip
    levels = rw.pattern("lens", (40, 64), 8e-6, 520e-9, slm, focal=0.05)
    assert levels.shape == (64, 40)
    image = pytest.importorskip("PIL.Image")
    assert np.array_equal(np.asarray(image.open(tmp_path / "pattern_lens.png")), levels)
    with pytest.raises(rw.InputError, match="^focal 1 mm: too strong"):
        rw.pattern("lens", (400, 640), 8e-6, 520e-9, focal=1e-3)
