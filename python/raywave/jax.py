# SPDX-License-Identifier: Apache-2.0
"""Propagation for JAX, differentiable: raywave.jax.propagate.

It runs on the host, through jax.pure_callback, and may be jitted and mapped. The gradient is the
adjoint, which is the propagation by the opposite distance and shift.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

import jax
import jax.numpy as jnp

from . import _core
from ._light import Pair, _unmasked
from ._light import propagate as _propagate

__all__ = ["propagate"]


def _on_host(u: Any, how: Any) -> Any:
    pitch, wavelength, distance, shift, options = how
    planes = np.ascontiguousarray(u).reshape(-1, *u.shape[-2:])
    result = np.empty(planes.shape, planes.dtype)
    for i, plane in enumerate(planes):
        result[i] = _propagate(plane, pitch, wavelength, distance, shift, **dict(options))
    return result.reshape(u.shape)


@partial(jax.custom_vjp, nondiff_argnums=(1,))
def _propagated(u: Any, how: Any) -> Any:
    shape = jax.ShapeDtypeStruct(u.shape, u.dtype)
    return jax.pure_callback(partial(_on_host, how=how), shape, u, vmap_method="expand_dims")


def _forward(u: Any, how: Any) -> Any:
    return _propagated(u, how), None


def _backward(how: Any, _: Any, cotangent: Any) -> Any:
    # JAX asks for the transpose, which is the adjoint between two conjugations.
    pitch, wavelength, distance, (x, y), options = how
    back = (pitch, wavelength, -distance, (-x, -y), options)
    return (jnp.conj(_propagated(jnp.conj(cotangent), back)),)


_propagated.defvjp(_forward, _backward)


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
    """raywave.propagate for a JAX array (..., ny, nx) of complex64, or complex128 where JAX has
    64-bit types enabled, with gradients with respect to u. Arguments, units and errors are the
    same; the pitch stays u's.
    """
    u = jnp.asarray(_unmasked(u, "u"))
    if u.dtype not in (jnp.complex64, jnp.complex128):
        raise _core.InputError(f"u: must be complex64 or complex128, got {u.dtype}")
    if u.ndim < 2 or u.size == 0:
        raise _core.InputError(f"u: must have the shape (..., ny, nx), got {u.shape}")
    x, y = (float(v) for v in shift)
    two = tuple(float(p) for p in np.broadcast_to(pitch, 2))
    options = (("padding", float(padding)), ("device", device), ("fft", fft))
    return _propagated(u, (two, float(wavelength), float(distance), (x, y), options))
