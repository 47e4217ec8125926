# SPDX-License-Identifier: Apache-2.0
"""Writes random valid glTF files with shapes and colours that are known; as mesh_writers.py."""
import base64
import json
import math
import struct

from mesh_writers import AMBIENT, LIGHT, PICTURE, matt, png


class Gltf:
    """A glTF file that grows: one buffer, its views and accessors."""

    def __init__(self, rng):
        self.rng, self.bytes = rng, bytearray()
        self.root = {"asset": {"version": "2.0"}, "buffers": [], "bufferViews": [],
                     "accessors": [], "meshes": [], "nodes": []}

    def add(self, array, value):
        self.root.setdefault(array, []).append(value)
        return len(self.root[array]) - 1

    def use(self, extension, required=False):
        for key in ["extensionsUsed"] + ["extensionsRequired"] * required:
            if extension not in self.root.setdefault(key, []):
                self.root[key].append(extension)

    def view(self, data, stride=0):
        self.bytes += bytes(-len(self.bytes) % 4 + self.rng.choice([0, 4, 12]))
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.bytes += data
        return self.add("bufferViews", view)

    def accessor(self, rows, kind, code, normalized=False, is_index=False):
        """rows  lists of numbers of the type `code` of struct"""
        rng, pack = self.rng, lambda row: struct.pack(f"<{len(row)}{code}", *row)
        each = struct.calcsize(code) * len(rows[0])
        accessor = {"componentType": {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125,
                                      "f": 5126}[code], "count": len(rows), "type": kind}
        if normalized:
            accessor["normalized"] = True
        plain, changed = list(rows), []
        if rng.random() < 0.2:
            changed = sorted(rng.sample(range(len(rows)), rng.randint(1, len(rows))))
            for i in changed:
                plain[i] = [0] * len(rows[0])
            places, type_ = rng.choice([("B", 5121), ("H", 5123), ("I", 5125)])
            if len(rows) > 255:
                places, type_ = "I", 5125
            accessor["sparse"] = {
                "count": len(changed),
                "indices": {"bufferView": self.view(struct.pack(f"<{len(changed)}{places}",
                                                                *changed)), "componentType": type_},
                "values": {"bufferView": self.view(b"".join(pack(rows[i]) for i in changed))}}
        if len(changed) == len(rows) and rng.random() < 0.5:
            return self.add("accessors", accessor)
        stride = each + -each % 4 + rng.choice([0, 4, 8]) if not is_index else each
        first = 0 if is_index else rng.choice([0, 4])
        data = bytes([170]) * first + b"".join(pack(row).ljust(stride, b"\xaa") for row in plain)
        is_tight = stride == each and rng.random() < 0.5
        accessor["bufferView"] = self.view(data, 0 if is_tight or is_index else stride)
        if first or rng.random() < 0.3:
            accessor["byteOffset"] = first
        return self.add("accessors", accessor)

    def save(self, folder, name):
        rng = self.rng
        way = rng.choice(["glb", "glb as gltf", "file", "data"])
        buffer = {"byteLength": len(self.bytes)}
        if way == "file":
            file, uri = rng.choice([(f"{name} data.bin", f"{name}%20data.bin"),
                                    (f"{name} d.bin", f"{name} d.bin"),
                                    (f"{name}%41.bin", f"{name}%2541.bin"),
                                    (f"{name}\u00e4.bin", f"{name}%C3%A4.bin"),
                                    (f"{name}#1.bin", f"./{name}%231.bin")])
            (folder / file).write_bytes(self.bytes)
            buffer["uri"] = uri
        elif way == "data":
            kind = rng.choice(["application/octet-stream", "application/gltf-buffer"])
            buffer["uri"] = f"data:{kind};base64," + base64.b64encode(self.bytes).decode()
        self.root["buffers"] = [buffer]
        root = {key: value for key, value in self.root.items() if value != []}
        text = json.dumps(root, indent=rng.choice([None, 1])).encode()
        text = text.replace(b"UMLAUT", rng.choice([b"\xe4", b"\xc3\xa4", b"\xff\xfe"]))
        if way in ("file", "data"):
            (folder / f"{name}.gltf").write_bytes(rng.choice([b"", b"\xef\xbb\xbf"]) + text)
            return f"{name}.gltf"
        text += b" " * (-len(text) % 4)
        binary = bytes(self.bytes) + bytes(-len(self.bytes) % 4)
        chunks = (struct.pack("<II", len(text), 0x4E4F534A) + text +
                  struct.pack("<II", len(binary), 0x004E4942) + binary)
        file = name + (".glb" if way == "glb" else ".gltf")
        (folder / file).write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
        return file


