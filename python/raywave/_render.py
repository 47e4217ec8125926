# SPDX-License-Identifier: Apache-2.0
"""Plans, renders and holograms."""

from __future__ import annotations

import html
import json
import operator
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from . import _core
from ._light import (
    ArrayLike,
    ComplexArray,
    Field,
    LevelArray,
    Pair,
    Picture,
    Progress,
    _number,
    _pair,
    _pixels,
    _plain,
    _text,
    _whole,
)
from ._scene import (
    Scene,
    Value,
    Vector,
    _arrays_of,
    _one_wavelength,
    _overrides,
    _vector,
    _warn,
)


def _goal(
    preset: str | None, budget: float | None, psnr: float | None, rate: float | None
) -> _core.Goal:
    return _core.Goal(
        "" if preset is None else _text(preset, "preset"),
        None if budget is None else _number(budget, "budget"),
        None if psnr is None else _number(psnr, "psnr"),
        None if rate is None else _number(rate, "rate"),
    )


def _scene_of(scene: Scene | Plan) -> Scene:
    if isinstance(scene, Plan):
        return scene.scene
    if not isinstance(scene, Scene):
        raise _core.InputError(
            f"scene: must be a Scene (load_scene reads one) or a Plan, got {type(scene).__name__}"
        )
    return scene


class Plan:
    """What would be computed, and what to expect of it. Printed, it is the table of
    `raywave plan`; in a notebook, the same with the warnings set off.
    """

    def __init__(self, core: _core.Plan, scene: Scene) -> None:
        self._core = core
        self._meshes = scene._meshes

    @property
    def text(self) -> str:
        """The table that `raywave plan` prints."""
        return self._core.text

    @property
    def values(self) -> dict[str, Any]:
        """All of it, as `raywave plan --json` prints it."""
        return dict(json.loads(self._core.json()))

    @property
    def warnings(self) -> list[str]:
        """One line each: what a user may not want, and what would change it."""
        return self._core.warnings

    @property
    def seconds(self) -> float:
        """Predicted time of a picture."""
        return self._core.seconds

    @property
    def psnr_db(self) -> float | None:
        """Predicted mean PSNR of its pictures at the viewer's resolution, where it can be."""
        return self._core.psnr_db

    @property
    def device_bytes(self) -> int:
        """Memory on the device."""
        return self._core.device_bytes

    @property
    def scene(self) -> Scene:
        """The scene with the values that were chosen; render follows it."""
        return Scene._of(self._core.scene, self._meshes)

    def __repr__(self) -> str:
        return self.text.rstrip("\n")

    def _repr_html_(self) -> str:
        rows = []
        for line in self.text.splitlines():
            label, text = line[:10].strip(), line[10:]
            style = " style='color:#b00'" if label == "warning" else ""
            rows.append(
                f"<tr{style}><th style='text-align:left'>{html.escape(label)}</th>"
                f"<td style='text-align:left'>{html.escape(text)}</td></tr>"
            )
        return "<table>" + "".join(rows) + "</table>"


def plan(
    scene: Scene,
    preset: str | None = None,
    *,
    budget: float | None = None,
    psnr: float | None = None,
    rate: float | None = None,
    device: str = "",
) -> Plan:
    """Chooses what the scene leaves open, and predicts time, memory and quality.

    At most one goal: preset, "draft", "balanced", "accurate" or "reference"; budget, seconds for a
    picture: the most accurate plan that keeps them; psnr, in dB: the fastest plan that reaches it;
    rate, pictures a second: the most accurate plan that the device computes, and slm.rate shows,
    so fast.
    Needs no device; where there is one, rates that `raywave tune` has measured on it count.

    Raises InputError for the scene and the goal.
    """
    scene = _scene_of(scene)
    goal = _goal(preset, budget, psnr, rate)
    return Plan(_core.plan(scene._core, goal, _text(device, "device")), scene)


def _png(levels: npt.NDArray[np.uint8]) -> bytes:
    """An 8-bit PNG: grey, or red, green and blue of (ny, nx, 3)."""
    height, width = levels.shape[:2]
    lines = levels.reshape(height, -1)
    rows = np.zeros((height, lines.shape[1] + 1), np.uint8)  # first: filter "none"
    rows[:, 1:] = lines

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    colour = 2 if levels.ndim == 3 else 0
    header = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 1))
        + chunk(b"IEND", b"")
    )


