# SPDX-License-Identifier: Apache-2.0
"""Propagation for PyTorch, differentiable: raywave.torch.propagate.

The gradient is the adjoint, which is the propagation by the opposite distance and shift. It is
itself differentiable. Tensors live in host memory; complex128 is computed in double precision, for
checks such as torch.autograd.gradcheck.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import torch

from . import _core
from ._light import Pair
from ._light import propagate as _propagate

__all__ = ["propagate"]


class _Propagate(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(ctx: Any, u: Any, how: Any) -> Any:
        ctx.how = how
        pitch, wavelength, distance, shift, options = how
        planes = u.detach().contiguous().resolve_conj().resolve_neg()
        planes = planes.numpy().reshape(-1, *u.shape[-2:])
        result = np.empty(planes.shape, planes.dtype)
        for i, plane in enumerate(planes):
            result[i] = _propagate(plane, pitch, wavelength, distance, shift, **options)
        return torch.from_numpy(result.reshape(u.shape))

    @staticmethod
    def backward(ctx: Any, gradient: Any) -> Any:
        pitch, wavelength, distance, (x, y), options = ctx.how
        back = (pitch, wavelength, -distance, (-x, -y), options)
        return _Propagate.apply(gradient, back), None


def propagate(
    u: Any,
    pitch: Pair,
    wavelength: float,
    distance: float,
    shift: Sequence[float] = (0.0, 0.0),
    *,
    padding: float = 2.0,
    device: str = "",
    fft: str = "",
) -> Any:
    """raywave.propagate for a tensor (..., ny, nx) of complex64 or complex128 in host memory, with
    gradients with respect to u. Arguments, units and errors are the same; the pitch stays u's.
    """
    if not isinstance(u, torch.Tensor):
        raise _core.InputError(f"u: must be a torch.Tensor, got {type(u).__name__}")
    if u.device.type != "cpu":
        raise _core.InputError("u: must be in host memory: OpenCL shares none with other devices")
    if u.dtype not in (torch.complex64, torch.complex128):
        raise _core.InputError(f"u: must be complex64 or complex128, got {u.dtype}")
    if u.dim() < 2 or u.numel() == 0:
        raise _core.InputError(f"u: must have the shape (..., ny, nx), got {tuple(u.shape)}")
    x, y = (float(v) for v in shift)
    options = {"padding": padding, "device": device, "fft": fft}
    return _Propagate.apply(u, (pitch, wavelength, float(distance), (x, y), options))
