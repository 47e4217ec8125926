# SPDX-License-Identifier: Apache-2.0
"""Gradients, where torch or JAX is installed; both are large, and CI does without."""

import numpy as np
import pytest
from conftest import random_field

import raywave as rw

HOW = (4e-6, 633e-9, 2e-3, (2e-5, -1e-5))


def test_torch_gradients_are_those_of_finite_differences():
    torch = pytest.importorskip("torch")
    u = torch.from_numpy(random_field((2, 5, 7), np.complex128)).requires_grad_()

    def through(x):
        return rw.torch.propagate(x, *HOW, padding=2)

    assert torch.autograd.gradcheck(through, (u,))
    assert torch.autograd.gradgradcheck(through, (u,))


def test_torch_tensors_propagate_as_arrays_do():
    torch = pytest.importorskip("torch")
    u = random_field((12, 20))
    expected = rw.propagate(u, *HOW)
    tensor = torch.from_numpy(u)
    assert np.array_equal(rw.propagate(tensor, *HOW), expected), "DLPack in"
    assert np.array_equal(torch.from_dlpack(expected).numpy(), expected), "DLPack out"
    assert np.array_equal(rw.torch.propagate(tensor, *HOW).numpy(), expected)
    flipped = torch.from_numpy(u.T.copy()).T.conj()  # neither contiguous nor resolved
    assert np.array_equal(rw.torch.propagate(flipped, *HOW).numpy(),
                          rw.propagate(np.ascontiguousarray(u.conj()), *HOW))
    for refused, cure in ((tensor.clone().requires_grad_(), "detach"),
                          (tensor.conj(), "resolve_conj")):
        with pytest.raises(rw.InputError, match=f"^u: .*{cure}"):
            rw.propagate(refused, *HOW)
    for bad in (tensor.real, u, tensor[0], tensor[:0], tensor.to("meta")):
        with pytest.raises(rw.InputError, match="^u: "):
            rw.torch.propagate(bad, *HOW)


def test_gradient_descent_through_torch_finds_a_hologram():
    torch = pytest.importorskip("torch")
    spot = torch.zeros(32, 32)
    spot[8, 20] = 1.0
    phase = torch.zeros(32, 32, requires_grad=True)
    optimizer = torch.optim.Adam([phase], lr=0.3)

    def share():
        u = rw.torch.propagate(torch.exp(1j * phase), 4e-6, 633e-9, 1e-3)
        return (u.abs() ** 2 * spot).sum() / (u.abs() ** 2).sum()

    first = share().item()
    for _ in range(30):
        optimizer.zero_grad()
        loss = -torch.log(share() + 1e-9)
        loss.backward()
        optimizer.step()
    assert share().item() > 20 * first


def test_jax_gradients_are_those_of_finite_differences():
    jax = pytest.importorskip("jax")
    from jax.test_util import check_grads

    doubles = jax.enable_x64(True) if hasattr(jax, "enable_x64") else jax.experimental.enable_x64()
    with doubles:
        u = jax.numpy.asarray(random_field((5, 7), np.complex128))
        check_grads(lambda x: rw.jax.propagate(x, *HOW), (u,), order=2, modes=["rev"])
        weight = jax.numpy.asarray(random_field((5, 7), np.complex128, seed=4))

        def loss(x):
            return jax.numpy.abs((rw.jax.propagate(x, *HOW) * weight).sum()) ** 2

        gradient, step = jax.grad(loss)(u), 1e-6
        for i, j in [(0, 0), (3, 4)]:
            slope = [(loss(u.at[i, j].add(s)) - loss(u.at[i, j].add(-s))) / (2 * step)
                     for s in (step, 1j * step)]
            expected = slope[0] - 1j * slope[1]  # JAX's convention
            assert abs(gradient[i, j] - expected) < 1e-6 * abs(expected)


def test_jax_arrays_propagate_as_arrays_do_jitted_and_mapped():
    jax = pytest.importorskip("jax")
    u = random_field((3, 12, 20))
    expected = np.stack([rw.propagate(plane, *HOW) for plane in u])
    array = jax.numpy.asarray(u)
    assert np.array_equal(rw.propagate(array[0], *HOW), expected[0]), "DLPack in"
    assert np.array_equal(rw.jax.propagate(array, *HOW), expected)
    assert np.array_equal(jax.jit(lambda x: rw.jax.propagate(x, *HOW))(array), expected)
    assert np.array_equal(jax.vmap(lambda x: rw.jax.propagate(x, *HOW))(array), expected)
    for bad in (array.real, array[0, 0], array[:0]):
        with pytest.raises(rw.InputError, match="^u: "):
            rw.jax.propagate(bad, *HOW)
