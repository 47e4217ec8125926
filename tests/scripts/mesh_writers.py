# SPDX-License-Identifier: Apache-2.0
"""Writers of random valid mesh files with shapes and colours that are known; for
written_meshes.py. They share nothing with raywave's readers."""
import math
import random
import struct
import zlib

AMBIENT, LIGHT = 0.5, 0.5  # of the lights: one from everywhere, one along z
PLAIN = (0.1 * AMBIENT + 0.8 * LIGHT,) * 3  # what the default material shows

# Shapes: on a grid of whole numbers from 0 to 100, so that every type of number can hold them


class Shape:
    """An outline with its own triangles, and the light that it shows."""

    def __init__(self, outline, triangles):
        self.outline, self.triangles, self.shown = outline, triangles, (0, 0, 0)

    def moved(self, x, y):
        move = lambda points: [(a + x, b + y) for a, b in points]
        made = Shape(move(self.outline), [move(t) for t in self.triangles])
        made.shown = self.shown
        return made

    def holds(self, x, y):
        inside = False
        for (x0, y0), (x1, y1) in zip(self.outline, self.outline[1:] + self.outline[:1]):
            if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
                inside = not inside
        return inside


def skyline(rng):
    """Columns that stand on each other's sides: a rectilinear outline, often far from convex."""
    xs = sorted(rng.sample(range(41), rng.randint(3, 6)))
    tops, bottoms = [], []
    for i in range(len(xs) - 1):
        low, high = (0, 40) if i == 0 else (bottoms[-1], tops[-1])
        while True:  # each column touches the one before it
            bottom, top = sorted(rng.sample(range(41), 2))
            if top - bottom > 5 and min(top, high) - max(bottom, low) > 3:
                break
        bottoms.append(bottom)
        tops.append(top)
    upper, lower, triangles = [], [], []
    for x0, x1, bottom, top in zip(xs, xs[1:], bottoms, tops):
        upper += [(x0, top), (x1, top)]
        lower += [(x0, bottom), (x1, bottom)]
        triangles += [[(x0, bottom), (x1, bottom), (x1, top)], [(x0, bottom), (x1, top), (x0, top)]]
    outline = []
    for point in lower + upper[::-1]:
        if point not in outline[-1:]:
            outline.append(point)
    return outline, triangles


def star(rng):
    """Corners at any distance around a middle."""
    count = rng.randint(3, 9)
    angles = [2 * math.pi * (i + rng.uniform(0.1, 0.9)) / count for i in range(count)]
    reach = [rng.uniform(8, 20) for _ in angles]
    outline = [(round(20 + r * math.cos(a)), round(20 + r * math.sin(a)))
               for a, r in zip(angles, reach)]
    if count == 3 or len(set(outline)) < count:
        return quad(rng)
    pairs = list(zip(outline, outline[1:] + outline[:1]))
    if any((a[0] - 20) * (b[1] - 20) - (a[1] - 20) * (b[0] - 20) <= 0 for a, b in pairs):
        return quad(rng)
    return outline, [[(20, 20), a, b] for a, b in pairs]


def quad(rng):
    x0, x1, x2, x3 = rng.randint(0, 10), rng.randint(20, 30), rng.randint(20, 40), rng.randint(0, 9)
    y = rng.randint(20, 40)
    outline = [(x0, 0), (x1, 0), (x2, y), (x3, y)]
    return outline, [[outline[0], outline[1], outline[2]], [outline[0], outline[2], outline[3]]]


def shapes_of(rng):
    shapes = []
    for x, y in ((0, 0), (55, 0), (0, 55), (55, 55)):
        if shapes and rng.random() < 0.3:
            continue
        outline, triangles = rng.choice([skyline, skyline, star, quad])(rng)
        if rng.random() < 0.5:  # clockwise
            outline, triangles = outline[::-1], [t[::-1] for t in triangles]
        first = rng.randrange(len(outline))
        shapes.append(Shape(outline[first:] + outline[:first], triangles).moved(x, y))
    return shapes


# Colours


def linear(c):
    return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4


def byte_colour(rng):
    return [rng.choice([0, 255, rng.randrange(256)]) for _ in range(3)]


def matt(rgb):
    """What a white matt material shows of an sRGB colour of bytes."""
    return tuple(linear(c / 255) for c in rgb)


def png(pixels):
    """A picture of rows of bytes, each three to a pixel."""
    body = zlib.compress(b"".join(b"\0" + bytes(sum(row, [])) for row in pixels))
    head = struct.pack(">IIBBBBB", len(pixels[0]), len(pixels), 8, 2, 0, 0, 0)
    chunk = lambda n, b: struct.pack(">I", len(b)) + n + b + struct.pack(">I", zlib.crc32(n + b))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) +
            chunk(b"IEND", b""))