def gltf_uvs(rng, gltf, material, shape, count):
    """Gives the material a picture, and returns attributes that show one of its pixels."""
    u, v = rng.randrange(4), rng.randrange(4)
    at = ((u + 0.5) / 4, (v + 0.5) / 4)
    texture = {"index": 0}
    if not gltf.root.get("textures"):
        image = {"bufferView": gltf.view(png(PICTURE)), "mimeType": "image/png"}
        if rng.random() < 0.5:
            image = {"uri": rng.choice(["a%20picture.png", "a picture.png"])}
        gltf.add("textures", {"source": gltf.add("images", image)})
    uvs = rng.choice([0, 0, 1])
    transform = {}
    if rng.random() < 0.5:
        gltf.use("KHR_texture_transform")
        scale, offset = rng.choice([[1, 1], [2, 0.5]]), [rng.choice([0, 0.25]), 0.125]
        transform = {"scale": scale, "offset": offset}
        at = tuple((a - o) / s for a, s, o in zip(at, scale, offset))
        at = tuple(a + 1 / s if a < 0 else a for a, s in zip(at, scale))  # pictures repeat
    code = rng.choice("fBH") if max(at) <= 1 else "f"
    scale = {"f": 1, "B": 255, "H": 65535}[code]
    row = [a * scale if code == "f" else round(a * scale) for a in at]
    attributes = {f"TEXCOORD_{uvs}": gltf.accessor([row] * count, "VEC2", code, code != "f")}
    if uvs == 1:
        attributes["TEXCOORD_0"] = gltf.accessor([[0.6, 0.1]] * count, "VEC2", "f")
    if transform:
        if rng.random() < 0.5:
            transform["texCoord"] = uvs
            texture["texCoord"] = 1 - uvs
        texture["extensions"] = {"KHR_texture_transform": transform}
    if uvs and "texCoord" not in transform:
        texture["texCoord"] = uvs
    elif rng.random() < 0.3:
        texture.setdefault("texCoord", 0)
    material["pbrMetallicRoughness"]["baseColorTexture"] = texture
    return attributes, matt(PICTURE[v][u])


def gltf_points(rng, gltf, points):
    """An accessor of positions, and the scale of the node that shows them from 0 to 1."""
    code, normalized = rng.choice([("f", False)] * 3 + [(c, n) for c in "bBhH"
                                                        for n in (False, True)])
    if code == "f":
        return gltf.accessor([[x / 100, y / 100, 0] for x, y in points], "VEC3", "f"), 1
    gltf.use("KHR_mesh_quantization", True)
    most = {"b": 127, "B": 255, "h": 32767, "H": 65535}[code]
    return (gltf.accessor([[x, y, 0] for x, y in points], "VEC3", code, normalized),
            (most if normalized else 1) / 100)


