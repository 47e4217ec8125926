# SPDX-License-Identifier: Apache-2.0
"""Scenes, from files and from Python."""

from __future__ import annotations

import html
import io
import json
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Union

from . import _core

# A scene file's value: text as --set takes it ("8 um", "auto", "[640, 480]"), or Python's own.
Value = Any
Path = Union[str, "os.PathLike[str]"]
Vector = Sequence[float]

_IN_MEMORY = "(mesh in memory)"  # a scene's `mesh` that no file holds


def _toml(value: Value) -> str:
    """A Python value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_toml(str(k))} = {_toml(v)}" for k, v in value.items()) + "}"
    if hasattr(value, "tolist"):  # NumPy
        return _toml(value.tolist())
    if isinstance(value, (list, tuple)):
        return "[" + ",\n".join(_toml(item) for item in value) + "]"
    if isinstance(value, (int, float)):
        return repr(value)
    raise _core.InputError(f"a scene has no values of the type {type(value).__name__}")


def _overrides(values: Mapping[str, Value] | None) -> list[str]:
    """`--set` lines of {"section.key": value}. Text is taken as the command line takes it."""
    if values is None:
        return []
    if not isinstance(values, Mapping):
        raise _core.InputError('overrides: must be a mapping such as {"hologram.pitch": "8 um"}')
    return [f"{key}={v if isinstance(v, str) else _toml(v)}" for key, v in values.items()]


def _document(values: Mapping[str, Value], heading: str = "") -> str:
    """Nested mappings as a TOML document with headings, so that messages name useful lines."""
    lines, tables = [], []
    for key, value in values.items():
        name = f"{heading}.{_toml(key)}" if heading else _toml(key)
        if isinstance(value, Mapping):
            tables.append(f"[{name}]\n" + _document(value, name))
        elif isinstance(value, (list, tuple)) and value and isinstance(value[0], Mapping):
            tables += [f"[[{name}]]\n" + _document(item, name) for item in value]
        else:
            lines.append(f"{_toml(key)} = {_toml(value)}\n")
    return "".join(lines) + "".join(tables)


def _warn(notes: list[str], level: int = 3) -> None:
    """Shows them to the caller's caller; Python shows each once for each line that calls."""
    for note in notes:
        warnings.warn(note, stacklevel=level)


def _is_path(value: Any) -> bool:
    return isinstance(value, (str, os.PathLike))


def _one_wavelength(wavelengths: tuple[float, ...]) -> float:
    if len(wavelengths) > 1:
        raise _core.InputError(
            "wavelength: there are several lasers: take .wavelengths, or of a hologram .lasers[0]"
        )
    return wavelengths[0]


class SceneObject:
    """An object of a scene: its mesh and where it stands.

    Changes go into the scene that it belongs to.
    """

    def __init__(self, scene: Scene, index: int) -> None:
        self._scene, self._index = scene, index

    @property
    def mesh(self) -> Any:
        """The mesh: the name of a file; (vertices, faces), (vertices, faces, uv) or
        (vertices, faces, uv, normals); or a trimesh.Trimesh, whose texture or colours it has
        where the scene names no material; or points, {"points": (n, 3), "radius": one for all or
        (n,), "colours": (n, 3) or (n, 4), "normals": (n, 3)}, of which the first is needed. A disc
        stands for a point with a normal, a small ball for others; those without a radius reach
        their fifth neighbours. Colours are linear, 0 to 1.

        vertices: (n, 3), float32 or float64, in the object's own units (the key `width` scales
        them; without it they are metres). faces: (m, 3), integers, counter-clockwise from outside.
        uv: (n, 2), (0, 0) is the texture's bottom left. normals: (n, 3).
        """
        name = self._values()["mesh"]  # a key that was set may have put a file in its place
        return self._scene._meshes.get(self._index, name) if name == _IN_MEMORY else name

    @mesh.setter
    def mesh(self, mesh: Any) -> None:
        if _is_path(mesh):
            self._scene._core.set([f"object.{self._index}.mesh={_toml(mesh)}"])
            self._scene._meshes.pop(self._index, None)
            return
        self._scene._core.set_mesh(self._index, _core.MeshArrays(*_arrays_of(mesh)))
        self._scene._meshes[self._index] = mesh

    @property
    def position(self) -> tuple[float, float, float]:
        """Place of the anchor, in metres: the centre of the bounding box unless the scene says
        otherwise."""
        x, y, z = self._scene._core.position(self._index)
        return x, y, z

    @position.setter
    def position(self, position: Vector) -> None:
        self._scene._core.set_pose(self._index, _vector(position, "position"), self.rotation)

    @property
    def rotation(self) -> tuple[float, float, float]:
        """Degrees about x, then y, then z."""
        x, y, z = self._scene._core.rotation(self._index)
        return x, y, z

    @rotation.setter
    def rotation(self, rotation: Vector) -> None:
        self._scene._core.set_pose(self._index, self.position, _vector(rotation, "rotation"))

    def _values(self) -> Any:
        return self._scene.values["objects"][self._index]

    def __repr__(self) -> str:
        values = self._values()
        return f"<raywave.SceneObject {self._index}: {values['mesh']} at {self.position}>"


