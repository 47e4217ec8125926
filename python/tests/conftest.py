# SPDX-License-Identifier: Apache-2.0
"""Scenes that the tests share. They are small, and of few kinds: each new kind of kernel takes
seconds to compile.
"""

import os
import pathlib

import numpy as np
import pytest

import raywave as rw

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "data"

LASERS = ["638 nm", "520 nm", "450 nm"]

SQUARE = (
    np.array([[-0.5, -0.5, 0], [-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
)


def square_values(**hologram):
    return {
        "hologram": {"resolution": [48, 32], "pitch": "4 um", **hologram},
        "sampling": {"pitch": "20 um"},
        "light": [{"direction": [0, 0, 1]}],
        "object": [{"mesh": SQUARE, "width": "0.2 mm", "position": [0, 0, "10 mm"]}],
    }


def square_file(folder):
    """SQUARE as square.obj."""
    (folder / "square.obj").write_text(
        "v -0.5 -0.5 0\nv -0.5 0.5 0\nv 0.5 0.5 0\nv 0.5 -0.5 0\nf 1 2 3\nf 1 3 4\n"
    )


@pytest.fixture
def scene():
    """A lit square 10 mm from a hologram of 48 x 32 pixels."""
    return rw.Scene(square_values())


@pytest.fixture(scope="session")
def program():
    """The command line, where it was built."""
    program = os.environ.get("RAYWAVE_PROGRAM", "")
    if not program:
        pytest.skip("RAYWAVE_PROGRAM does not name the command line")
    return program


@pytest.fixture(params=[d.index for d in rw.devices()])
def device(request):
    return request.param


def random_field(shape, dtype=np.complex64, seed=1):
    random = np.random.default_rng(seed)
    return (random.normal(size=shape) + 1j * random.normal(size=shape)).astype(dtype)
