# SPDX-License-Identifier: Apache-2.0
"""raywave beside other tools of the field, each where it is installed."""

import numpy as np
import pytest
from conftest import DATA, random_field

import raywave as rw

PITCH, WAVELENGTH, DISTANCE = 8e-6, 638e-9, 20e-3


def blurred(picture, width):
    """By a Gaussian, width pixels of standard deviation, through the Fourier plane."""
    v, u = (np.fft.fftfreq(n)[:, None] if i == 0 else np.fft.fftfreq(n)
            for i, n in enumerate(picture.shape))
    return np.fft.ifft2(np.fft.fft2(picture)
                        * np.exp(-2 * (np.pi * width) ** 2 * (u**2 + v**2))).real


def correlation(a, b):
    a, b = a - a.mean(), b - b.mean()
    return (a * b).sum() / np.sqrt((a**2).sum() * (b**2).sum())


def test_slmsuites_simulated_camera_sees_the_teapot():
    pytest.importorskip("slmsuite")
    from slmsuite.hardware.cameras.simulated import SimulatedCamera
    from slmsuite.hardware.slms.simulated import SimulatedSLM

    n, z = 256, 0.1
    scene = rw.load_scene(DATA / "teapot.toml", {
        "hologram.resolution": [n, n], "hologram.pitch": PITCH, "object.0.width": "5 mm",
        "object.0.position": [0.4e-3, 0.3e-3, z], "sampling.pitch": "60 um",
        "slm.encoding": "phase",
        "slm.invert": True,  # slmsuite's levels: phase falls as grey rises
        "slm.lens": z,  # brings the picture into the Fourier plane, where the camera stands
    })
    holo = rw.render(scene)
    slm = SimulatedSLM((n, n), pitch_um=(1e6 * PITCH,) * 2, wav_um=1e6 * WAVELENGTH)
    camera = SimulatedCamera(slm, bitdepth=16)
    slm.set_phase(holo.levels)  # integers are shown as they are
    seen = np.asarray(camera.get_image(), float)

    # A pixel of the camera is wavelength z / (n pitch) of the picture; light that travels to one
    # side comes from a picture on the other, so that the camera has it turned by half a turn.
    side = WAVELENGTH * z / PITCH
    lens = rw.lens(scene, z, window=side, points=4)
    row, column = ((np.arange(n) - n // 2)[:, None] / n * lens.shape[0] + lens.shape[0] / 2,
                   (np.arange(n) - n // 2) / n * lens.shape[1] + lens.shape[1] / 2)
    expected = blurred(lens.astype(float), 6)[
        np.clip(row, 0, lens.shape[0] - 1).astype(int),
        np.clip(column, 0, lens.shape[1] - 1).astype(int)]
    expected = np.roll(expected[::-1, ::-1], (1, 1), (0, 1))  # n // 2 stays where it is
    seen[n // 2, n // 2] = np.median(seen)  # the zero order
    alike = {name: correlation(blurred(seen, 2), picture) for name, picture in
             {"as it is": expected, "turned": expected[::-1, ::-1],
              "mirrored": expected[:, ::-1], "upside down": expected[::-1]}.items()}
    assert alike["as it is"] > 0.9, alike
    assert max(alike, key=alike.get) == "as it is", alike


def smooth_beam(ny, nx):
    y, x = ((np.arange(n) - (n - 1) / 2) * PITCH for n in (ny, nx))
    return (np.exp(-((x[None] / 2e-4) ** 2 + (y[:, None] / 1.5e-4) ** 2))
            * np.exp(2j * np.pi / WAVELENGTH * 2e-3 * x[None])).astype(np.complex64)


def agrees(theirs, ours):
    """Same sign of phase, same phase, same orientation."""
    inside = np.s_[24:-24, 24:-24]
    difference = np.abs(theirs[inside] - ours[inside])
    return np.linalg.norm(difference) < 2e-3 * np.linalg.norm(ours[inside])


def test_torchoptics_propagates_our_fields_to_our_result():
    torch = pytest.importorskip("torch")
    torchoptics = pytest.importorskip("torchoptics")
    u = smooth_beam(128, 160)
    ours = rw.propagate(u.astype(complex), PITCH, WAVELENGTH, DISTANCE)
    field = torchoptics.Field(torch.from_dlpack(u.astype(complex)), WAVELENGTH, spacing=PITCH)
    theirs = field.propagate_to_z(DISTANCE).data.numpy()
    assert agrees(theirs, ours)


def test_odak_propagates_our_fields_to_our_result(tmp_path, monkeypatch):
    torch = pytest.importorskip("torch")
    monkeypatch.chdir(tmp_path)  # odak writes a log
    wave = pytest.importorskip("odak.learn.wave")
    u = smooth_beam(128, 128)
    ours = rw.propagate(u.astype(complex), PITCH, WAVELENGTH, DISTANCE)
    theirs = wave.propagate_beam(
        torch.from_dlpack(u), wave.wavenumber(WAVELENGTH), DISTANCE, PITCH, WAVELENGTH,
        propagation_type="Bandlimited Angular Spectrum", zero_padding=[True, False, True]).numpy()
    # Its frequencies lie half a step beside those of the transform: with twice the samples, half
    # the difference is left.
    product = np.vdot(theirs, ours)
    norm = np.linalg.norm(theirs) * np.linalg.norm(ours)
    assert abs(product) > 0.999 * norm and abs(np.angle(product)) < 0.1
    assert abs(np.vdot(theirs.conj(), ours)) < 0.9 * norm, "the other sign of phase"


def test_waveprop_propagates_our_fields_to_our_result():
    waveprop = pytest.importorskip("waveprop.rs")
    u = smooth_beam(128, 160)
    ours = rw.propagate(u.astype(complex), PITCH, WAVELENGTH, DISTANCE)
    theirs = waveprop.angular_spectrum_np(u.astype(complex), WAVELENGTH, PITCH, DISTANCE)[0]
    assert agrees(theirs, ours)


def test_our_results_pass_into_others_without_a_copy(scene):
    holo = rw.render(scene)
    for array in (holo.levels, holo.field, random_field((4, 4))):
        assert np.shares_memory(np.from_dlpack(array), array)
    torch = pytest.importorskip("torch")
    tensor = torch.from_dlpack(np.asarray(holo.levels))
    assert tensor.data_ptr() == holo.levels.ctypes.data
