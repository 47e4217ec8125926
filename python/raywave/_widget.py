# SPDX-License-Identifier: Apache-2.0
"""The widget of rw.view. Its front end is _widget.js."""

from __future__ import annotations

import pathlib
from typing import Any

import anywidget
from traitlets import Bytes, Float, Tuple, Unicode

from . import _core
from ._view import LivePicture, LiveView


class View(anywidget.AnyWidget):  # type: ignore[misc]
    """What rw.view returns."""

    _esm = pathlib.Path(__file__).with_name("_widget.js")
    focus = Float().tag(sync=True)
    view = Tuple(Float(), Float(), default_value=(0.0, 0.0)).tag(sync=True)
    aperture = Float(1.0).tag(sync=True)
    rotation = Tuple(Float(), Float(), Float()).tag(sync=True)
    picture = Bytes().tag(sync=True)
    message = Unicode().tag(sync=True)
    # Of the front end: degrees about x and y dragged so far, the focus's range
    drag = Tuple(Float(), Float(), default_value=(0.0, 0.0)).tag(sync=True)
    depths = Tuple(Float(), Float()).tag(sync=True)

    def __init__(self, live: LiveView, turns: int) -> None:
        self._live, self._object = live, turns
        self._position, rotation = live.poses[turns]
        middle, depth = live.focus, live.depth
        super().__init__(focus=middle, depths=(middle - depth, middle + depth), rotation=rotation)
        self._shown = self._wanted()
        self._show(self._seen())
        self.observe(self._look, list(self._shown))
        self.observe(self._dragged, "drag")

    def _wanted(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("focus", "view", "aperture", "rotation")}

    def _dragged(self, change: Any) -> None:
        (x, y), (old_x, old_y) = change.new, change.old
        self.rotation = _core.turned(self.rotation, (x - old_x, y - old_y, 0))

    def _look(self, _: Any) -> None:
        """Computes what has changed; where that cannot be, all stays as it was."""
        wanted = self._wanted()
        if wanted == self._shown:
            return
        try:
            self._show(self._seen())
        except (_core.InputError, _core.DeviceError) as error:
            with self.hold_trait_notifications():
                for name, value in self._shown.items():
                    self.set_trait(name, value)
            self.message = str(error)
            return
        self._shown = wanted

    def _seen(self) -> LivePicture:
        poses = {self._object: (self._position, self.rotation)}
        return self._live.look(self.focus, self.view, aperture=self.aperture, poses=poses)

    def _show(self, picture: LivePicture) -> None:
        self.picture = picture._repr_png_()
        times = {"hologram": picture.hologram_seconds, "picture": picture.picture_seconds}
        said = [f"{name} {1e3 * s:.0f} ms" for name, s in times.items() if s > 0]
        self.message = ", ".join([*said, picture.note] if picture.note else said)