class Hologram:
    """A finished hologram. Arrays are its own memory, without a copy, and stay valid after it.

    A scene of several lasers (docs/colour.md) has a hologram for each. Its levels and fields then
    have the shape (lasers, frames, ny, nx), in the order of `wavelengths`; `lasers` are the
    holograms of one wavelength each.
    """

    def __init__(self, core: _core.Hologram) -> None:
        self._core = core

    @cached_property
    def levels(self) -> npt.NDArray[np.uint8]:
        """Grey levels for the SLM, uint8: (ny, nx), or (frames, ny, nx) for several frames; of
        several lasers (lasers, frames, ny, nx). In the hologram's frame: slm.rotate and slm.flip
        are not applied (for_slm does).
        """
        result: npt.NDArray[np.uint8] = self._core.levels()
        return result

    @cached_property
    def field(self) -> Field | None:
        """The complex field before it is encoded, complex64, of the shape of levels. |u|^2 is the
        irradiance of what the scene shows. None where render was told to keep none.
        """
        return self._as_field(self._core.field())

    @cached_property
    def refined(self) -> Field | None:
        """Phases that are encoded instead of the field's, of modulus 1; None without refinement."""
        return self._as_field(self._core.refined())

    @cached_property
    def shown(self) -> Field:
        """The light that leaves the SLM with these levels, complex64, behind the stop."""
        return Field(self._core.shown(), self.pitch, self._wavelength)

    @cached_property
    def lasers(self) -> list[Hologram]:
        """The hologram of each laser, of one wavelength; [self] where it has one itself."""
        count = len(self.wavelengths)
        return [self] if count == 1 else [Hologram(self._core.laser(i)) for i in range(count)]

    @property
    def powers(self) -> tuple[float, ...]:
        """Radiant powers that the lasers need on the SLM for the colours to be right, for equal
        times; their sum is 1.
        """
        return tuple(self._core.powers)

    @cached_property
    def report(self) -> dict[str, Any]:
        """The report.json of `raywave render`: effective scene, plan, device, seconds, memory."""
        return dict(json.loads(self._core.report()))

    def for_slm(self, frame: int | None = None) -> LevelArray:
        """One frame as the SLM is sent it: turned by slm.rotate, then flipped, uint8. All of them,
        (frames, ny, nx), where there are several and no `frame` is named. Raises InputError for
        several lasers: ask one of `lasers`.
        """
        if frame is None and self.frames > 1:
            return np.stack([self.for_slm(i) for i in range(self.frames)])
        frame = _whole(0 if frame is None else frame, "frame", 0, self.frames - 1)
        result: LevelArray = self._core.for_slm(frame)
        return result

    @property
    def pitch(self) -> tuple[float, float]:
        """Pixel pitch, x and y, in metres."""
        x, y = self._core.pixels.pitch_m
        return x, y

    @property
    def wavelength(self) -> float:
        """In metres. Raises InputError for several lasers, which have `wavelengths`."""
        return _one_wavelength(self.wavelengths)

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """Of the lasers, in the scene's order, in metres; one of one wavelength."""
        return tuple(self._core.wavelengths)

    @property
    def _wavelength(self) -> float | None:
        return None if len(self.wavelengths) > 1 else self.wavelength

    @property
    def frames(self) -> int:
        """Number of frames, of each laser."""
        return self._core.frames

    @property
    def notes(self) -> list[str]:
        """Notes for the user, one line each."""
        return self._core.notes

    def save(self, path: Any, frame: int | None = None, *, rgb: bool = False) -> None:
        """Writes the frames, as the SLM is sent them, into 8-bit grey PNGs, or one alone.

        Path "holo.png" writes the second of several frames as holo_2.png. Of several lasers, it
        writes holo_638nm.png, holo_520nm.png and holo_450nm.png; with rgb, of three, holo.png
        alone, whose channels are the three holograms: the longest wavelength is red, the shortest
        blue.

        Raises InputError for a name that does not end with .png, and for rgb of other than three.
        """
        if frame is not None:
            frame = _whole(frame, "frame", 0, self.frames - 1)
        self._core.save(os.fspath(path), frame, bool(rgb))

    def _packed(self, pictures: list[LevelArray]) -> LevelArray:
        """One picture of three lasers: (ny, nx, 3), the longest wavelength first."""
        order = np.argsort(self.wavelengths)[::-1]
        return np.stack([pictures[i] for i in order], axis=-1)

    def _as_field(self, samples: ArrayLike) -> Field | None:
        return None if samples is None else Field(samples, self.pitch, self._wavelength)

    def __repr__(self) -> str:
        ny, nx = self.levels.shape[-2:]
        frames = "" if self.frames == 1 else f", {self.frames} frames"
        lasers = "" if len(self.wavelengths) == 1 else f", {len(self.wavelengths)} lasers"
        return f"<raywave.Hologram {nx} x {ny}{frames}{lasers}>"

    def _repr_png_(self) -> bytes:
        first = [laser.levels.reshape(-1, *laser.levels.shape[-2:])[0] for laser in self.lasers]
        return _png(self._packed(first) if len(first) == 3 else first[0])