def _png_of(picture: Any) -> bytes:
    """A picture of PIL's as a file."""
    data = io.BytesIO()
    if picture.mode not in ("L", "RGB", "RGBA"):
        picture = picture.convert("RGBA")
    picture.save(data, "PNG")
    return data.getvalue()


def _look_of(mesh: Any) -> tuple[Any, Any, bytes]:
    """(vertices and faces to take, colours, texture) of a trimesh.Trimesh."""
    import numpy as np

    visual: Any = getattr(mesh, "visual", None)
    shape = mesh.vertices, mesh.faces
    kind = getattr(visual, "kind", None)
    if kind == "texture":
        material = getattr(visual, "material", None)
        picture = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        # A trimesh without a picture has one of a single colour
        is_plain = picture is None or all(
            least == most for least, most in picture.convert("RGBA").getextrema()
        )
        return shape, None, b"" if is_plain else _png_of(picture)
    if kind not in ("vertex", "face"):
        return shape, None, b""
    colours = np.asarray(visual.vertex_colors if kind == "vertex" else visual.face_colors) / 255
    if kind == "face":  # each face has corners of its own
        shape = mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size).reshape(-1, 3)
        colours = colours.repeat(3, axis=0)
    srgb = colours[:, :3]
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return shape, np.concatenate([linear, colours[:, 3:]], axis=1), b""


def _points_of(given: Mapping[str, Any]) -> tuple[Any, None, None, Any, Any, bytes, Any]:
    """_arrays_of points."""
    import numpy as np

    known = {"points", "radius", "colours", "normals"}
    if "points" not in given or set(given) - known:
        raise _core.InputError(
            "mesh: of points has the keys points, radius, colours and normals, got "
            + ", ".join(map(str, given))
        )
    points, colours = given["points"], given.get("colours")
    count = len(points)
    if colours is not None:
        colours = np.asarray(colours, np.float64)
        if colours.ndim == 2 and colours.shape[1] == 3:
            colours = np.concatenate([colours, np.ones((len(colours), 1))], axis=1)
    radius = np.asarray(0 if given.get("radius") is None else given["radius"], np.float64)
    radii = np.full((count, 1), radius) if radius.ndim == 0 else radius.reshape(-1, 1)
    return points, None, None, given.get("normals"), colours, b"", np.ascontiguousarray(radii)