PICTURE = [[[random.Random(f"{y}/{x}/{k}").choice([0, 60, 160, 255]) for k in range(3)]
            for x in range(4)] for y in range(4)]


# Writers: each writes a file into a folder, sets what its shapes show, and returns the file's name,
# all its shapes (which may be more than it was given), and the number of its triangles


def number(rng, value):
    """A number in one of its forms."""
    text = repr(float(value))
    forms = [text, f"{value:.9e}", f"{value:+.7f}", f"{value:.6f}e+00", f"{value:.6f}E0"]
    if 0 < value < 1:
        forms.append(f"{value:.7f}"[1:])
    return rng.choice(forms)


def listed(shapes, share):
    """Vertices and faces; equal ones may be one."""
    points, faces = [], []
    for shape in shapes:
        face = []
        for point in shape.outline:
            if share and point in points:
                face.append(points.index(point))
            else:
                points.append(point)
                face.append(len(points) - 1)
        faces.append(face)
    return points, faces


def triangles_of(shapes):
    return sum(len(s.outline) - 2 for s in shapes)


def write_obj(rng, folder, name, shapes):
    end = rng.choice(["\n", "\r\n"])
    way = rng.choice(["plain", "colours", "materials", "materials", "picture"])
    points, faces = listed(shapes, False)
    lines, mtl, behind = ["# made for a test"], [], {}
    if way == "colours":
        scale = rng.choice([1, 255])
        alpha = rng.choice(["", " 1", " 255"]) if scale == 255 else rng.choice(["", " 1.0"])
        w = rng.choice(["", "", " 1.0"]) if scale == 255 else ""
        for i, (shape, face) in enumerate(zip(shapes, faces)):
            rgb = byte_colour(rng)
            if i == 0 and scale == 255:
                rgb[0] = 255
            shape.shown = matt(rgb)
            for p in face:
                behind[p] = ("".join(f" {c / 255 * scale:.6g}" for c in rgb) + alpha if w == ""
                             else w + "".join(f" {c / 255 * scale:.6g}" for c in rgb))
    places = []
    # Some tools write Tr for opacity
    opacity = rng.choice(["d 1", "Tr 0", "d 1.0", "d -halo 1", "Tr 1"])
    for i, shape in enumerate(shapes):
        if way == "plain":
            shape.shown = PLAIN
        if way not in ("materials", "picture"):
            continue
        ka, kd = ([rng.random() for _ in range(3)] for _ in range(2))
        mtl += [rng.choice(["newmtl m %d", "  newmtl m %d "]) % i]
        said = ["Ka " + " ".join(number(rng, c) for c in ka),
                "Kd " + " ".join(number(rng, c) for c in kd), opacity,
                rng.choice(["illum 1", "Ns 10", "Ni 1.5"])]
        if way == "picture":
            u, v = rng.randrange(4), rng.randrange(4)
            rgb = PICTURE[3 - v][u]
            su, sv = rng.choice([1, 2, 0.5]), rng.choice([1, 2, 0.5])
            ou, ov = rng.choice([0, 0.25, -0.5]), rng.choice([0, 0.25])
            options = [f"-s {su} {sv} 1", f"-o {ou} {ov}", rng.choice(["-clamp off", "-blendu on"])]
            rng.shuffle(options)
            said[1] = "Kd 1 1 1"
            said.append("map_Kd " + " ".join(options) + " a picture.png")
            kd = ka = matt(rgb)
            said[0] = "Ka 1 1 1"
            places.append((((u + 0.5) / 4 - ou) / su, ((v + 0.5) / 4 - ov) / sv))
        rng.shuffle(said)
        mtl += said
        shape.shown = tuple(a * AMBIENT + d * LIGHT for a, d in zip(ka, kd))
    if mtl:
        (folder / "a picture.png").write_bytes(png(PICTURE))
        cut = next((i for i, line in enumerate(mtl) if line.strip() == "newmtl m 1"), len(mtl))
        libraries = [mtl] if rng.random() < 0.5 else [mtl[:cut], mtl[cut:]]
        names = [f"{name} {i}.mtl" if len(libraries) == 1 else f"{name}_{i}.mtl"
                 for i in range(len(libraries))]
        for one, said in zip(names, libraries):
            bom = rng.choice(["", "\ufeff"])
            (folder / one).write_text(bom + end.join(said) + end, encoding="utf-8", newline="")
        if rng.random() < 0.1:  # colours of a library that is not there are the default material's
            names = ["nowhere.mtl"]
            for shape in shapes:
                shape.shown = PLAIN
        lines.append("mtllib " + " ".join(names) + rng.choice(["", " ", "\t"]))
    for i, (x, y) in enumerate(points):
        lines.append(rng.choice(["v ", "v  ", "v\t"]) + number(rng, x / 100) + " " +
                     number(rng, y / 100) + " " + rng.choice(["0", "0.0", "-0"]) +
                     behind.get(i, rng.choice(["", "", " # a corner"])))
    lines += [f"vt {u:.9g} {v:.9g}" for u, v in places] or ["vt 0 0"]
    lines.append("vn 0 0 1")
    for i, face in enumerate(faces):
        if mtl:
            lines.append(f"usemtl m {i}")
        lines.append(rng.choice(["g a b", "o a", "s off", "s 1", ""]))
        vt, form = (i + 1 if places else 1), rng.choice(["v/vt", "v/vt/vn"])
        if not places:
            form = rng.choice(["v", "v//vn", form])
        corners = [form.replace("vt", "T").replace("vn", "N").replace("v", "V")
                   .replace("V", str(p + 1 if rng.random() < 0.5 else p - len(points)))
                   .replace("T", str(vt)).replace("N", "1") for p in face]
        at = rng.randrange(1, len(corners))
        joint = rng.choice([" ", " ", " \\" + end])
        lines.append("f " + " ".join(corners[:at]) + joint + " ".join(corners[at:]))
    bom = rng.choice(["", "\ufeff"])
    (folder / f"{name}.obj").write_text(bom + end.join(lines) + end, encoding="utf-8", newline="")
    return f"{name}.obj", shapes, triangles_of(shapes)