def _options(
    preset: str | None,
    budget: float | None,
    psnr: float | None,
    rate: float | None,
    device: str,
    fft: str,
    method: str,
    rays: int,
    field: bool,
) -> _core.RenderOptions:
    return _core.RenderOptions(
        _text(device, "device"),
        _text(fft, "fft"),
        _goal(preset, budget, psnr, rate),
        _text(method, "method"),
        _whole(rays, "rays", 1, 1000),
        bool(field),
    )


def render(
    scene: Scene | Plan,
    preset: str | None = None,
    *,
    budget: float | None = None,
    psnr: float | None = None,
    rate: float | None = None,
    device: str = "",
    fft: str = "",
    method: str = "wrp",
    rays: int = 100,
    field: bool = True,
    progress: Progress = None,
) -> Hologram:
    """Computes the hologram of a scene: the same bits as `raywave render`, for equal scene, seed
    and device.

    scene: a Scene, or a Plan whose choices are followed.
    preset, budget, psnr, rate: at most one goal, as for plan.
    device: index ("0:1"), kind ("gpu", "cpu") or part of the name of an OpenCL device; "" takes the
    environment's RAYWAVE_DEVICE, else the fastest GPU, an accelerator or a CPU.
    fft: "host", "clfft" or "vkfft".
    method: "wrp"; or the references "points" and "rays" (with `rays` per axis and pixel).
    field: also keep the complex field; without it results take an eighth of the memory.
    progress: called with (step, share from 0 to 1); returning False raises Cancelled. Ctrl-C stops
    at the same places.

    Returns a Hologram: .levels, uint8, and .field, complex64, of the shape (ny, nx), or
    (frames, ny, nx) for several frames, row 0 on top; samples are scene.pitch metres apart. Of a
    scene of several lasers, the shape is (lasers, frames, ny, nx), and .powers tells what the
    lasers need.

    Raises InputError when the scene, a mesh or an option is wrong, DeviceError when the device
    cannot do it. Warns (UserWarning) with each line of Hologram.notes.
    """
    options = _options(preset, budget, psnr, rate, device, fft, method, rays, field)
    hologram = Hologram(_core.render(_scene_of(scene)._core, options, progress))
    _warn(hologram.notes)
    return hologram


@dataclass(frozen=True, eq=False)
class AnimationPicture:
    """A picture of an animation."""

    number: int
    time: float  # seconds
    # As the SLM is sent them, uint8: (ny, nx), or (holograms, ny, nx); of several lasers
    # (lasers, holograms, ny, nx)
    levels: LevelArray
    powers: tuple[float, ...]  # of several lasers; those of white have the sum 1


