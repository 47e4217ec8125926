# SPDX-License-Identifier: Apache-2.0
"""A display in Xvfb, whose screen is read from the server."""

import os
import shutil
import struct
import subprocess

import numpy as np
import pytest

import raywave as rw

SHAPE = (96, 160)


@pytest.fixture
def screen(tmp_path, monkeypatch):
    """Reads the pixels of an X server's screen."""
    if not shutil.which("Xvfb"):
        pytest.skip("no Xvfb")
    get, put = os.pipe()
    size = f"{SHAPE[1]}x{SHAPE[0]}x24"
    # Without -noreset, it begins anew when the last window closes, and refuses the next one
    words = ["-displayfd", str(put), "-nolisten", "tcp", "-noreset"]
    words += ["-screen", "0", size, "-fbdir", tmp_path]
    server = subprocess.Popen(["Xvfb", *words], pass_fds=[put], stderr=subprocess.DEVNULL)
    os.close(put)
    with os.fdopen(get) as numbers:
        monkeypatch.setenv("DISPLAY", ":" + numbers.readline().strip())

    def read():
        xwd = (tmp_path / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", xwd[:100])
        pixels = np.frombuffer(xwd, np.uint8, offset=header[0] + 12 * header[19])
        return pixels.reshape(SHAPE[0], -1, 4)[:, : SHAPE[1], 2::-1]

    yield read
    server.terminate()
    server.wait()


def display(**options):
    try:
        return rw.Display(SHAPE, backend="window", **options)
    except rw.InputError as error:
        if "libsdl2" in str(error):
            pytest.skip(str(error))
        raise


def test_levels_are_on_the_screen_and_flips_are_counted(screen):
    random = np.random.default_rng(3)
    last = -1
    with display(read_back=True) as slm:
        for channels in ((), (3,), ()):
            levels = random.integers(0, 256, SHAPE + channels, dtype=np.uint8)
            flip = slm.show(levels)
            assert flip.refresh > last
            assert flip.latency >= 0
            last = flip.refresh
            wanted = levels if channels else np.repeat(levels[..., None], 3, axis=2)
            for _ in range(100):
                if np.array_equal(screen(), wanted):
                    break
                subprocess.run(["sleep", "0.02"], check=True)
            assert np.array_equal(screen(), wanted)
        with pytest.raises(rw.InputError, match="must have the shape"):
            slm.show(levels.T)
        with pytest.raises(rw.InputError, match="levels"):
            slm.show(levels.astype(np.float32))
    assert slm.report()["proof"] == {"read_back": 3, "swaps_returned": 3}
    with pytest.raises(rw.InputError, match="was closed"):
        slm.show(levels)


def test_what_does_not_fit_is_refused(screen):
    display().close()
    with pytest.raises(rw.InputError, match="160 x 96 pixels and the frames are 100 x 100"):
        rw.Display((100, 100), backend="window")
    with pytest.raises(rw.InputError, match="there are window and kms"):
        rw.Display(SHAPE, backend="screen")
    with pytest.raises(rw.InputError, match="shape"):
        rw.Display(7)
