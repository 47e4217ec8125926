# SPDX-License-Identifier: Apache-2.0
"""A scene that is turned and looked at in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._light import Pair, _pair, _whole
from ._render import Plan, _scene_of, plan
from ._scene import Scene

if TYPE_CHECKING:
    from ._widget import View


def view(
    scene: Scene | Plan,
    preset: str | None = None,
    *,
    object: int = 0,
    window: Pair | None = None,
    device: str = "",
) -> View:
    """A widget for notebooks: what the hologram shows, as an eye sees it. Dragging turns an object,
    sliders move the focus and the part of the hologram that is looked through; a turn computes a
    hologram, all else the picture alone. Needs anywidget: pip install "raywave[widget]".

    scene, preset, device: as for render. object: the one that turns. window: size of the picture in
    metres, around the scene's middle; the scene and a fifth more when not given.

    Returns an anywidget.AnyWidget with the traits focus (metres), view and aperture (as for
    reconstruct), rotation (degrees), picture (a PNG of about 640 pixels a side, exposed as
    `raywave reconstruct` does, and blurred as the viewer sees the scene's middle) and message
    (times; or what was wrong, and the other traits are as they were).

    Raises InputError when the scene or an argument is wrong, DeviceError, ImportError.
    """
    try:
        from ._widget import View
    except ModuleNotFoundError as error:
        raise ImportError(
            f'rw.view needs anywidget ({error}): pip install "raywave[widget]"', name=error.name
        ) from error
    if not isinstance(scene, Plan) or preset is not None:
        scene = plan(_scene_of(scene), preset, device=device)
    turns = _whole(object, "object", 0, len(scene.scene.objects) - 1)
    return View(scene, turns, None if window is None else _pair(window, "window"), device)