class Animation(Sequence[AnimationPicture]):
    """The pictures of a scene that moves, as rw.animate returns them: each is made when it is asked
    for, in any order.
    """

    def __init__(self, core: _core.Animation, progress: Progress) -> None:
        self._core, self._progress = core, progress

    def __len__(self) -> int:
        return self._core.pictures

    def __getitem__(self, index):  # type: ignore[no-untyped-def]
        if isinstance(index, slice):
            return [self[number] for number in range(*index.indices(len(self)))]
        number = operator.index(index)
        if number < 0:
            number += len(self)
        if not 0 <= number < len(self):
            raise IndexError(f"picture {index}: there are {len(self)}, counted from 0")
        time, levels, powers, notes = self._core.render(number, self._progress)
        _warn(notes)
        return AnimationPicture(number, time, levels, tuple(powers))

    @property
    def rate(self) -> float:
        """Pictures a second."""
        return self._core.rate

    @property
    def slm_rate(self) -> float:
        """Holograms of each laser a second."""
        return self._core.slm_rate

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """Of the lasers, in metres; one of one wavelength."""
        return tuple(self._core.wavelengths)

    @property
    def notes(self) -> list[str]:
        """Notes on the first picture for the user, one line each."""
        return self._core.notes

    def __repr__(self) -> str:
        return f"<raywave.Animation of {len(self)} pictures, {self.rate:g} a second>"


def animate(
    scene: Scene | Plan,
    preset: str | None = None,
    *,
    budget: float | None = None,
    psnr: float | None = None,
    rate: float | None = None,
    device: str = "",
    fft: str = "",
    progress: Progress = None,
) -> Animation:
    """The holograms of a scene with [animation] (docs/animation.md): the bits of `raywave animate`.

        for picture in rw.animate(scene):
            show(picture.levels)
        rw.animate(scene)[12].levels   # one of them

    Arguments as for render; a goal is planned for the scene at rest. Meshes come from files.

    Raises InputError when nothing moves, a mesh lies in memory, or an argument is wrong;
    DeviceError. Warns (UserWarning) with each line of Animation.notes.
    """
    options = _options(preset, budget, psnr, rate, device, fft, "wrp", 100, False)
    made = Animation(_core.Animation(_scene_of(scene)._core, options, progress), progress)
    _warn(made.notes)
    return made


