# SPDX-License-Identifier: Apache-2.0
"""raywave: photorealistic holograms for spatial light modulators (SLMs), from meshes.

    import raywave as rw

    scene = rw.load_scene("teapot.toml", {"hologram.pitch": "8 um"})
    holo = rw.render(scene)                       # holo.levels, holo.field
    slm.display(holo.for_slm())                   # turned and flipped as the SLM is sent it
    image = rw.reconstruct(holo.field, z=0.1)     # what it shows 100 mm away

Lengths are metres, angles degrees. Planes are arrays of the shape (ny, nx): row 0 on top (largest
y), column 0 left (smallest x), as seen along the light, which travels towards -z; several frames
are (frames, ny, nx). The hologram lies in the plane z = 0, objects at z > 0, at z < 0 or
on both sides. A wave that diverges is exp(+i k r).

Functions take NumPy arrays, buffers, and whatever speaks DLPack (torch tensors on the CPU, JAX
arrays), in host memory; they return NumPy arrays. Wrong input raises InputError (a
ValueError) whose one line names the argument; what the OpenCL device cannot do raises DeviceError
(a RuntimeError).

The GIL is released while something is computed. Objects may be used from several threads; calls on
one Renderer or LiveView take turns. Ctrl-C stops a computation at its next step. Processes must
not go on computing after os.fork(): use multiprocessing's start method "spawn".
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

try:
    from ._core import Cancelled, Device, DeviceError, InputError
    from ._core import version as __version__
except ImportError as error:  # the loader of OpenCL drivers is the system's
    if "libOpenCL" in str(error):
        raise ImportError(
            "raywave needs an OpenCL loader and a driver: on Debian and Ubuntu, "
            "apt install ocl-icd-libopencl1 pocl-opencl-icd"
        ) from error
    raise

from . import metrics
from ._display import Display, Flip
from ._light import (
    Field,
    FieldComparison,
    PictureComparison,
    compare,
    devices,
    encode,
    pattern,
    propagate,
    reconstruct,
    shown,
)
from ._quality import Quality, QualityRow, Trade, quality, trade
from ._render import (
    Animation,
    AnimationPicture,
    Hologram,
    Plan,
    Renderer,
    animate,
    lens,
    plan,
    preview,
    refine,
    render,
)
from ._scene import Scene, SceneObject, load_scene
from ._view import LivePicture, LiveView, view

if TYPE_CHECKING:
    from . import jax, torch

for _type in (Cancelled, Device, DeviceError, InputError):
    _type.__module__ = "raywave"
InputError.__doc__ = "Something given is wrong: one line says what, where, and what would be right."
DeviceError.__doc__ = "The OpenCL device, its driver or memory cannot do what was asked."
Cancelled.__doc__ = "A progress callback has returned False."

__all__ = [
    "Animation",
    "AnimationPicture",
    "Cancelled",
    "Device",
    "DeviceError",
    "Display",
    "Field",
    "FieldComparison",
    "Flip",
    "Hologram",
    "InputError",
    "LivePicture",
    "LiveView",
    "PictureComparison",
    "Plan",
    "Quality",
    "QualityRow",
    "Renderer",
    "Scene",
    "SceneObject",
    "Trade",
    "__version__",
    "animate",
    "compare",
    "devices",
    "encode",
    "jax",
    "lens",
    "load_scene",
    "metrics",
    "pattern",
    "plan",
    "preview",
    "propagate",
    "quality",
    "reconstruct",
    "refine",
    "render",
    "shown",
    "torch",
    "trade",
    "view",
]


def __getattr__(name: str) -> Any:
    """Loads raywave.torch and raywave.jax when they are first asked for."""
    if name in ("torch", "jax"):
        import importlib

        try:
            return importlib.import_module("." + name, __name__)
        except ModuleNotFoundError as error:  # help() passes over what is no attribute
            raise AttributeError(f"raywave.{name} needs the package {error.name}") from error
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__all__", "__doc__", "__file__", "__name__", "__path__", "__spec__"]
