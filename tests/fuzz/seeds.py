# SPDX-License-Identifier: Apache-2.0
"""Writes small valid inputs for the fuzz targets, from data/ and by hand: FOLDER/TARGET/*. Usage: seeds.py FOLDER"""

import base64
import pathlib
import struct
import sys

data = pathlib.Path(__file__).resolve().parents[2] / "data"
folder = pathlib.Path(sys.argv[1])


def write(target, name, content):
    file = folder / target / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content)


def packed(kind, rows):
    """Numbers as bytes: kind is struct's f, d, i, I."""
    flat = [x for row in rows for x in (row if isinstance(row, (list, tuple)) else [row])]
    return struct.pack(f"<{len(flat)}{kind}", *flat)


def vector(kind, rows):
    """As a ReaderPipe sends it: count, then elements."""
    return struct.pack("<Q", len(rows)) + packed(kind, rows)


# Scenes, with a mesh that is there wherever the fuzzer runs, and overrides behind a zero byte.
for file in sorted(data.glob("*.toml")):
    text = file.read_bytes()
    for mesh in data.glob("*.p[ln][yg]"):
        text = text.replace(mesh.name.encode(), b"/proc/self/exe")
    write("scene", file.name, text)
for i, override in enumerate([b"wrp.padding=1.25", b"hologram.pitch=8 um", b"object.0.width=9 mm", b"object.width=9 mm", b"sampling.mode=fan", b'light=[{direction=[0,0,1]}]']):
    write("scene", f"override{i}", b'[[light]]\ndirection=[0,0,1]\n[[object]]\nmesh="/proc/self/exe"\n\0' + override)

# Fields.
for i, (kind, shape, samples) in enumerate([("<c8", (2, 3), packed("f", [1] * 12)), ("<c16", (2, 2, 1), packed("d", [1] * 8)), ("<f8", (4,), packed("d", [1] * 4))]):
    for version in (1, 2, 3):
        header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
        length = struct.pack("<H" if version == 1 else "<I", len(header))
        write("npy", f"{i}{version}", b"\x93NUMPY" + bytes([version, 0]) + length + header + samples)

# EDIDs; the target makes the sum right.
write("edid", "slm", bytes(8) + b"\x21\xec\x13\x60\1\0\0\0" + bytes(56) + b"\0\0\0\xfc\0PLUTO-2.1\n   \0\0\0\xff\0SN 00123\n    " + bytes(20))

