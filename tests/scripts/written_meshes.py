#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes random valid mesh files whose shapes and colours are known, has raywave draw sheets of
them, and compares every pixel, and the number of triangles. Its writers (mesh_writers.py,
gltf_writer.py) share nothing with the readers.

usage: tests/scripts/written_meshes.py PROGRAM [SHEETS (1)] [SEED (1)]
       ends with 1 at the first sheet that differs, whose folder stays and is named
"""
import json
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

sys.dont_write_bytecode = True

from gltf_writer import write_gltf
from mesh_writers import (AMBIENT, LIGHT, Shape, shapes_of, write_obj, write_off, write_ply,
                          write_stl)

COLUMNS, ROWS, CELL = 6, 4, 60  # files of a sheet, and pixels of a file
PITCH_UM = 10
WRITERS = [write_gltf, write_gltf, write_gltf, write_obj, write_ply, write_stl, write_off,
           write_ply]

SCENE = f"""[hologram]
resolution = [{COLUMNS * CELL}, {ROWS * CELL}]
pitch = "{PITCH_UM} um"
wavelength = ["638 nm", "520 nm", "450 nm"]
[[light]]
type = "ambient"
intensity = {AMBIENT}
[[light]]
type = "directional"
direction = [0, 0, 1]
intensity = {LIGHT}
highlights = false
[materials.white]
ambient = 1
diffuse = 1
"""


def pixels_of(data):
    """Rows of a PNG of 8 bits and three channels."""
    width, height, depth, kind = struct.unpack_from(">IIBB", data, 16)
    assert (depth, kind) == (8, 2), (depth, kind)
    at, body = 8, b""
    while at < len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        body += data[at + 8:at + 8 + size] if name == b"IDAT" else b""
        at += 12 + size
    raw, rows, before, n = zlib.decompress(body), [], bytearray(3 * width), 3 * width + 1
    for y in range(height):
        way, row = raw[y * n], bytearray(raw[y * n + 1:(y + 1) * n])
        for i in range(3 * width):
            a, b, c = (row[i - 3], before[i], before[i - 3]) if i > 2 else (0, before[i], 0)
            paeth = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[i] = row[i] + (0, a, b, (a + b) // 2, paeth)[way] & 255
        rows.append(row)
        before = row
    return rows


def object_text(file, shapes, column, row):
    """The object of a file, and the shapes as they are to be seen, in pixels of its cell."""
    xs, ys = ([p[k] for s in shapes for p in s.outline] for k in range(2))
    scale = 0.9 * CELL / max(max(xs) - min(xs), max(ys) - min(ys))
    middle = ((max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2)
    centre = ((column + 0.5 - COLUMNS / 2) * CELL, (ROWS / 2 - row - 0.5) * CELL)
    micrometres = lambda pixels: f'"{pixels * PITCH_UM:.6f} um"'
    for s in shapes:
        s.outline = [((x - middle[0]) * scale + CELL / 2, CELL / 2 - (y - middle[1]) * scale)
                     for x, y in s.outline]
    return (f"[[object]]\nmesh = {json.dumps(file)}\n"
            f"width = {micrometres((max(xs) - min(xs)) * scale)}\n"
            f'position = [{micrometres(centre[0])}, {micrometres(centre[1])}, "100 mm"]\n')


def level(value):
    """The sRGB level of a linear value."""
    v = min(max(value, 0), 1)
    return 255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055)


def faults_of(rows, shapes, column, row):
    """What differs in the cell of a file; pixels at edges may be either."""
    edges = set()
    for s in shapes:
        for (x0, y0), (x1, y1) in zip(s.outline, s.outline[1:] + s.outline[:1]):
            steps = 2 + 2 * int(max(abs(x1 - x0), abs(y1 - y0)))
            for k in range(steps + 1):
                x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
                edges |= {(int(x + i), int(y + j)) for i in (-0.6, 0, 0.6) for j in (-0.6, 0, 0.6)}
    wanted = [[level(c) for c in s.shown] for s in shapes] + [[0, 0, 0]]
    bad, first = 0, None
    for y in range(CELL):
        for x in range(CELL):
            if (x, y) in edges:
                continue
            here = next((i for i, s in enumerate(shapes) if s.holds(x + 0.5, y + 0.5)), -1)
            at = 3 * (column * CELL + x)
            found = rows[row * CELL + y][at:at + 3]
            # The lasers miss a pure blue by 0.01
            if any(abs(f - w) > (4 if w > 40 else 28) for f, w in zip(found, wanted[here])):
                bad += 1
                first = first or f"({x}, {y}) {list(found)} for {[round(w) for w in wanted[here]]}"
    return f"{bad} pixels, first {first}" if bad else ""


def check_sheet(program, folder, seed):
    """Writes and draws a sheet; returns what is wrong with it."""
    scene, drawn, count = SCENE, [], 2
    (folder / "white.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    white = [Shape([(0, 0), (1, 0), (1, 1), (0, 1)], [])]
    scene += object_text("white.obj", white, COLUMNS - 1, ROWS - 1) + 'material = "white"\n'
    for i in range(COLUMNS * ROWS - 1):
        rng = random.Random(f"{seed}/{i}")
        writer = WRITERS[i % len(WRITERS)]
        file, shapes, triangles = writer(rng, folder, f"m{i}", shapes_of(rng))
        scene += object_text(file, shapes, i % COLUMNS, i // COLUMNS)
        drawn.append((file, shapes))
        count += triangles
    (folder / "sheet.toml").write_text(scene)
    said = {}
    for words in (["plan", "--json", "--set", 'hologram.wavelength="638 nm"'],
                  ["lens", "-z", "100mm", "-o", folder / "out", "--lens-points", "1",
                   "--frame", "hologram"]):
        done = subprocess.run([program, words[0], folder / "sheet.toml", *words[1:]], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        if done.returncode != 0:
            return [done.stderr]
        said[words[0]] = done.stdout
    if (found := json.loads(said["plan"])["triangles"]) != count:
        return [f"{found} triangles, not {count}"]
    rows = pixels_of((folder / "out/lens_100mm.png").read_bytes())
    return [f"{file}: {fault}" for i, (file, shapes) in enumerate(drawn)
            if (fault := faults_of(rows, shapes, i % COLUMNS, i // COLUMNS))]


def main():
    program = Path(sys.argv[1]).resolve()
    sheets, first = (int(word) for word in (sys.argv[2:] + ["1"] * 2)[:2])
    for seed in range(first, first + sheets):
        folder = Path(tempfile.mkdtemp(prefix=f"raywave-written-{seed}-"))
        if faults := check_sheet(program, folder, seed):
            print(f"seed {seed}, in {folder}:", *faults, sep="\n  ")
            return 1
        shutil.rmtree(folder)
    print(f"{sheets * (COLUMNS * ROWS - 1)} files are drawn as written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
