# SPDX-License-Identifier: Apache-2.0
"""The widget of rw.view. Its front end is _widget.js."""

from __future__ import annotations

import pathlib
import time
from typing import Any

import anywidget
import numpy as np
from traitlets import Bytes, Float, Tuple, Unicode

from . import _core
from ._light import reconstruct
from ._render import Hologram, Plan, Renderer, _png
from ._scene import Vector
from .metrics import Doubles, _blurred, _encoded

_LONGEST = 640  # pixels of a picture's longer side, about


def _matrix(rotation: Vector) -> Doubles:
    """Of degrees about x, then y, then z."""
    all_turns: Doubles = np.eye(3)
    for degrees, (i, j) in zip(rotation, ((1, 2), (2, 0), (0, 1))):
        turn = np.eye(3)
        turn[i, i] = turn[j, j] = np.cos(np.radians(degrees))
        turn[j, i] = np.sin(np.radians(degrees))
        turn[i, j] = -turn[j, i]
        all_turns = turn @ all_turns
    return all_turns


def _turned(rotation: Vector, about_x: float, about_y: float) -> Any:
    """A rotation that is turned further, about the hologram's x, then y."""
    r = _matrix((about_x, about_y, 0)) @ _matrix(rotation)
    y = -np.arcsin(np.clip(r[2, 0], -1, 1))
    return np.degrees((np.arctan2(r[2, 1], r[2, 2]), y, np.arctan2(r[1, 0], r[0, 0]))).tolist()


class View(anywidget.AnyWidget):  # type: ignore[misc]
    """What rw.view returns."""

    _esm = pathlib.Path(__file__).with_name("_widget.js")
    focus = Float().tag(sync=True)
    view = Tuple(Float(), Float(), default_value=(0.0, 0.0)).tag(sync=True)
    aperture = Float(1.0).tag(sync=True)
    rotation = Tuple(Float(), Float(), Float()).tag(sync=True)
    picture = Bytes().tag(sync=True)
    message = Unicode().tag(sync=True)
    # Of the front end: degrees about x and y dragged so far, the picture's size, the focus's range
    drag = Tuple(Float(), Float(), default_value=(0.0, 0.0)).tag(sync=True)
    window = Tuple(Float(), Float()).tag(sync=True)
    depths = Tuple(Float(), Float()).tag(sync=True)

    def __init__(self, plan: Plan, turns: int, window: Any, device: str) -> None:
        values = plan.values
        if "colour" in values:
            values = values["colour"]["lasers"][0]["plan"]
        low, high = np.array(values["bounds_m"])
        sides, (x, y, z) = high - low, ((low + high) / 2).tolist()
        if abs(z) < 1e-2 * sides[2]:  # the hologram's own plane has no picture
            z = float(high[2])
        scene, depth = plan.scene, max(sides[2].item(), abs(z) / 10)
        if window is None:  # objects that turn leave their box; pixels show what they diffract to
            pitch, size = np.array(scene.pitch), np.array(scene.shape[::-1])
            most = size * pitch + max(scene.wavelengths) / pitch * max(abs(low[2]), abs(high[2]))
            window = np.minimum(1.2 * np.maximum(sides[:2], sides.max() / 4), most).tolist()
        turned = scene.objects[turns]
        super().__init__(focus=z, depths=(z - depth, z + depth), rotation=turned.rotation,
                         window=window)
        self._object, self._position = turns, turned.position
        self._centre, self._device = (x, y), device
        self._blur = 0.6 * values["prediction"]["resolution_m"] / scene.pitch[0]
        self._renderer = Renderer(plan, device=device)
        self._hologram = self._renderer.render()
        self._shown = self._wanted()
        self.picture = self._picture(self._hologram)
        self.observe(self._look, list(self._shown))
        self.observe(self._dragged, "drag")

    def _wanted(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("focus", "view", "aperture", "rotation")}

    def _dragged(self, change: Any) -> None:
        self.rotation = _turned(self.rotation, *np.subtract(change.new, change.old))

    def _look(self, _: Any) -> None:
        """Computes what has changed; where that cannot be, all stays as it was."""
        wanted, hologram, said, start = self._wanted(), self._hologram, "", time.perf_counter()
        if wanted == self._shown:
            return
        try:
            if self.focus == 0:
                raise _core.InputError("focus 0: the hologram's own plane has no picture")
            if self.rotation != self._shown["rotation"]:
                self._renderer.set_pose(self._object, self._position, self.rotation, solid=True)
                hologram = self._renderer.render()
                traced, start = time.perf_counter() - start, time.perf_counter()
                said = f"hologram {1e3 * traced:.0f} ms, "
            self.picture = self._picture(hologram)
        except (_core.InputError, _core.DeviceError) as error:
            with self.hold_trait_notifications():
                for name, value in self._shown.items():
                    self.set_trait(name, value)
            self.message = str(error)
            return
        self._hologram, self._shown = hologram, wanted
        self.message = f"{said}picture {1e3 * (time.perf_counter() - start):.0f} ms"

    def _picture(self, hologram: Hologram) -> bytes:
        light = reconstruct(hologram, self.focus, self.view, aperture=self.aperture,
                            window=self.window, centre=self._centre, device=self._device)
        light = light[:, ::-1]  # as an eye sees it
        cell = min(max(1, round(max(light.shape) / _LONGEST)), *light.shape[:2])
        ny, nx = light.shape[0] // cell, light.shape[1] // cell
        cells = light[: ny * cell, : nx * cell].reshape(ny, cell, nx, cell, *light.shape[2:])
        means = cells.mean((1, 3), dtype=np.float64)
        seen = _blurred(means, min(self._blur / cell, _LONGEST / 4))
        brightest = seen.max(2) if seen.ndim == 3 else seen
        white = np.percentile(brightest, 99.5) or brightest.max() or 1
        return _png(np.rint(255 * _encoded(seen / white)).astype(np.uint8))
