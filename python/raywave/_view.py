# SPDX-License-Identifier: Apache-2.0
"""A scene under the hand: it is turned and looked at."""

from __future__ import annotations

from collections.abc import ItemsView, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._light import Pair, _number, _pair, _text, _whole
from ._render import Plan, _goal, _png, _scene_of
from ._scene import Scene, Value, Vector, _overrides, _vector, _warn

if TYPE_CHECKING:
    from ._widget import View


@dataclass(frozen=True, eq=False)
class LivePicture:
    """A picture of LiveView.look. Notebooks show it."""

    image: npt.NDArray[np.uint8]  # (ny, nx, 3), sRGB, as an eye sees it
    hologram_seconds: float  # 0 where nothing had moved
    picture_seconds: float
    note: str  # on this picture; empty: none

    def _repr_png_(self) -> bytes:
        return _png(self.image)


def _items(mapping: Mapping[int, Any] | None, name: str) -> ItemsView[int, Any]:
    if mapping is not None and not isinstance(mapping, Mapping):
        raise _core.InputError(f"{name}: must be a mapping by number, got {mapping!r}")
    return (mapping or {}).items()


class LiveView:
    """What the hologram of a scene shows while the scene is turned: the pictures of `raywave view`,
    the same bits for the same pictures in turn. Meshes, kernels, plans and memory are kept.

        live = rw.LiveView(scene, preset="draft")
        position, rotation = live.poses[0]
        for angle in range(0, 360, 5):
            picture = live.look(poses={0: (position, (0, angle, 0))})
            show(picture.image)                        # (ny, nx, 3), uint8
        live.look(focus=0.098, view=(0.5, 0), aperture=0.5)

    Arguments as for render; longest: pixels of the longer side of a picture. Calls of one from
    several threads take turns.
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
        longest: int = 640,
    ) -> None:
        self._core = _core.LiveView(
            _scene_of(scene)._core,
            _goal(preset, budget, psnr, rate),
            _text(device, "device"),
            _text(fft, "fft"),
            _whole(longest, "longest", 16, 4096),
        )
        self._focus, poses = self._core.start()
        self._poses = [(_vector(at, "position"), _vector(turn, "rotation")) for at, turn in poses]

    @property
    def poses(self) -> list[tuple[tuple[float, float, float], tuple[float, float, float]]]:
        """Position and rotation of each object as the scene has it."""
        return list(self._poses)

    @property
    def focus(self) -> float:
        """Depth of the scene's middle, or of its end where that is the hologram, in metres."""
        return self._focus

    @property
    def depth(self) -> float:
        """Of the scene as it stands, in metres; at least a tenth of its distance."""
        return self._core.depth()

    @property
    def window(self) -> tuple[float, float]:
        """Sides of a picture around the axis, in metres."""
        x, y = self._core.window
        return x, y

    @property
    def notes(self) -> list[str]:
        """Notes on the last hologram, one line each. They take longer than a hologram."""
        return self._core.notes()

    def look(
        self,
        focus: float | None = None,
        view: Sequence[float] = (0.0, 0.0),
        *,
        aperture: float = 1.0,
        pupil: float | None = None,
        poses: Mapping[int, tuple[Vector, Vector]] | None = None,
        lights: Mapping[int, Mapping[str, Value]] | None = None,
        levels: bool = False,
        lens: bool = False,
        stops: float = 0.0,
        preset: str | None = None,
        refined: bool = False,
    ) -> LivePicture:
        """A picture. Objects that have moved, other lights and plans take a hologram, all else does
        not.

        focus: depth that is sharp, in metres; that of `focus` when not given. view, aperture: as
        for reconstruct, in the hologram's frame (the picture is as an eye sees it, with x to the
        left), -1 to 1 and 0.01 to 1; not behind an eyepiece, where the viewer's first pupil looks.
        pupil: across, in metres: a square of the hologram in place of aperture; behind an eyepiece
        in place of the viewer's own. poses: {object: (position, rotation)}, of solids as
        Renderer.set_pose has them. lights: {light: {"direction": (0, 0, 1), ...}}, keys that
        Renderer.set_light takes. Objects and lights that are not named are the scene's. levels,
        lens: beside the picture, which gets as much wider. stops: exposure, over the automatic one.
        preset: in place of the goal that it began with. refined: levels in 4 iterations.

        Raises InputError for what cannot be seen; the next look is as if nobody had asked.
        DeviceError.
        """
        wanted = list(self._poses)
        for number, pose in _items(poses, "poses"):
            index = _whole(number, "poses: object", 0, len(wanted) - 1)
            try:
                position, rotation = pose
            except (TypeError, ValueError):
                raise _core.InputError(
                    f"poses: must be (position, rotation) of an object, got {pose!r}"
                ) from None
            wanted[index] = _vector(position, "position"), _vector(rotation, "rotation")
        shining = [
            (_whole(light, "lights: light", 0, 2**31 - 1), _overrides(values))
            for light, values in _items(lights, "lights")
        ]
        image, hologram, picture, note = self._core.look(
            wanted,
            shining,
            self._focus if focus is None else _number(focus, "focus"),
            _pair(view, "view"),
            _number(aperture, "aperture"),
            None if pupil is None else _number(pupil, "pupil"),
            bool(levels),
            bool(lens),
            _number(stops, "stops"),
            "" if preset is None else _text(preset, "preset"),
            bool(refined),
        )
        return LivePicture(image, hologram, picture, note)


def view(
    scene: Scene | Plan,
    preset: str | None = None,
    *,
    object: int = 0,
    device: str = "",
) -> View:
    """A widget for notebooks: the pictures of LiveView. Dragging turns an object, sliders move the
    focus and the part of the hologram that is looked through; a turn computes a hologram, all else
    the picture alone. Needs anywidget: pip install "raywave[widget]".

    scene, preset, device: as for render. object: the one that turns.

    Returns an anywidget.AnyWidget with the traits focus (metres), view and aperture (as for
    LiveView.look), rotation (degrees), picture (a PNG) and message (times; or what was wrong, and
    the other traits are as they were).

    Raises InputError when the scene or an argument is wrong, DeviceError, ImportError. Warns
    (UserWarning) with each line of LiveView.notes.
    """
    try:
        from ._widget import View
    except ModuleNotFoundError as error:
        raise ImportError(
            f'rw.view needs anywidget ({error}): pip install "raywave[widget]"', name=error.name
        ) from error
    turns = _whole(object, "object", 0, len(_scene_of(scene).objects) - 1)
    live = LiveView(scene, preset, device=device)
    _warn(live.notes)
    return View(live, turns)