def write_gltf(rng, folder, name, shapes):
    gltf, all_shapes, count = Gltf(rng), [], 0
    (folder / "a picture.png").write_bytes(png(PICTURE))
    top, shared = [], rng.random() < 0.3
    points = [p for s in shapes for t in s.triangles for p in t]
    if shared:
        list_, list_scale = gltf_points(rng, gltf, points)
    begin, primitives = 0, []
    for shape in shapes:
        corners = every = [p for t in shape.triangles for p in t]
        base = [rng.random() * 0.9 for _ in range(3)]
        material = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.2,
                                             "baseColorFactor": base + [1]}}
        if rng.random() < 0.6:
            material["name"] = rng.choice(["same", "same", "UMLAUT"])
        is_unlit = rng.random() < 0.3
        if is_unlit:
            gltf.use("KHR_materials_unlit")
            material["extensions"] = {"KHR_materials_unlit": {}}
        primitive, order = {}, list(range(len(corners)))
        if shared:
            attributes, scale = {"POSITION": list_}, list_scale
            order = [begin + i for i in order]
            total = len(points)
        else:
            unique = sorted(set(corners))
            if rng.random() < 0.5:
                order = [unique.index(p) for p in corners]
                corners = unique
            at, scale = gltf_points(rng, gltf, corners)
            attributes, total = {"POSITION": at}, len(corners)
        if len(shape.outline) == 4 and len(shape.triangles) == 2 and rng.random() < 0.5:
            a, b, c, d = [order[every.index(p)] for p in shape.outline]
            way = rng.choice([5, 6])
            primitive["mode"], order = way, [a, b, d, c] if way == 5 else [a, b, c, d]
        begin += len(shape.triangles) * 3
        if order != list(range(total)) or rng.random() < 0.5:
            code = rng.choice(["B", "H", "I"] if max(order) < 255 else ["H", "I"])
            primitive["indices"] = gltf.accessor([[i] for i in order], "SCALAR", code,
                                                 is_index=True)
        shown = base
        if rng.random() < 0.4:
            code = rng.choice("fBH")
            most = {"f": 1, "B": 255, "H": 65535}[code]
            row = [rng.choice([0, 1, rng.random()]) for _ in range(3)] + [1] * rng.randrange(2)
            row = [c if code == "f" else round(c * most) for c in row]
            attributes["COLOR_0"] = gltf.accessor([row] * total, f"VEC{len(row)}", code,
                                                  code != "f")
            shown = [b * c / most for b, c in zip(shown, row)]
        if rng.random() < 0.4:
            more, rgb = gltf_uvs(rng, gltf, material, shape, total)
            attributes.update(more)
            shown = [b * c for b, c in zip(shown, rgb)]
        facing = 1
        if rng.random() < 0.4:
            facing = rng.choice([1, 0.6])
            code = rng.choice("fbh")
            most = {"f": 1, "b": 127, "h": 32767}[code]
            if code != "f":
                gltf.use("KHR_mesh_quantization", True)
            row = [c if code == "f" else round(c * most)
                   for c in (math.sqrt(1 - facing**2), 0, facing)]
            attributes["NORMAL"] = gltf.accessor([row] * total, "VEC3", code, code != "f")
        primitive["attributes"] = attributes
        primitive["material"] = gltf.add("materials", material)
        shape.shown = tuple(c if is_unlit else c * AMBIENT + c * LIGHT * facing
                            for c in shown)
        primitives.append((shape, primitive, scale, attributes, total))
    whole = shared and rng.random() < 0.5
    for group in [primitives] if whole else [[p] for p in primitives]:
        scale = group[0][2]
        mesh = gltf.add("meshes", {"primitives": [p[1] for p in group]})
        node, move = {"mesh": mesh}, (0, 0)
        drawn = [p[0] for p in group]
        way = rng.choice(["plain", "instances", "skin", "chain", "matrix", "hidden"])
        if way == "skin":
            spread, total = rng.choice([1, 2]), group[0][4]
            code, most = rng.choice([("f", 1), ("B", 255), ("H", 65535)])
            row = [most if spread == 1 else most * 0.4, 0 if spread == 1 else most * 0.6, 0, 0]
            for p in group:
                p[3]["JOINTS_0"] = gltf.accessor([[0, 1, 0, 0]] * total, "VEC4", rng.choice("BH"))
                p[3]["WEIGHTS_0"] = gltf.accessor([row if code == "f" else [round(c) for c in row]]
                                                  * total, "VEC4", code, code != "f")
            joint = {"scale": [scale, scale, scale]}
            node["skin"] = gltf.add("skins", {"joints": [gltf.add("nodes", joint),
                                                         gltf.add("nodes", dict(joint))]})
            top += gltf.root["skins"][-1]["joints"]
            node["translation"] = [5, 5, 5]  # counts for nothing
        else:
            node["scale"] = [scale, scale, scale]
        if way == "instances":
            gltf.use("EXT_mesh_gpu_instancing", rng.random() < 0.5)
            step = rng.choice([150, 200])
            rows = [[0, 0, 0], [step / 100 / scale, 0, 0]]
            node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {
                "TRANSLATION": gltf.accessor(rows, "VEC3", "f")}}}
            drawn += [s.moved(step, 0) for s in drawn]
        if way == "matrix":
            node.pop("scale")
            node["matrix"] = [scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, 1]
        if way == "hidden":
            gltf.use("KHR_node_visibility")
            hidden = {"mesh": mesh, "scale": [scale * 2] * 3}
            above = {"children": [gltf.add("nodes", hidden)],
                     "extensions": {"KHR_node_visibility": {"visible": False}}}
            top.append(gltf.add("nodes", above))
        at = gltf.add("nodes", node)
        if way == "chain":
            at = gltf.add("nodes", {"children": [at], "rotation": [0, 0, 1, 0], "name": "UMLAUT"})
            at = gltf.add("nodes", {"children": [at], "scale": [-1, -1, 1]})
        top.append(at)
        all_shapes += drawn
        count += sum(len(s.triangles) for s in drawn)
    if rng.random() < 0.5:
        gltf.root.update(scenes=[{"nodes": top}])
        if rng.random() < 0.5:
            gltf.root["scene"] = 0
    if rng.random() < 0.2:
        gltf.use("EXT_of_nobody")
    return gltf.save(folder, name), all_shapes, count