# Meshes by format (first byte), and as a reader process sends them.
corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
uvs = [c[:2] for c in corners]
faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
ply = "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
numbers = lambda rows, start="": "".join(start + " ".join(f"{x:g}" for x in row) + "\n" for row in rows)
write("mesh", "square.ply", b"\0" + (data / "square.ply").read_bytes())
write("mesh", "plane.ply", b"\0" + (data / "plane.ply").read_bytes())
write("mesh", "ascii.ply", b"\0" + (ply.format("ascii") + numbers(corners) + numbers(faces, "3 ")).encode())
write("mesh", "binary.ply", b"\0" + ply.format("binary_little_endian").encode() + packed("f", corners) + b"".join(b"\3" + packed("I", f) for f in faces))
write("mesh", "a.obj", b"\1" + (numbers(corners, "v ") + numbers(corners, "vn ") + numbers(uvs, "vt ") + numbers([[i + 1 for i in f] for f in faces], "f ")).encode())
write("mesh", "a.stl", b"\2" + bytes(80) + struct.pack("<I", 4) + b"".join(bytes(12) + packed("f", [corners[i] for i in f]) + bytes(2) for f in faces))
write("mesh", "ascii.stl", b"\2solid a\n" + b"".join(f"facet normal 0 0 0\nouter loop\n{numbers([corners[i] for i in f], 'vertex ')}endloop\nendfacet\n".encode() for f in faces) + b"endsolid a\n")
write("mesh", "a.gltf", b"\3" + b'{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}],"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}')
skinned = packed("f", corners[:3]) + packed("I", [0] * 3) + packed("f", [[1, 0, 0, 0]] * 3) + packed("f", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
views = ",".join(f'{{"buffer":0,"byteOffset":{at},"byteLength":{size}}}' for at, size in ((0, 36), (36, 12), (48, 48), (96, 64)))
accessors = ",".join(f'{{"bufferView":{view},"componentType":{kind},"count":{n},"type":"{name}"}}' for view, kind, n, name in ((0, 5126, 3, "VEC3"), (1, 5121, 3, "VEC4"), (2, 5126, 3, "VEC4"), (3, 5126, 1, "MAT4")))
write("mesh", "skinned.gltf", b"\3" + ('{"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"skin":0},{}],"skins":[{"joints":[1],"inverseBindMatrices":3}],"meshes":[{"weights":[0.5],"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2},"targets":[{"POSITION":0}]}]}],"accessors":[' + accessors + '],"bufferViews":[' + views + f'],"buffers":[{{"byteLength":{len(skinned)},"uri":"data:application/octet-stream;base64,' + base64.b64encode(skinned).decode() + '"}]}').encode())
write("mesh", "vase.glb", b"\4" + (data / "vase.glb").read_bytes())
map_of = lambda picture: struct.pack("<2i6d2i", picture, 0, 1, 0, 0, 0, 1, 0, 0, 0)
text = lambda word: vector("b", list(word.encode()))
count = lambda n: struct.pack("<Q", n)
look = packed("d", [0.5] * 15 + [0.5, 0.5, 0, 1.5, 1]) + packed("i", [1, 2, 1, 0]) + map_of(0) + 4 * map_of(-1)
finish = count(1) + text("a.png") + vector("b", list(b"bytes")) + count(1) + text("gold") + look + count(1) + text("a note") + count(0)
for mode in (0, 4):
    geometry = vector("d", corners) + vector("d", [[0, 0, 1]] * 4) + vector("d", uvs) + vector("I", faces)
    write("reply", f"mesh{mode}", bytes([mode]) + geometry + vector("f", [[1, 0.5, 0.25, 1]] * 4) + vector("i", [0, -1, 0, 0]) + finish + vector("i", [2, 2, 3, 3]) + count(0))
    write("reply", f"plain{mode}", bytes([mode]) + geometry + 2 * count(0) + 5 * count(0))
pose = packed("d", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
shorts = lambda numbers: count(len(numbers)) + struct.pack(f"<{len(numbers)}H", *numbers)
skin = vector("i", [0, 0, 2]) + vector("i", [0, 1]) + count(2) + 2 * pose + vector("f", corners) + vector("f", [[0, 0, 1]] * 4) + shorts([0, 1] * 4) + vector("f", [0.5] * 8) + vector("d", [0.5]) + 2 * vector("f", corners)
write("reply", "deforming", b"\0" + geometry + 2 * count(0) + 3 * count(0) + vector("i", [0] * 4) + count(1) + skin)
write("reply", "set", b"\2" + count(1) + text("camera") + pose + packed("d", [0.1]) + count(1) + packed("i", [2, 0]) + pose + packed("d", [1, 1, 1, 5, 0, 40]) + count(0))
node = lambda number, parent: packed("i", [number, parent, 1, -1, -1, 0]) + packed("d", [1, 2, 3, 0, 0, 0, 1, 1, 1, 1]) + pose
channel = lambda path, steps, values: vector("i", [1, path, steps, 0]) + vector("d", [0, 1]) + vector("d", values)
write("reply", "motion", b"\3" + count(2) + node(0, -1) + node(1, 0) + text("arm") + text("hand") + count(1) + text("walk") + count(2) + channel(1, 1, [[0, 0, 0, 1]] * 2) + channel(0, 2, [[0, 0, 0, 0]] * 6) + count(1) + text("a note") + count(1) + vector("i", [0]) + vector("i", [0, 1]) + vector("d", [0.5]))

# Pictures.
for file in data.glob("*.png"):
    if file.stat().st_size < 5000:
        write("texture", file.name, file.read_bytes())
write("texture", "a.pfm", b"Pf\n2 2\n-1.0\n" + packed("f", [1] * 4))
write("texture", "a.pgm", b"P5\n3 2\n255\n" + bytes(range(6)))
write("texture", "a.ppm", b"P6\n1 2\n255\n" + bytes(range(6)))
write("texture", "a.bmp", b"BM" + struct.pack("<IHHI", 58, 0, 0, 54) + struct.pack("<IiiHHIIiiII", 40, 1, 1, 1, 24, 0, 4, 2835, 2835, 0, 0) + b"\1\2\3\0")
write("reply", "image", b"\1" + count(2) + 2 * (vector("i", [2, 3]) + vector("f", range(6))))
