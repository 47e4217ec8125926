# SPDX-License-Identifier: Apache-2.0
import copy
import multiprocessing
import pathlib
import pickle
import shutil

import numpy as np
import pytest
from conftest import DATA, SQUARE, square_file, square_values

import raywave as rw


def test_overrides_mean_what_they_mean_on_the_command_line():
    scene = rw.load_scene(
        DATA / "teapot.toml",
        {"hologram.pitch": "8 um", "hologram.resolution": [64, 48], "sampling.frames": 3,
         "trace.shadows": True, "wrp.padding": 1.25},
    )
    assert scene.pitch == (8e-6, 8e-6)
    assert scene.shape == (48, 64)
    assert scene.frames == 3
    assert scene.values["trace"]["shadows"] is True
    assert scene.values["wrp"]["padding"] == 1.25


def test_a_scene_from_python_is_the_scene_of_its_file(tmp_path):
    square_file(tmp_path)
    (tmp_path / "scene.toml").write_text(
        '[hologram]\nresolution = [48, 32]\npitch = "4 um"\n[sampling]\npitch = "20 um"\n'
        '[[light]]\ndirection = [0, 0, 1]\n[[object]]\nmesh = "square.obj"\nwidth = "0.2 mm"\n'
        'position = [0, 0, "10 mm"]\n'
    )
    of_file = rw.render(rw.load_scene(tmp_path / "scene.toml"))
    of_arrays = rw.render(rw.Scene(square_values()))
    assert np.array_equal(of_file.field, of_arrays.field)
    values = square_values()
    values["object"][0]["mesh"] = pathlib.Path("square.obj")
    named = rw.Scene(values, folder=tmp_path)
    assert np.array_equal(rw.render(named).field, of_arrays.field)


def test_materials_lights_and_text_come_through_as_written():
    values = square_values()
    values["materials"] = {"matt gold": {"diffuse": [0.9, 0.7, 0.1], "shininess": np.float64(40)}}
    values["object"][0]["material"] = "matt gold"
    values["light"].append({"type": "ambient", "intensity": 0.25})
    scene = rw.Scene(values)
    assert scene.values["materials"][1]["name"] == "matt gold"
    assert scene.values["materials"][1]["diffuse"] == [0.9, 0.7, 0.1]
    assert scene.values["lights"][1] == {"type": "ambient", "intensity": 0.25}
    text = '[[light]]\n"type" = "ambient"\n[[object]]\n'
    assert rw.Scene(text).values["objects"][0]["mesh"] == ""


def test_a_refused_value_leaves_the_scene_as_it_was(scene):
    scene.set({"sampling.frames": 2})
    with pytest.raises(rw.InputError, match="wrp.padding=99"):
        scene.set({"sampling.frames": 5, "wrp.padding": 99})
    assert scene.frames == 2
    other = scene.copy()
    other.set({"sampling.frames": 3})
    assert (scene.frames, other.frames) == (2, 3)


def test_messages_say_where_in_the_scene():
    with pytest.raises(rw.InputError, match=r"^scene:\d+: sampling: unknown key \"pich\""):
        rw.Scene({**square_values(), "sampling": {"pich": 1}})
    with pytest.raises(ValueError, match="none.toml"):
        rw.load_scene("none.toml")
    with pytest.raises(rw.InputError, match="no values of the type object"):
        rw.Scene({**square_values(), "sampling": {"pitch": object()}})
    for wrong in (None, 3, []):
        with pytest.raises(rw.InputError, match="^Scene:"):
            rw.Scene(wrong)
    with pytest.raises(rw.InputError, match="^overrides:"):
        rw.load_scene(DATA / "teapot.toml", ["sampling.frames=2"])


def test_objects_can_be_moved_and_given_other_meshes(scene):
    thing = scene.objects[0]
    thing.position = (0, 1e-5, 0.012)
    thing.rotation = [0, 45, 0]
    assert thing.position == (0, 1e-5, 0.012)
    assert thing.rotation == (0, 45, 0)
    assert len(scene.objects) == 1 and scene.objects[-1].mesh is thing.mesh
    vertices, faces = SQUARE
    for mesh in [
        (vertices.astype(np.float32), faces.astype(np.uint32)),
        (vertices, faces.astype(np.int32), np.zeros((4, 2))),
        (vertices, faces.astype(np.uint64), None, np.tile([0.0, 0, -1], (4, 1))),
    ]:
        thing.mesh = mesh
        assert thing.mesh is mesh
    with pytest.raises(IndexError):
        scene.objects[1]