def _arrays_of(mesh: Any) -> tuple[Any, ...]:
    """(vertices, faces, uv, normals, colours, texture[, radii]) of what SceneObject.mesh takes."""
    import numpy as np

    if isinstance(mesh, Mapping):
        return _points_of(mesh)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):  # trimesh
        shape, colours, texture = _look_of(mesh)
        vertices, faces = np.asarray(shape[0], np.float64), np.asarray(shape[1], np.int64)
        uv = getattr(getattr(mesh, "visual", None), "uv", None)
        if uv is None or len(uv) != len(vertices):
            return vertices, faces, None, None, colours, b""
        return vertices, faces, np.asarray(uv, np.float64), None, colours, texture
    if not isinstance(mesh, (tuple, list)) or not 2 <= len(mesh) <= 4:
        raise _core.InputError(
            "mesh: must be the name of a file, (vertices, faces[, uv[, normals]]), a "
            f"trimesh.Trimesh or a dict of points, got {type(mesh).__name__}"
        )
    given = [*mesh, None, None]
    return given[0], given[1], given[2], given[3], None, b""


def _vector(value: Vector, name: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError, OverflowError):
        raise _core.InputError(f"{name}: must be three numbers, got {value!r}") from None
    return x, y, z


class _Objects(Sequence[SceneObject]):
    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def __len__(self) -> int:
        return self._scene._core.objects

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(f"object {index}: there are {len(self)}")
        return SceneObject(self._scene, index % len(self))

    def __iter__(self) -> Iterator[SceneObject]:
        return (SceneObject(self._scene, i) for i in range(len(self)))


