# SPDX-License-Identifier: Apache-2.0
"""Fields and pictures: propagation, encoding, and what a hologram shows."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._scene import Path, Scene, Value, _document, _is_path, _warn

if TYPE_CHECKING:
    from ._render import Hologram

ComplexArray = npt.NDArray[np.complex64]
Picture = npt.NDArray[np.float32]
LevelArray = npt.NDArray[Any]  # uint8, or uint16 where levels have more than 8 bits
ArrayLike = Any  # NumPy, a buffer, or DLPack
Pair = Union[float, Sequence[float]]
Progress = Optional[Callable[[str, float], Any]]

_MOST = 2**31 - 1  # that the library's whole numbers hold


def _pair(value: Pair, name: str) -> tuple[float, float]:
    """(x, y) of one number or two."""
    try:
        if np.ndim(value) == 0:
            one = float(value)  # type: ignore[arg-type]
            return one, one
        x, y = (float(v) for v in value)  # type: ignore[union-attr]
    except (TypeError, ValueError, OverflowError):
        raise _core.InputError(f"{name}: must be a number or two (x, y), got {value!r}") from None
    return x, y


def _number(value: float, name: str) -> float:
    try:
        if isinstance(value, (str, bytes, bytearray)):  # float would read it
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise _core.InputError(f"{name}: must be a number, got {value!r}") from None


def _whole(value: int, name: str, least: int, most: int) -> int:
    try:
        whole = operator.index(value)
    except TypeError:
        raise _core.InputError(f"{name}: must be a whole number, got {value!r}") from None
    if not least <= whole <= most:
        raise _core.InputError(f"{name}: must be {least} to {most}, got {whole}")
    return whole


def _shape(value: Sequence[int], name: str, most: int) -> tuple[int, int]:
    """(nx, ny) of (ny, nx)."""
    try:
        ny, nx = value
    except (TypeError, ValueError):
        raise _core.InputError(f"{name}: must be (ny, nx), got {value!r}") from None
    return _whole(nx, name, 1, most), _whole(ny, name, 1, most)


def _text(value: str, name: str) -> str:
    if not isinstance(value, str):
        raise _core.InputError(f"{name}: must be text, got {value!r}")
    return value


def _unmasked(array: ArrayLike, name: str) -> ArrayLike:
    if isinstance(array, np.ma.MaskedArray):
        raise _core.InputError(f"{name}: is masked: pass .filled(0), or another value, of it")
    return array


class Field(np.ndarray[Any, np.dtype[np.complex64]]):
    """A complex field that knows its pixels: a NumPy array with `pitch` and `wavelength`.

    The pitch follows turns, flips, crops and steps: `field.T` has (y, x), `field[:, ::2]` twice the
    pitch in x. It is kept where the last two sides are, and is None otherwise.
    """

    wavelength: float | None

    def __new__(
        cls, samples: ArrayLike, pitch: Pair | None = None, wavelength: float | None = None
    ) -> Field:
        field: Field = np.asarray(_unmasked(samples, "samples")).view(cls)
        field.pitch = None if pitch is None else _pair(pitch, "pitch")
        field.wavelength = None if wavelength is None else _number(wavelength, "wavelength")
        return field

    def __array_finalize__(self, other: Any) -> None:
        known = isinstance(other, Field) and other.ndim >= 2 and self.ndim >= 2
        self.wavelength = other.wavelength if known else None
        # NumPy calls this before it sets a transpose's strides: `pitch` looks at them when asked.
        self._origin = (
            (other.pitch, other.shape[-2:], other.strides[-2:], np.may_share_memory(self, other))
            if known
            else None
        )

    @property
    def pitch(self) -> tuple[float, float] | None:
        """(x, y), in metres."""
        if self._origin is None or self._origin[0] is None or self.ndim < 2:
            return None
        pitch, sides, strides, is_view = self._origin
        if not is_view:
            return pitch if self.shape[-2:] == sides else None
        found: dict[int, float] = {}  # by the axis of the array that this shows, 0: y
        for side, stride in zip(self.shape[-2:], self.strides[-2:]):
            for axis in sorted((0, 1), key=lambda i: -abs(strides[i])):
                step, rest = divmod(abs(stride), abs(strides[axis]) or 1)
                fits = rest == 0 and step > 0 and (side - 1) * step < sides[axis]
                if fits and axis not in found:
                    found[axis] = step * pitch[1 - axis]
                    break
        y, x = found.values() if len(found) == 2 else (None, None)
        return None if x is None or y is None else (x, y)

    @pitch.setter
    def pitch(self, pitch: tuple[float, float] | None) -> None:
        self._origin = pitch, self.shape[-2:], self.strides[-2:], False

    def __reduce__(self) -> Any:
        return _restored, (np.asarray(self), self.pitch, self.wavelength)


def _restored(samples: ArrayLike, pitch: Any, wavelength: Any) -> Field:
    return Field(samples, pitch, wavelength)


def _pixels(source: Any, pitch: Pair | None, wavelength: float | None) -> _core.Pixels:
    """The pixels of a field: as given, or as it knows them itself."""
    if pitch is None:
        pitch = getattr(source, "pitch", None)
    if wavelength is None:
        wavelength = getattr(source, "wavelength", None)
    if pitch is None:
        raise _core.InputError("pitch: is needed: pass pitch=, for this array does not know it")
    if wavelength is None and np.ndim(source) == 4:
        raise _core.InputError(
            "field: is of several lasers: give the hologram, or one's field, holo.lasers[0].field"
        )
    if wavelength is None:
        raise _core.InputError(
            "wavelength: is needed: pass wavelength=, for this array does not know it"
        )
    return _core.Pixels(_pair(pitch, "pitch"), _number(wavelength, "wavelength"))


def _plain(array: ArrayLike) -> ArrayLike:
    return np.asarray(array) if isinstance(array, Field) else array


def devices() -> list[_core.Device]:
    """The OpenCL devices, with `index` ("0:1"), `name`, `kind` ... ; empty when there is none."""
    return _core.devices()


def propagate(
    u: ArrayLike,
    pitch: Pair | None = None,
    wavelength: float | None = None,
    distance: float | None = None,
    shift: Sequence[float] = (0.0, 0.0),
    *,
    padding: float = 2.0,
    out_pitch: Pair | None = None,
    out_shape: Sequence[int] | None = None,
    device: str = "",
    fft: str = "",
) -> npt.NDArray[np.complexfloating[Any, Any]]:
    """Field on a parallel plane whose centre is shifted sideways, with the phase of the true
    distance: the band-limited shifted angular spectrum (Matsushima, Opt. Express 18, 18453 (2010)).

    u: (ny, nx), complex64, or complex128 for a slow computation in double precision on the host.
    pitch: of the samples, in metres, one number or (x, y). wavelength: in metres. A Field knows
    both: rw.propagate(holo.field, distance=0.1).
    distance: in metres along the direction of travel; negative propagates back.
    shift: centre of the target minus centre of u, (x right, y up), in metres.
    padding: side of the transformed plane over the side of u, 1 to 64; from 2 on the plane is
        wider where the distance needs it.
    out_pitch, out_shape: of the points at which the field is told, about the target's centre: one
        number or (x, y), in metres, and (ny, nx); u's when not given. They may be finer, coarser,
        or in a wider window than u, and take four propagations for each window of u's size that
        they spread over.

    Returns an array of u's type, and of u's shape or out_shape. The adjoint of the propagation to
    u's own pitch is that by -distance and -shift; raywave.torch and raywave.jax, which keep u's
    pitch, differentiate through it.

    Relative L2 error <= 6e-7 (complex64) against direct summation for fields inside window and band
    (docs/accuracy.md); at points of another pitch 3e-7 (complex128: 3e-8). Raises InputError when u
    is not such an array or holds NaN, when a number is not possible, or when no frequency survives
    the band limit: the message gives the largest usable shift. Raises DeviceError for the device.
    """
    x, y = _pair(shift, "shift")
    pixels = _pixels(u, pitch, wavelength)
    if distance is None:
        raise _core.InputError("distance: is needed: pass distance=, in metres")
    result: npt.NDArray[np.complexfloating[Any, Any]] = _core.propagate(
        _plain(u),
        pixels,
        _number(distance, "distance"),
        (x, y),
        _number(padding, "padding"),
        None if out_pitch is None else _pair(out_pitch, "out_pitch"),
        None if out_shape is None else _shape(out_shape, "out_shape", 2**20),
        _text(device, "device"),
        _text(fft, "fft"),
    )
    if isinstance(u, Field):
        pitch = tuple(pixels.pitch_m) if out_pitch is None else out_pitch
        return Field(result, pitch, pixels.wavelength_m)
    return result


def reconstruct(
    field: ArrayLike | Hologram,
    z: float,
    view: Sequence[float] = (0.0, 0.0),
    *,
    aperture: Pair = 1.0,
    pupil: str | None = None,
    window: Pair | None = None,
    centre: Sequence[float] = (0.0, 0.0),
    pitch: Pair | None = None,
    wavelength: float | None = None,
    device: str = "",
    fft: str = "",
    progress: Progress = None,
) -> Picture:
    """The picture that a hologram shows in the plane z, as a sensor there would record it.

    field: (ny, nx) or (frames, ny, nx), complex64; or a Hologram, for the light that the SLM leaves
    with its levels. Pictures of several frames are averaged. Of several lasers, give the Hologram:
    each laser then has the power of Hologram.powers.
    z: place of the plane, in metres: > 0 beyond the hologram, < 0 on the eye's side, 0 its own.
    view: centre of the part of the hologram that lets light through, in half holograms: the
    position of the eye. aperture: size of that part in holograms, one number or (x, y).
    pupil: of an eye that is looked through: "3mm", "3mm@1mm,0", "scene" or "none", as `--pupil` of
    the command line, with places in the hologram's frame; of several places of the scene the first.
    The scene's behind its eyepiece when neither this, view nor aperture is given.
    window: size of the picture in metres, around centre, x and y of the scene; the hologram's when
    not given. pitch, wavelength: in metres; holo.field knows its own.
    progress: called with (step, share from 0 to 1); returning False raises Cancelled.

    Returns |u|^2, (ny, nx), float32, on the hologram's pitch; of several lasers linear sRGB,
    (ny, nx, 3). Raises InputError when z, window, view, aperture or pupil are not possible, or the
    field is not such an array; DeviceError.
    """
    from ._render import Hologram

    how = (
        _number(z, "z"),
        None if window is None else _pair(window, "window"),
        _pair(view, "view"),
        _pair(aperture, "aperture"),
        None if pupil is None else _text(pupil, "pupil"),
        _text(device, "device"),
        _text(fft, "fft"),
        progress,
        _pair(centre, "centre"),
    )
    result: Picture
    is_other = pitch is not None or wavelength is not None
    if isinstance(field, Hologram) and (len(field.wavelengths) > 1 or not is_other):
        if is_other:
            raise _core.InputError("pitch and wavelength: a hologram of several lasers has its own")
        result = _core.reconstruct_hologram(field._core, *how)
    else:
        pixels = _pixels(field, pitch, wavelength)
        samples = field.shown if isinstance(field, Hologram) else field
        result = _core.reconstruct(_plain(samples), pixels, *how)
    return result


def _slm(slm: Scene | Mapping[str, Value] | Path | None, pixels: _core.Pixels) -> _core.Slm:
    if slm is None:
        return _core.Slm()
    if isinstance(slm, Scene):
        return _core.Slm(slm._core)
    if isinstance(slm, Mapping):
        values = slm if set(slm) == {"slm"} else {"slm": dict(slm)}
        result = _core.parse_slm(_document(values), ".")
    elif _is_path(slm):
        result = _core.load_slm(os.fspath(slm), [])
    else:
        raise _core.InputError(
            "slm: must be a file with section [slm], a mapping of its keys, or a Scene, got "
            + type(slm).__name__
        )
    _warn(result.notes(pixels.wavelength_m), 4)
    return result


def encode(
    field: ArrayLike,
    slm: Scene | Mapping[str, Value] | Path | None = None,
    *,
    pitch: Pair | None = None,
    wavelength: float | None = None,
    device: str = "",
) -> LevelArray:
    """Grey levels with which an SLM shows a field.

    field: (ny, nx) or (frames, ny, nx), complex64.
    slm: keys of section [slm] (docs/slm.md), such as {"encoding": "double-phase",
    "shift": ["2 mm", "0 mm"]}; a file with that section; or a Scene, for its SLM. None: a
    phase-only SLM of 256 levels to a turn.
    pitch, wavelength: in metres; holo.field knows its own.

    Returns uint8 (uint16 where levels have more than 8 bits) of the field's shape, in the
    hologram's frame: slm.rotate and slm.flip are not applied. Raises InputError when the field is
    not such an array, or the SLM's pictures do not fit it; DeviceError.
    """
    pixels = _pixels(field, pitch, wavelength)
    how = _slm(slm, pixels)
    result: LevelArray = _core.encode(_plain(field), how, pixels, _text(device, "device"))
    return result


def pattern(
    pattern: str,
    shape: Sequence[int],
    pitch: Pair,
    wavelength: float,
    slm: Scene | Mapping[str, Value] | Path | None = None,
    *,
    focal: float = 0.3,
    period: float = 16.0,
    to: str = "right",
    device: str = "",
) -> LevelArray:
    """A test picture that tells on a bench whether an SLM is described right (docs/slm.md says what
    to see): the levels of `raywave pattern`.

    pattern: "lens", which focuses the light `focal` metres after the SLM (negative: it spreads the
    light); "blaze", which turns it "right", "left", "up" or "down" (`to`), `period` pixels to a
    turn of phase; "checker", of two squares in `period` pixels; "ramp", grey that rises to the
    right.
    shape: (ny, nx) of the SLM. pitch, wavelength: in metres. slm: as for encode.

    Returns uint8 (uint16 where levels have more than 8 bits), as the SLM is sent it: turned by
    slm.rotate, then flipped. Raises InputError when the pixels cannot show it, or an argument is
    not possible; DeviceError.
    """
    size = _shape(shape, "shape", 65536)
    pixels = _pixels(None, pitch, wavelength)
    result: LevelArray = _core.pattern(
        _text(pattern, "pattern"),
        size,
        pixels,
        _slm(slm, pixels),
        _number(focal, "focal"),
        _number(period, "period"),
        _text(to, "to"),
        _text(device, "device"),
    )
    return result


def shown(
    levels: ArrayLike,
    slm: Scene | Mapping[str, Value] | Path | None = None,
    *,
    pitch: Pair | None = None,
    wavelength: float | None = None,
) -> Field:
    """The light that leaves an SLM with these levels, behind the stop of its optics. Carrier, lens
    and corrections are taken off again, so that it compares with the field that was encoded.

    levels: (ny, nx) or (frames, ny, nx), uint8, or uint16 where levels have more than 8 bits.
    slm: as for encode. Returns complex64 of the same shape. Raises InputError.
    """
    pixels = _pixels(levels, pitch, wavelength)
    return Field(
        _core.shown(levels, _slm(slm, pixels), pixels), tuple(pixels.pitch_m), pixels.wavelength_m
    )


@dataclass(frozen=True)
class FieldComparison:
    """How alike two fields are; means over the frames."""

    correlation: float  # 1 when b is a times a number
    error: float  # |b - a| / |a|
    error_scaled: float  # |c b - a| / |a| with the complex number c that makes it smallest
    energy_ratio: float  # |b|^2 / |a|^2


@dataclass(frozen=True)
class PictureComparison:
    """How alike two pictures are, up to a common factor of brightness."""

    psnr_db: float  # infinite when b is a times a number
    ssim: float
    flip: float  # mean, of the colours of pictures in colour
    scale: float  # least-squares scale of b to a
    contrast_a: float  # speckle contrast
    contrast_b: float
    # CIEDE2000 of the pixels of pictures in colour: mean, median, what 95 % are within, largest.
    # The other figures are then of luminances
    delta_e: tuple[float, float, float, float] | None = None


def _figures(told: Any) -> PictureComparison:
    return PictureComparison(*told)


def _pixel(value: int) -> int:
    return _whole(value, "region", 0, _MOST)


def compare(
    a: ArrayLike,
    b: ArrayLike,
    *,
    blur: float = 0.0,
    border: int = 0,
    domain: str = "intensity",
    region: Sequence[int] | None = None,
) -> FieldComparison | PictureComparison:
    """Measures how alike b is to the reference a (docs/quality.md).

    a, b: pictures, float32, (ny, nx), or both (ny, nx, 3) in linear sRGB; or fields, (ny, nx) or
    (frames, ny, nx), complex64.
    For pictures only: blur, standard deviation in pixels of the Gaussian that both are blurred with
    first; border, pixels left out on every side; domain, "intensity", "amplitude" or "srgb";
    region, (x, y, width, height) of the speckle contrast.

    Returns PictureComparison or FieldComparison. Raises InputError when the shapes differ, a
    picture is black, or the options are not possible.
    """
    if np.iscomplexobj(a) or np.iscomplexobj(b):
        if blur != 0 or border != 0 or region is not None or domain != "intensity":
            raise _core.InputError("blur, border, domain and region are for pictures, not fields")
        return FieldComparison(*_core.compare_fields(_plain(a), _plain(b)))
    place: tuple[int, int, int, int] | None = None
    if region is not None:
        try:
            x, y, width, height = region
        except (TypeError, ValueError):
            raise _core.InputError(
                f"region: must be (x, y, width, height), got {region!r}"
            ) from None
        place = _pixel(x), _pixel(y), _pixel(width), _pixel(height)
    return _figures(
        _core.compare_pictures(
            a,
            b,
            _number(blur, "blur"),
            _whole(border, "border", 0, _MOST),
            _text(domain, "domain"),
            place,
        )
    )
