# SPDX-License-Identifier: Apache-2.0
"""How well a hologram shows its scene, and what that costs."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._light import (
    Pair,
    Picture,
    PictureComparison,
    Progress,
    _figures,
    _number,
    _pair,
    _text,
    _whole,
)
from ._render import Hologram, Plan, _png, _scene_of, render
from ._scene import Scene


@dataclass(frozen=True)
class QualityRow:
    """A picture of the hologram against that of an ideal lens."""

    z: float  # metres
    # Through the "whole" hologram, its "left", "right", "top" or "bottom" to the eye, or a "pupil"
    view: str
    levels: PictureComparison  # of what the SLM shows
    field: PictureComparison  # of the complex field, which no SLM shows
    light_share: float  # of the SLM's light, that falls into the picture
    haze: float | None  # where the lens sees nothing, of its brightest pixel
    # Linear values, without the border, averaged over squares to at most 640 columns
    lens: Picture
    hologram: Picture
    pupil: tuple[float, float, float]  # diameter and place (x, y) of a "pupil", metres


class Quality(Sequence[QualityRow]):
    """The rows of `raywave quality`. Printed, they are a table; so they are in a notebook."""

    def __init__(self, rows: Sequence[QualityRow]) -> None:
        self._rows = tuple(rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index):  # type: ignore[no-untyped-def]
        return self._rows[index]

    @property
    def psnr_db(self) -> float:
        """Mean of the pictures through the whole hologram, or through pupils."""
        whole = [row.levels.psnr_db for row in self._rows if row.view in ("whole", "pupil")]
        return sum(whole) / len(whole)

    def _cells(self) -> list[list[str]]:
        is_colour = self._rows[0].levels.delta_e is not None
        head = ["depth, mm", "view", "PSNR, dB", "SSIM", "FLIP", "light", "haze", "field: PSNR, dB"]
        rows = [head + (["Delta E mean"] if is_colour else [])]
        for row in self._rows:
            rows.append([
                f"{row.z * 1e3:.6g}",
                row.view if row.view != "pupil" else
                "pupil of {:.6g} mm at {:.6g}, {:.6g}".format(*(1e3 * v for v in row.pupil)),
                f"{row.levels.psnr_db:.2f}",
                f"{row.levels.ssim:.4f}",
                f"{row.levels.flip:.4f}",
                f"{row.light_share:.2f}",
                "-" if row.haze is None else f"{row.haze:.4f}",
                f"{row.field.psnr_db:.2f}",
                *([f"{row.levels.delta_e[0]:.2f}"] if row.levels.delta_e else []),
            ])
        return rows

    def __repr__(self) -> str:
        rows = self._cells()
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        return "\n".join(
            "  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows
        )

    def _repr_html_(self) -> str:
        head, *rows = self._cells()
        lines = ["".join(f"<th>{html.escape(cell)}</th>" for cell in head)]
        lines += ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows]
        return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def quality(
    of: Scene | Plan | Hologram,
    depths: Sequence[float] = (),
    *,
    views: bool = True,
    pupils: Sequence[str] = (),
    window: Pair | None = None,
    blur: float | None = None,
    border: int = 20,
    lens_points: int = 6,
    device: str = "",
    fft: str = "",
    progress: Progress = None,
) -> Quality:
    """Compares what a hologram's levels show with what an ideal lens sees of its scene: the figures
    of `raywave quality` (docs/quality.md).

    of: a Hologram that was rendered with its field; or a Scene or Plan, which is rendered first.
    depths: of the pictures, in metres; by default the nearest and the farthest surface, and a
    little in front. views: at the first depth also through the left, right, top and bottom of the
    hologram. pupils: that are looked through instead, as for reconstruct.
    window: size of the pictures around the axis, in metres. blur: standard deviation in metres of
    the Gaussian that pictures are blurred with; by default 0.6 of the
    detail that the viewer makes out, at which plans predict, and in a goal's window. border: pixels
    that are left out on every side after it. lens_points: per axis of the lens.
    progress: as for render.

    Raises InputError when the hologram has no field, or an argument is not possible; DeviceError.
    """
    if not isinstance(of, Hologram):
        of = render(of, device=device, fft=fft, progress=progress)
    try:
        wanted = [_number(depth, "depths") for depth in depths]
    except TypeError:
        raise _core.InputError(f"depths: must be numbers, got {depths!r}") from None
    rows = _core.quality(
        of._core,
        wanted,
        None if window is None else _pair(window, "window"),
        None if blur is None else _number(blur, "blur"),
        bool(views),
        [_text(pupil, "pupils") for pupil in ([pupils] if isinstance(pupils, str) else pupils)],
        _whole(lens_points, "lens_points", 1, 4096),
        _whole(border, "border", 0, 2**20),
        _text(device, "device"),
        _text(fft, "fft"),
        progress,
    )
    return Quality([
        QualityRow(z, view, _figures(levels), _figures(field), *rest)
        for z, view, levels, field, *rest in rows
    ])


@dataclass(frozen=True, eq=False)
class Trade:
    """What the settings of a scene cost in time and gain in accuracy. Printed, it is what
    `raywave trade` prints; a notebook shows its pictures.
    """

    text: str
    json: str  # trade.json (docs/planning.md)
    csv: str  # trade.csv
    # Along the frontier: rows are depths, columns the lens, then the fastest first; (height, width,
    # 3), uint8, sRGB
    sheet: npt.NDArray[np.uint8]

    @cached_property
    def values(self) -> dict[str, Any]:
        """All of trade.json: "rows", and "frontier", "presets" and "steps", which name rows."""
        return dict(json.loads(self.json))

    def __repr__(self) -> str:
        return self.text.rstrip("\n")

    def _repr_png_(self) -> bytes:
        return _png(self.sheet)


def trade(
    scene: Scene,
    depths: Sequence[float] = (),
    *,
    quick: bool = False,
    presets: bool = False,
    exhaustive: bool = False,
    renders: int = 0,
    window: Pair | None = None,
    views: bool = True,
    lens_points: int = 8,
    border: int = 20,
    against_points: bool | None = None,
    folder: Any = None,
    device: str = "",
    fft: str = "",
    progress: Progress = None,
) -> Trade:
    """Renders, times and judges configurations of a scene, as `raywave trade` does: minutes to
    hours. Settings that the scene gives stay as they are.

    quick: fewer values of each setting. presets: nothing but the presets. exhaustive: all
    combinations that plans choose among. renders: timed per configuration; 0: 3 to 15 in a second.
    depths, window, views, lens_points, border: as for quality. against_points: compare presets and
    single settings with the sum of all points; by default up to 512 x 512 pixels.
    folder: where trade.json, trade.csv and trade.png are written, and an earlier run is gone on
    with. progress: as for render.

    Raises InputError when the scene or an argument is not possible; DeviceError.
    """
    try:
        wanted = [_number(depth, "depths") for depth in depths]
    except TypeError:
        raise _core.InputError(f"depths: must be numbers, got {depths!r}") from None
    return Trade(*_core.trade(
        _scene_of(scene)._core,
        bool(quick),
        bool(presets),
        bool(exhaustive),
        _whole(renders, "renders", 0, 1000),
        wanted,
        None if window is None else _pair(window, "window"),
        bool(views),
        _whole(lens_points, "lens_points", 1, 4096),
        _whole(border, "border", 0, 2**20),
        None if against_points is None else bool(against_points),
        "" if folder is None else os.fspath(folder),
        _text(device, "device"),
        _text(fft, "fft"),
        progress,
    ))