class Scene:
    """A scene: hologram, SLM, lights, materials and objects.

    Scene(values) makes one of what a scene file (docs/scene.md) would hold, as nested mappings:

        scene = rw.Scene({
            "hologram": {"resolution": [640, 480], "pitch": "8 um", "wavelength": "638 nm"},
            "light": [{"direction": [0.3, -0.4, 0.9]}],
            "object": [{"mesh": (vertices, faces), "width": "3 mm",
                        "position": ["0 mm", "0 mm", "100 mm"]}],
        })

    or of the text of such a file. An object's `mesh` is a file, or what SceneObject.mesh takes; it
    may also be given later. Files are named relative to `folder`.

    Raises InputError: one line with the line of the scene, and what would be right.
    """

    def __init__(self, source: Mapping[str, Value] | str, *, folder: Path = ".") -> None:
        meshes: dict[int, Any] = {}
        if isinstance(source, str):
            text = source
        elif isinstance(source, Mapping):
            values = dict(source)
            if isinstance(values.get("object"), (list, tuple)):
                objects = [dict(item) if isinstance(item, Mapping) else item
                           for item in values["object"]]
                for i, item in enumerate(objects):
                    if isinstance(item, dict) and "mesh" in item and not _is_path(item["mesh"]):
                        meshes[i] = item.pop("mesh")
                values["object"] = objects
            text = _document(values)
        else:
            raise _core.InputError(
                "Scene: takes nested mappings or a scene file's text; "
                "load_scene reads a file"
            )
        self._core = _core.parse_scene(text, os.fspath(folder), [], "scene")
        _warn(self.notes)
        self._meshes: dict[int, Any] = {}
        for i, mesh in meshes.items():
            self.objects[i].mesh = mesh

    @classmethod
    def _of(cls, core: _core.Scene, meshes: dict[int, Any]) -> Scene:
        scene = cls.__new__(cls)
        scene._core, scene._meshes = core, dict(meshes)
        return scene

    @property
    def objects(self) -> Sequence[SceneObject]:
        """The scene's objects, in the order of the file."""
        return _Objects(self)

    @property
    def shape(self) -> tuple[int, int]:
        """(ny, nx) of the hologram."""
        nx, ny = self._core.resolution
        return ny, nx

    @property
    def pitch(self) -> tuple[float, float]:
        """Pixel pitch of the hologram, x and y, in metres."""
        x, y = self._core.pixels.pitch_m
        return x, y

    @property
    def wavelength(self) -> float:
        """In metres. Raises InputError for a scene of several lasers, which has `wavelengths`."""
        return _one_wavelength(self.wavelengths)

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """One, or those of several lasers (docs/colour.md), in the scene's order. In metres."""
        return tuple(self._core.wavelengths)

    @property
    def frames(self) -> int:
        """Holograms that differ in their random phases only."""
        return self._core.frames

    @property
    def values(self) -> dict[str, Any]:
        """The scene with every default filled in, lengths in metres, as report.json has it."""
        return dict(json.loads(self._core.json()))

    @property
    def notes(self) -> list[str]:
        """For the user, one line each: lengths without a unit, LUTs that are not taken as they
        are. Whatever makes a scene, or sets its keys, warns with them.
        """
        return self._core.notes

    def set(self, values: Mapping[str, Value]) -> None:
        """Changes keys: {"sampling.frames": 4, "object.0.width": "9 mm"}, as `raywave --set` does.

        Raises InputError, and leaves the scene as it was, for a key or value that is not possible.
        """
        known = self.notes
        self._core.set(_overrides(values))
        _warn([note for note in self.notes if note not in known])

    def copy(self) -> Scene:
        """A copy that may be changed on its own. Meshes are shared."""
        return Scene._of(self._core.copy(), self._meshes)

    def __reduce__(self) -> Any:
        if self._core.is_planned:
            raise _core.InputError(
                "the scene of a plan is not pickled: pickle the scene that was planned"
            )
        text, folder, overrides, name = self._core.source()
        meshes = {one._index: one.mesh for one in self.objects if not _is_path(one.mesh)}
        poses = [(one.position, one.rotation) for one in self.objects]
        return _restored, (text, os.path.abspath(folder), overrides, name, meshes, poses)

    def __copy__(self) -> Scene:
        return self.copy()

    def __deepcopy__(self, memo: Any) -> Scene:
        return self.copy()

    def _repr_html_(self) -> str:
        values = self.values
        x, y = self.pitch
        rows = [
            ("hologram", f"{self.shape[1]} x {self.shape[0]} pixels of {x * 1e6:.4g} x "
                         f"{y * 1e6:.4g} um"),
            ("wavelength", ", ".join(f"{one * 1e9:.4g} nm" for one in self.wavelengths)),
            ("frames", str(self.frames)),
            ("SLM", values["slm"]["encoding"]),
        ]
        for one in self.objects:
            place = ", ".join(f"{length * 1e3:.4g}" for length in one.position)
            rows.append((f"object {one._index}", f"{one._values()['mesh']} at ({place}) mm"))
        rows += [("note", note) for note in self.notes]
        return "<table>" + "".join(
            f"<tr><th style='text-align:left'>{html.escape(label)}</th>"
            f"<td style='text-align:left'>{html.escape(text)}</td></tr>"
            for label, text in rows
        ) + "</table>"

    def __repr__(self) -> str:
        ny, nx = self.shape
        count = len(self.objects)
        lasers = ", ".join(f"{one * 1e9:.4g} nm" for one in self.wavelengths)
        return (
            f"<raywave.Scene {nx} x {ny}, pitch {self.pitch[0] * 1e6:.4g} um, "
            f"{lasers}, {count} object{'' if count == 1 else 's'}>"
        )


def _restored(
    text: str, folder: str, overrides: list[str], name: str, meshes: dict[int, Any], poses: Any
) -> Scene:
    scene = Scene._of(_core.parse_scene(text, folder, overrides, name), {})
    for index, mesh in meshes.items():
        scene.objects[index].mesh = mesh
    for one, (position, rotation) in zip(scene.objects, poses):
        if (one.position, one.rotation) != (position, rotation):
            scene._core.set_pose(one._index, position, rotation)
    return scene


def load_scene(path: Path, overrides: Mapping[str, Value] | None = None) -> Scene:
    """Reads and checks a scene file (docs/scene.md lists every key).

    path: the TOML file; meshes and textures are named relative to it, and read when something is
    first computed.
    overrides: keys to change, as `raywave --set` does: {"hologram.pitch": "8 um",
    "sampling.frames": 4, "hologram.resolution": [640, 480]}.

    Raises InputError: one line with file and line, and what would be right.
    """
    scene = Scene._of(_core.load_scene(os.fspath(path), _overrides(overrides)), {})
    _warn(scene.notes)
    return scene