PLY_TYPES = {"char": "b", "uchar": "B", "int8": "b", "uint8": "B", "short": "h", "ushort": "H",
             "int16": "h", "uint16": "H", "int": "i", "uint": "I", "int32": "i", "uint32": "I",
             "float": "f", "float32": "f", "double": "d", "float64": "d"}


def write_ply(rng, folder, name, shapes):
    form = rng.choice(["ascii", "binary_little_endian", "binary_big_endian"])
    order = ">" if form == "binary_big_endian" else "<"
    way = rng.choice(["none", "vertex", "face", "picture"])
    points, faces = listed(shapes, way == "none" or way == "face")
    names = rng.choice([("red", "green", "blue"), ("r", "g", "b"),
                        ("diffuse_red", "diffuse_green", "diffuse_blue")])
    kind, scale = rng.choice([("uchar", 255), ("float", 1), ("int", 255), ("ushort", 65535),
                              ("double", 1), ("float32", 255)])
    colours = [byte_colour(rng) for _ in shapes]
    colours[0][rng.randrange(3)] = 255  # the brightest tells the range
    owner = [i for i, face in enumerate(faces) for _ in face]
    stored = [[c * scale / 255 if kind in ("float", "double", "float32") else c * scale // 255
               for c in rgb] for rgb in colours]
    for shape, rgb in zip(shapes, colours):
        shape.shown = matt(rgb) if way != "none" else PLAIN
    place = rng.choice(["float", "double", "float32", "float64"])
    vertex = [("x", place), ("y", place), ("z", place)]
    values = [[x / 100, y / 100, 0] for x, y in points]
    extra = rng.random() < 0.4
    if way == "vertex":
        vertex += [(n, kind) for n in names]
        for v, i in zip(values, owner):
            v += stored[i]
        if rng.random() < 0.3:
            vertex.append(("alpha", kind))
            for v in values:
                v.append(scale)
    if extra:
        vertex.append(("quality", "short"))
        for v in values:
            v.append(2570)  # line ends, in binary
    mixed = list(range(len(vertex)))
    rng.shuffle(mixed)
    vertex, values = [vertex[i] for i in mixed], [[v[i] for i in mixed] for v in values]
    count, index = rng.choice(["uchar", "uint8", "int", "ushort"]), rng.choice(["int", "uint32"])
    face = [(rng.choice(["vertex_indices", "vertex_index"]), (count, index))]
    rows = [[f] for f in faces]
    if way == "face":
        face += [(n, kind) for n in names]
        rows = [r + c for r, c in zip(rows, stored)]
    if way == "picture":
        face.append(("texcoord", ("uchar", "float")))
        for shape, row in zip(shapes, rows):
            u, v = rng.randrange(4), rng.randrange(4)
            row.append([(u + 0.5) / 4, (v + 0.5) / 4] * len(row[0]))
            shape.shown = matt(PICTURE[3 - v][u])
        (folder / "a picture.png").write_bytes(png(PICTURE))
    elements = [("vertex", vertex, values), ("face", face, rows)]
    if way in ("none", "vertex") and all(len(f) == 4 for f in faces):
        strips = [[f[0], f[1], f[3], f[2], -1] for f in faces]
        elements[1] = ("tristrips", [("vertex_indices", ("int", "int"))], [[sum(strips, [])]])
    for at in rng.sample(range(3), rng.randint(0, 2)):
        elements.insert(at, (f"other{at}", [("n", "uchar"), ("l", ("uchar", "double"))],
                             [[10, [1, 2]], [13, []]]))
    if rng.random() < 0.3:
        face.reverse()
        for row in rows:
            row.reverse()
    end = rng.choice(["\n", "\r\n"])
    head = ["ply", f"format {form} 1.0"]
    if way == "picture":
        head.append("comment TextureFile a picture.png")
    body = b""
    for one, properties, values in elements:
        head.append(f"element {one} {len(values)}")
        for n, (key, of) in enumerate(properties):
            head.append("property " + (f"list {of[0]} {of[1]} " if isinstance(of, tuple) else
                                       f"{of} ") + key)
            if n == 0:
                head.append(rng.choice(["comment between", "obj_info of nothing"]))
        for row in values:
            words = []
            for (key, of), value in zip(properties, row):
                if isinstance(of, tuple):
                    words += [(len(value), of[0])] + [(v, of[1]) for v in value]
                else:
                    words.append((value, of))
            if form == "ascii":
                body += (" ".join(repr(v) for v, _ in words) + end).encode()
            else:
                body += b"".join(struct.pack(order + PLY_TYPES[t], v) for v, t in words)
    head.append("end_header")
    (folder / f"{name}.ply").write_bytes((end.join(head) + end).encode() + body)
    return f"{name}.ply", shapes, triangles_of(shapes)


