# SPDX-License-Identifier: Apache-2.0
"""An SLM that is an output of this computer."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

from . import _core
from ._light import _MOST, ArrayLike, _number, _shape


class Flip(NamedTuple):
    """What is known of a frame's arrival."""

    refresh: int  #: of the output, that the frame was new at; the first one's is 0
    time: float  #: seconds of the monotonic clock, as time.monotonic() has them
    latency: float  #: seconds since the frame was handed over


class Display:
    """Shows frames on an output while it is open, as `raywave show` does.

    shape      (ny, nx) of the output, and of frames
    output     its name, or maker, product and serial of its EDID; "": the only one
    backend    "window", "kms"; "": a window where there is a desktop
    rate       refreshes a second that the output must have; 0: any
    read_back  each frame as it was drawn; else the first of a window

    All calls come from one thread.
    """

    def __init__(
        self,
        shape: Sequence[int],
        output: str = "",
        *,
        backend: str = "",
        rate: float = 0,
        read_back: bool = False,
    ) -> None:
        nx, ny = _shape(shape, "shape", _MOST)
        self._shape = ny, nx
        self._display = _core.Display(
            nx, ny, output, backend, _number(rate, "rate"), bool(read_back)
        )

    def show(self, levels: ArrayLike) -> Flip:
        """Shows levels, uint8 of (ny, nx) or (ny, nx, 3), from the next refresh on, and waits."""
        shape = tuple(getattr(levels, "shape", self._shape))
        if shape not in (self._shape, (*self._shape, 3)):
            raise _core.InputError(f"levels: must have the shape {self._shape}, got {shape}")
        return Flip(*self._display.show(levels))

    def report(self) -> dict[str, Any]:
        """What shows, and which proof there is that frames arrived."""
        report: dict[str, Any] = json.loads(self._display.report())
        return report

    def close(self) -> None:
        """Leaves the output as it was."""
        self._display.close()

    def __enter__(self) -> Display:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