class Renderer:
    """Renders a scene that moves: meshes, kernels, plans and memory are kept between pictures.

        r = rw.Renderer(scene)
        levels = np.empty(scene.shape, np.uint8)
        for angle in range(0, 360, 5):
            r.set_pose(0, (0, 0, 0.1), (0, angle, 0))
            r.render(out=levels)

    Arguments as for render. Calls of one renderer from several threads take turns. Fields differ
    from those of render by 1e-4 (relative L2) after objects have moved.
    """

    def __init__(
        self,
        scene: Scene | Plan,
        preset: str | None = None,
        *,
        budget: float | None = None,
        psnr: float | None = None,
        rate: float | None = None,
        device: str = "",
        fft: str = "",
        method: str = "wrp",
        rays: int = 100,
        field: bool = True,
        progress: Progress = None,
    ) -> None:
        options = _options(preset, budget, psnr, rate, device, fft, method, rays, field)
        self._core = _core.Renderer(_scene_of(scene)._core, options, progress)
        self._powers: tuple[float, ...] = (0.0,) * len(self._core.wavelengths)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of levels and fields: (ny, nx), or (frames, ny, nx) for several frames; of several lasers
        (3, frames, ny, nx).
        """
        plane = (self._core.ny, self._core.nx)
        if len(self._core.wavelengths) > 1:
            return (len(self._core.wavelengths), self._core.frames, *plane)
        return plane if self._core.frames == 1 else (self._core.frames, *plane)

    @property
    def powers(self) -> tuple[float, ...]:
        """Hologram.powers of the last picture; before the first, all are 0."""
        return self._powers

    @property
    def notes(self) -> list[str]:
        """Notes on the last picture for the user, one line each."""
        return self._core.notes

    def set_pose(
        self,
        object: int,
        position: Vector,
        rotation: Vector = (0.0, 0.0, 0.0),
        *,
        solid: bool = False,
    ) -> None:
        """Sets where an object stands: the place of its anchor (x, y, z), in metres, and its
        rotation in degrees about x, then y, then z. The anchor is the centre of the bounding box
        unless the scene says otherwise. solid: it keeps its size, as objects of [animation] do,
        whatever its `width` would make of the turned mesh, and turns about the middle of the box
        that it was placed with. Raises InputError for a pose that cannot be; the object then stays.
        """
        index = _whole(object, "object", 0, self._core.objects - 1)
        self._core.set_pose(
            index, _vector(position, "position"), _vector(rotation, "rotation"), solid
        )

    def set_mesh(self, object: int, mesh: Any) -> None:
        """Gives an object another mesh: arrays, points or a trimesh, as SceneObject.mesh takes
        them; poses, lights and what was planned stay. Trees are built anew: the teapot's next
        picture takes three to four times as long. Raises InputError for a mesh that cannot be;
        the renderer then stays as it was.
        """
        index = _whole(object, "object", 0, self._core.objects - 1)
        self._core.set_mesh(index, _core.MeshArrays(*_arrays_of(mesh)))

    def set_light(self, light: int, **values: Value) -> None:
        """Changes keys of a light, as scene files have them: set_light(0, direction=(0, 0, 1),
        intensity=0.5). Its type, falloff, highlights, samples and picture stay. Raises InputError
        for a key or a value that cannot be; the light then stays as it was.
        """
        index = _whole(light, "light", 0, 2**31 - 1)
        self._core.set_light(index, _overrides(values))

    def set_seed(self, seed: int) -> None:
        """Sets the seed of the random phases of the next pictures, 0 to 2^32 - 1."""
        self._core.set_seed(_whole(seed, "seed", 0, 2**32 - 1))

    @overload
    def render(self, out: None = ..., field: None = ..., progress: Progress = ...) -> Hologram: ...
    @overload
    def render(self, out: Any, field: Any = ..., progress: Progress = ...) -> Any: ...
    def render(self, out: Any = None, field: Any = None, progress: Progress = None) -> Any:
        """Renders the scene as it stands now.

        out: the caller's memory for the levels, uint8, of the shape `shape`, writable and
        C-contiguous; field: the same for the complex field, complex64. Returns out when either is
        given, else a Hologram.
        progress: as for render. Raises InputError, DeviceError, Cancelled; the renderer stays
        usable.
        """
        if out is None and field is None:
            hologram = Hologram(self._core.render(progress))
            self._powers = hologram.powers
            _warn(self.notes)
            return hologram
        self._powers = tuple(self._core.render_into(out, field, progress))
        _warn(self.notes)
        return out


def lens(
    scene: Scene | Plan,
    z: float,
    view: Sequence[float] = (0.0, 0.0),
    *,
    aperture: Pair = 1.0,
    pupil: str | None = None,
    window: Pair | None = None,
    points: int = 24,
    device: str = "",
    progress: Progress = None,
) -> Picture:
    """The picture that an ideal lens in the hologram's place sees of the scene, with the plane z
    (metres, as for reconstruct) in focus: the reference for reconstruct, pixel by pixel.

    view, aperture, pupil, window, progress: as for reconstruct. points: of the lens, per axis;
    their square is the number of rays per pixel.

    Returns radiance, (ny, nx), float32, on the hologram's pitch; of a scene of several lasers
    linear sRGB, (ny, nx, 3). Raises InputError when the scene, z, window, view, aperture, pupil
    or points are not possible; DeviceError.
    """
    x, y = _pair(view, "view")
    result: Picture = _core.lens(
        _scene_of(scene)._core,
        _number(z, "z"),
        None if window is None else _pair(window, "window"),
        (x, y),
        _pair(aperture, "aperture"),
        None if pupil is None else _text(pupil, "pupil"),
        _whole(points, "points", 1, 4096),
        _text(device, "device"),
        progress,
    )
    return result


def preview(
    scene: Scene | Plan,
    z: float | None = None,
    view: Sequence[float] = (0.0, 0.0),
    *,
    window: Pair | None = None,
    device: str = "",
) -> Picture:
    """What an eye sees of the scene through the middle of the hologram, all depths in focus, one
    ray to a pixel: the picture of `raywave preview`, at once.

    z: of the plane in which the picture is measured, in metres; the scene's middle when not given.
    view: as for reconstruct. window: size of the picture around the axis, in metres; all of the
    scene that the hologram's pixels can show when not given.

    Returns radiance, (ny, nx), float32, in the hologram's frame as rw.lens and rw.reconstruct: an
    eye sees image[:, ::-1]. Its pixels are the hologram's, or a whole number of times as large, so
    that the longer side has at most 320 or so. Of a scene of several lasers linear sRGB,
    (ny, nx, 3). Raises InputError when the scene, z, window or view are not possible; DeviceError.
    """
    x, y = _pair(view, "view")
    result: Picture = _core.preview(
        _scene_of(scene)._core,
        None if z is None else _number(z, "z"),
        None if window is None else _pair(window, "window"),
        (x, y),
        _text(device, "device"),
    )
    return result


@overload
def refine(
    scene: Scene | Plan,
    *,
    iterations: int | None = ...,
    views: int | None = ...,
    depths: Sequence[float] = ...,
    brightness: float | None = ...,
    blur: float | None = ...,
    lens_points: int | None = ...,
    refine_budget: float | None = ...,
    preset: str | None = ...,
    device: str = ...,
    fft: str = ...,
    progress: Progress = ...,
) -> Hologram: ...
@overload
def refine(
    scene: ComplexArray,
    *,
    targets: Mapping[float, ArrayLike],
    iterations: int | None = ...,
    brightness: float | None = ...,
    blur: float | None = ...,
    refine_budget: float | None = ...,
    pitch: Pair | None = ...,
    wavelength: float | None = ...,
    device: str = ...,
    fft: str = ...,
    progress: Progress = ...,
) -> Field: ...
def refine(
    scene: Any,
    *,
    targets: Mapping[float, ArrayLike] | None = None,
    iterations: int | None = None,
    views: int | None = None,
    depths: Sequence[float] = (),
    brightness: float | None = None,
    blur: float | None = None,
    lens_points: int | None = None,
    refine_budget: float | None = None,
    pitch: Pair | None = None,
    wavelength: float | None = None,
    preset: str | None = None,
    device: str = "",
    fft: str = "",
    progress: Progress = None,
) -> Hologram | Field:
    """Changes the phases of a hologram until its pictures are what a lens sees (docs/refine.md).

    refine(scene) renders the scene first, and returns a Hologram with .refined and its .levels.
    refine(field, targets={z: picture}) starts from a field, (ny, nx) or (frames, ny, nx),
    complex64, towards pictures, (ny, nx), float32, as lens returns them on the field's pitch; it
    returns a Field of modulus 1, to be encoded for a phase SLM. pitch and wavelength, in metres,
    are needed for arrays that do not know them.

    iterations: per frame; refine_budget: seconds for all of them, instead. views: pictures through
    quarters of the hologram (24 where iterations, time and depths are open). depths: of the
    pictures, ascending, in metres. brightness: light wanted in the pictures (1.15 brings 0.93 of it
    there). blur: of the pictures, standard deviation in metres. lens_points: per axis of the lens.
    What is not given comes from the scene's section [refine], or its defaults.

    Raises InputError when the SLM shows no phases, or an argument is not possible; DeviceError.
    """
    try:
        wanted_depths = [_number(depth, "depths") for depth in depths]
    except TypeError:
        raise _core.InputError(
            f"depths: must be numbers, ascending, got {depths!r}"
        ) from None
    options = _core.RefineOptions(
        None if iterations is None else _whole(iterations, "iterations", 1, 10**6),
        None if views is None else _whole(views, "views", 0, 1000),
        None if lens_points is None else _whole(lens_points, "lens_points", 2, 100),
        None if brightness is None else _number(brightness, "brightness"),
        None if blur is None else _number(blur, "blur"),
        None if refine_budget is None else _number(refine_budget, "refine_budget"),
        wanted_depths,
    )
    if isinstance(scene, (Scene, Plan)):
        if targets is not None:
            raise _core.InputError("targets: belong to a field; a scene makes its own pictures")
        how = _options(preset, None, None, None, device, fft, "wrp", 100, True)
        hologram = Hologram(_core.refine_scene(_scene_of(scene)._core, options, how, progress))
        _warn(hologram.notes)
        return hologram
    if not isinstance(targets, Mapping) or not targets:
        raise _core.InputError("targets: are needed to refine a field, as {z: picture}")
    if preset is not None or views is not None or wanted_depths or lens_points is not None:
        raise _core.InputError("preset, views, depths and lens_points belong to a scene")
    pixels = _pixels(scene, pitch, wavelength)
    wanted = [
        (_number(z, "targets"), picture, (0.0, 0.0), (1.0, 1.0)) for z, picture in targets.items()
    ]
    on = _text(device, "device"), _text(fft, "fft")
    result = _core.refine_field(_plain(scene), pixels, wanted, options, *on, progress)
    return Field(result, tuple(pixels.pitch_m), pixels.wavelength_m)