def write_stl(rng, folder, name, shapes):
    way = rng.choice(["text", "plain", "magics", "viscam"])
    of = [s for s in shapes for _ in s.triangles]
    triangles = [t for s in shapes for t in s.triangles]
    for s in shapes:
        s.five = [rng.randrange(32) for _ in range(3)]
        s.shown = (PLAIN if way in ("text", "plain") else
                   tuple(linear(c / 31) for c in s.five))
    if way == "text":
        key = rng.choice([str.lower, str.upper])
        lines = [key("solid") + " a name"]
        for t in triangles:
            lines += [key(" facet normal") + " 0 0 1", key("  outer loop")]
            lines += [key("   vertex ") + f"{x / 100!r} {number(rng, y / 100)} 0" for x, y in t]
            lines += [key("  endloop"), key(" endfacet")]
        lines.append(key("endsolid") + " a name")
        (folder / f"{name}.stl").write_bytes(rng.choice(["\n", "\r\n"]).join(lines).encode())
        return f"{name}.stl", shapes, len(triangles)
    head = rng.choice([b"solid of some tool", b"made by a test", b""])
    if way == "magics":
        head = b"COLOR=" + bytes(byte_colour(rng)) + b"\xff"
    body = head.ljust(80, rng.choice([b" ", b"\0"])) + struct.pack("<I", len(triangles))
    for s, t in zip(of, triangles):
        r, g, b = s.five
        bits = {"plain": 0, "magics": b << 10 | g << 5 | r,
                "viscam": 1 << 15 | r << 10 | g << 5 | b}
        body += struct.pack("<12fH", 0, 0, 1, *(v for x, y in t for v in (x / 100, y / 100, 0)),
                            bits[way])
    (folder / f"{name}.stl").write_bytes(body + rng.choice([b"", b"\n", bytes(700)]))
    return f"{name}.stl", shapes, len(triangles)


def write_off(rng, folder, name, shapes):
    way = rng.choice(["none", "vertex", "face"])
    points, faces = listed(shapes, way != "vertex")
    owner = [i for i, face in enumerate(faces) for _ in face]
    colours = [byte_colour(rng) for _ in shapes]
    colours[0][0] = 255
    is_float = rng.random() < 0.5
    words = [" ".join(f"{c / 255:.7f}" if is_float else str(c) for c in rgb) for rgb in colours]
    alpha = rng.choice(["", " 1.0" if is_float else " 255"])
    for shape, rgb in zip(shapes, colours):
        shape.shown = matt(rgb) if way != "none" else PLAIN
    counts = f"{len(points)} {len(faces)} {rng.choice([0, 7])}"
    kind = "COFF" if way == "vertex" else "OFF"
    lines = [f"{kind} {counts}"] if rng.random() < 0.3 else [kind, "# a comment", "", counts]
    for (x, y), i in zip(points, owner if way == "vertex" else points):
        lines.append(f"{number(rng, x / 100)} {y / 100!r} 0" +
                     (f"  {words[i]}{alpha or ' 1'}" if way == "vertex" else "") +
                     rng.choice(["", " # v"]))
    for i, face in enumerate(faces):
        lines.append(f"{len(face)}  " + " ".join(map(str, face)) +
                     (f"  {words[i]}{alpha}" if way == "face" else ""))
    (folder / f"{name}.off").write_bytes(
        (rng.choice(["\n", "\r\n"]).join(lines) + "\n").encode())
    return f"{name}.off", shapes, triangles_of(shapes)