def test_a_file_that_a_key_names_takes_the_place_of_a_mesh(scene):
    thing = scene.objects[0]
    file = str(DATA / "teapot.ply")
    scene.set({"object.0.mesh": file})
    assert thing.mesh == file and scene.copy().objects[0].mesh == file
    thing.mesh = SQUARE
    assert thing.mesh is SQUARE


def test_a_trimesh_is_taken_with_its_texture_coordinates(scene):
    trimesh = pytest.importorskip("trimesh")
    uv = np.random.default_rng(1).random((4, 2))
    scene.objects[0].mesh = trimesh.Trimesh(
        *SQUARE, process=False, visual=trimesh.visual.TextureVisuals(uv=uv)
    )
    assert np.array_equal(
        rw.render(scene).field, rw.render(rw.Scene(square_values())).field
    ), "without a texture, its coordinates change nothing"
    scene.objects[0].mesh = trimesh.creation.icosphere(subdivisions=2)
    assert rw.render(scene).levels.std() > 0


def test_a_trimesh_wears_its_colours_and_texture_as_a_file_of_them(scene, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    image = pytest.importorskip("PIL.Image")
    levels = np.array([[255, 128, 30], [0, 200, 90], [255, 255, 255], [40, 10, 220]], np.uint8)
    uv = (SQUARE[0][:, :2] + 0.5).astype(float)
    ply = tmp_path / "square.ply"
    corners = "".join(
        f"{x} {y} {z} {r} {g} {b}\n" for (x, y, z), (r, g, b) in zip(SQUARE[0], levels)
    )
    ply.write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\n"
        + "".join(f"property float {name}\n" for name in "xyz")
        + "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
        + "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
        + corners + "3 0 1 2\n3 0 2 3\n"
    )
    pixels = levels.reshape(2, 2, 3)
    image.fromarray(pixels).save(tmp_path / "picture.png")
    (tmp_path / "square.mtl").write_text("newmtl m\nKa 1 1 1\nKd 1 1 1\nmap_Kd picture.png\n")
    (tmp_path / "square.obj").write_text(
        "mtllib square.mtl\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in SQUARE[0])
        + "".join(f"vt {u} {v}\n" for u, v in uv) + "usemtl m\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    textured = trimesh.visual.TextureVisuals(uv=uv, image=image.fromarray(pixels))
    for mesh, file in [
        (trimesh.Trimesh(*SQUARE, process=False, vertex_colors=levels), ply),
        (trimesh.Trimesh(*SQUARE, process=False, visual=textured), tmp_path / "square.obj"),
    ]:
        for wavelength in ("638 nm", "450 nm"):
            scene.set({"hologram.wavelength": wavelength})
            plain = rw.lens(rw.Scene(square_values(wavelength=wavelength)), 0.01, points=2)
            scene.objects[0].mesh = mesh
            worn = rw.lens(scene, 0.01, points=2)
            scene.objects[0].mesh = file
            assert np.allclose(worn, rw.lens(scene, 0.01, points=2), rtol=1e-4, atol=0)
            assert not np.allclose(worn, plain, rtol=0.1)
    # Faces of one colour: where a square is half red, the red laser sees this half alone.
    faces = np.array([[255, 0, 0, 255], [0, 0, 0, 255]], np.uint8)
    scene.set({"hologram.wavelength": "638 nm"})
    scene.objects[0].mesh = trimesh.Trimesh(*SQUARE, process=False, face_colors=faces)
    seen = rw.lens(scene, 0.01, points=2)
    white = rw.lens(rw.Scene(square_values()), 0.01, points=2)
    assert abs((seen > seen.max() / 2).sum() / (white > white.max() / 2).sum() - 0.5) < 0.1
    scene = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(rw.lens(scene, 0.01, points=2), seen)


def test_points_are_taken_as_a_mesh_of_them_is(scene):
    x, y = (np.indices((40, 40)).reshape(2, -1) + 0.5) / 40 - 0.5
    points = np.stack([x, y, 0 * x], axis=1)
    whole = rw.lens(scene, 0.01, points=2)
    for more in [{}, {"radius": 0.75 / 40}, {"radius": np.full(1600, 0.75 / 40)}]:
        scene.objects[0].mesh = {"points": points, "normals": np.tile([0, 0, -1.0], (1600, 1)),
                                 **more}
        assert rw.lens(scene, 0.01, points=2).sum() == pytest.approx(whole.sum(), rel=0.15)
    scene.objects[0].mesh = {"points": points, "colours": np.full((1600, 3), 0.5)}
    seen = rw.lens(scene, 0.01, points=2)
    assert np.median(seen[seen > 0]) == pytest.approx(0.5, rel=1e-3)
    again = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(rw.lens(again, 0.01, points=2), seen)


V, F = SQUARE
BAD_MESHES = {
    "vertices": [
        (V[:, :2].copy(), F), (np.full((4, 3), np.nan), F), (V.astype(int), F),
        (np.zeros((0, 3)), F), (V[None], F), (None, F), ("a square", F), (V * 1e31, F),
    ],
    "faces": [
        (V, F + 2), (V, F - 1), (V, F.astype(float)), (V, np.zeros((0, 3), int)),
        (V, np.array([[0, 1, 1]])), (V, F[0]), (V, None), (V, F.astype(bool)),
    ],
    "uv": [
        (V, F, np.zeros((3, 2))), (V, F, np.full((4, 2), np.inf)), (V, F, np.zeros((4, 3))),
        (V, F, "uv"),
    ],
    "normals": [(V, F, None, V[:2]), (V, F, None, np.full((4, 3), np.nan))],
    "mesh": [None, 3, (V,), (V, F, None, None, None), {"vertices": V}, {"points": V, "faces": F}],
    "radii": [{"points": V, "radius": -1.0}, {"points": V, "radius": [1.0, 2.0]}],
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_meshes_are_refused_by_name(scene, name):
    before = scene.objects[0].mesh
    for mesh in BAD_MESHES[name]:
        with pytest.raises(rw.InputError, match=f"^{name}: "):
            scene.objects[0].mesh = mesh
    assert scene.objects[0].mesh is before
    assert rw.render(scene).levels.std() > 0


def test_a_scene_pickles_with_its_meshes_places_and_changes(scene, tmp_path, monkeypatch):
    scene.set({"sampling.frames": 2, "hologram.wavelength": "633 nm"})
    scene.objects[0].position = (1e-5, 0, 0.012)
    again = pickle.loads(pickle.dumps(scene))
    assert again.values == scene.values
    assert np.array_equal(rw.render(again).levels, rw.render(scene).levels)
    again.set({"object.0.position": [0, 0, "9 mm"]})
    assert again.objects[0].position == pytest.approx((0, 0, 0.009))
    assert scene.objects[0].position == (1e-5, 0, 0.012)

    monkeypatch.chdir(DATA)  # files are found from anywhere else
    from_file = rw.load_scene("teapot.toml", {"sampling.frames": 3})
    data, text = pickle.dumps(from_file), rw.plan(from_file, "draft").text
    monkeypatch.chdir(tmp_path)
    loaded = pickle.loads(data)
    assert loaded.shape == from_file.shape and loaded.frames == 3
    assert rw.plan(loaded, "draft").text == text
    assert copy.copy(scene).values == copy.deepcopy(scene).values == scene.values
    with pytest.raises(rw.InputError, match="scene of a plan"):
        pickle.dumps(rw.plan(scene).scene)


def test_a_scene_goes_to_another_process(scene):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        (levels,) = pool.map(levels_of, [scene])
    assert np.array_equal(levels, rw.render(scene).levels)


def levels_of(scene):
    return rw.render(scene).levels


def test_a_notebook_shows_a_scene_and_no_markup_of_its_names(scene, tmp_path):
    scene.set({"hologram.wavelength": [638e-9, 520e-9, 450e-9]})
    shown = scene._repr_html_()
    for part in ("48 x 32 pixels", "638 nm, 520 nm, 450 nm", "(0, 0, 10) mm"):
        assert part in shown
    shutil.copy(DATA / "teapot.ply", tmp_path / "<b>.ply")
    scene.objects[0].mesh = tmp_path / "<b>.ply"
    assert "<b>" not in scene._repr_html_() and "&lt;b&gt;" in scene._repr_html_()
