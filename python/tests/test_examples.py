# SPDX-License-Identifier: Apache-2.0
"""Runs examples/lithography.py on levels that are known, and reads what it writes."""

import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT


def lithography(folder, levels, *options):
    mask = folder / "mask"
    mask.mkdir()
    np.save(mask / "hologram.npy", levels[None])
    slm = {"lut": [], "invert": False, "levels_per_turn": 256}
    (mask / "report.json").write_text(json.dumps(
        {"scene": {"hologram": {"pitch_m": [2e-6, 1e-6], "wavelength_m": 640e-9}, "slm": slm}}))
    call = [sys.executable, str(ROOT / "examples/lithography.py"), str(mask), "-o",
            str(folder / "tiles"), *options]
    subprocess.run(call, check=True)
    again = subprocess.run(call, text=True, capture_output=True)
    assert again.returncode == 1 and again.stderr.count("\n") == 1, again.stderr
    tiles = json.loads((folder / "tiles/tiles.json").read_text())
    whole = np.full(levels.shape, -1.0)
    tifffile = pytest.importorskip("tifffile")
    for tile in tiles["tiles"]:
        part = tifffile.imread(folder / "tiles" / tile["file"])
        assert list(part.shape[::-1]) == tile["size_px"]
        x = round(tile["left_m"] / 2e-6 + levels.shape[1] / 2)
        y = round(levels.shape[0] / 2 - tile["top_m"] / 1e-6)
        whole[y:y + part.shape[0], x:x + part.shape[1]] = part
    return tiles, whole


def test_heights_delay_light_by_the_phase_of_each_level(tmp_path):
    pytest.importorskip("tifffile")
    levels = np.random.default_rng(1).choice(np.array([0, 64, 128, 192], np.uint8), (13, 21))
    tiles, whole = lithography(tmp_path, levels, "--index", "1.5", "--tile", "8")
    turns = 1e-10 * whole * 0.5 / 640e-9
    assert np.abs(turns - levels / 256).max() < 1e-4
    assert len(tiles["tiles"]) == 6


def test_a_mask_of_two_levels_has_the_area_and_places_of_its_high_pixels(tmp_path):
    pytest.importorskip("tifffile")
    gdstk = pytest.importorskip("gdstk")
    high = np.random.default_rng(2).random((13, 21)) > 0.5
    tiles, whole = lithography(tmp_path, np.where(high, np.uint8(128), np.uint8(0)), "--mirror",
                               "--tile", "8", "--gds")
    assert np.array_equal(whole > 0, high)
    assert tiles["heights_nm"] == [0, 160] and tiles["nm_of_values"] == {"0": 0, "1": 160}
    polygons = gdstk.read_gds(tmp_path / "tiles/mask.gds").top_level()[0].polygons
    assert abs(sum(p.area() for p in polygons) - high.sum() * 2) < 1e-6
    centres = [((x - 10) * 2, 6 - y) for y, x in np.argwhere(high)]  # um, of 21 x 13 pixels
    assert all(gdstk.inside(centres, polygons))


def test_readers_of_tiffs_show_the_higher_level_white_at_the_pitch(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    image = pytest.importorskip("PIL.Image")
    high = np.random.default_rng(3).random((13, 21)) > 0.5
    lithography(tmp_path, np.where(high, np.uint8(128), np.uint8(0)), "--index", "1.5")
    tile = tmp_path / "tiles/tile_0_0.tif"
    assert not (tmp_path / "tiles/mask.gds").exists()
    assert np.array_equal(np.array(image.open(tile)) > 0, high)
    tags = tifffile.TiffFile(tile).pages[0].tags
    assert tags["PhotometricInterpretation"].value == tifffile.PHOTOMETRIC.MINISBLACK
    assert tags["ResolutionUnit"].value == tifffile.RESUNIT.CENTIMETER
    per_cm = [tags[name].value[0] / tags[name].value[1] for name in ("XResolution", "YResolution")]
    assert np.allclose(per_cm, [5000, 10000])


def test_a_hologram_in_tiles_becomes_a_relief_in_tiles(tmp_path, program):
    tifffile = pytest.importorskip("tifffile")
    image = pytest.importorskip("PIL.Image")
    (tmp_path / "square.obj").write_text("v -1 -1 0\nv -1 1 0\nv 1 1 0\nv 1 -1 0\nf 1 2 3 4\n")
    (tmp_path / "scene.toml").write_text("""
[hologram]
resolution = [130, 97]
pitch = "4 um"
tiles = [3, 2]
[slm]
encoding = "phase"
levels = 2
[[light]]
direction = [0, 0, 1]
[[object]]
mesh = "square.obj"
width = "0.2 mm"
position = [0, 0, "10 mm"]
""")
    for words in (["whole", "--no-field"], ["out", "--tiles", "all"]):
        subprocess.run([program, "render", "scene.toml", "--quiet", "-o", *words], cwd=tmp_path,
                       check=True)
    call = [sys.executable, str(ROOT / "examples/lithography.py"), str(tmp_path / "out"), "--index",
            "1.5", "-o", str(tmp_path / "relief")]
    subprocess.run(call, check=True)
    tiles = json.loads((tmp_path / "relief/tiles.json").read_text())
    assert len(tiles["tiles"]) == 6 and len(tiles["heights_nm"]) == 2
    high = np.zeros((97, 130), bool)
    for tile in tiles["tiles"]:
        part = tifffile.imread(tmp_path / "relief" / tile["file"])
        x, y = round(tile["left_m"] / 4e-6 + 65), round(48.5 - tile["top_m"] / 4e-6)
        high[y:y + part.shape[0], x:x + part.shape[1]] = part
    assert np.array_equal(high, np.array(image.open(tmp_path / "whole/hologram.png")) > 0)

    (tmp_path / "out/tile_00002.png").unlink()
    call[-1] += "_again"
    refused = subprocess.run(call, text=True, capture_output=True)
    assert refused.returncode == 1 and "tile_00002.png is missing" in refused.stderr
