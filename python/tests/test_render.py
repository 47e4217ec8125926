# SPDX-License-Identifier: Apache-2.0
import gc
import io
import json
import signal
import struct
import subprocess
import sys
import threading
import time
import zlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import DATA, LASERS, square_file, square_values
from PIL import Image

import raywave as rw

SMALL_TEAPOT = {"hologram.resolution": [160, 120], "sampling.pitch": "250 um"}


def grey_png(data):
    """Pixels of an 8-bit grey PNG, as another program reads them."""
    picture = Image.open(io.BytesIO(data))
    assert (picture.format, picture.mode) == ("PNG", "L")
    return np.asarray(picture)


def exr(data):
    """Pixels of an OpenEXR file of one float channel, in scan lines, plain or zipped."""
    at, header = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        (size,) = struct.unpack("<I", data[at : at + 4])
        header[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    x0, y0, x1, y1 = struct.unpack("<4i", header[b"dataWindow"])
    rows_of = {0: 1, 2: 1, 3: 16}[header[b"compression"][0]]  # none, ZIPS, ZIP
    pixels = np.zeros((y1 - y0 + 1, x1 - x0 + 1), "<f4")
    at += 1 + 8 * -(-len(pixels) // rows_of)  # the table of places
    while at < len(data):
        y, size = struct.unpack("<iI", data[at : at + 8])
        chunk, rows = data[at + 8 : at + 8 + size], pixels[y - y0 : y - y0 + rows_of]
        if size < rows.nbytes:
            steps = np.frombuffer(zlib.decompress(chunk), np.uint8).astype(np.int64)
            steps[1:] -= 128
            halves = (np.cumsum(steps) % 256).astype(np.uint8)
            chunk = np.empty_like(halves)
            chunk[::2], chunk[1::2] = np.split(halves, [(len(halves) + 1) // 2])
            chunk = chunk.tobytes()
        rows[:] = np.frombuffer(chunk, "<f4").reshape(rows.shape)
        at += 8 + size
    return pixels


def test_the_bits_are_those_of_the_command_line(program, tmp_path, device):
    file, setting = DATA / "teapot.toml", {**SMALL_TEAPOT, "sampling.frames": 2}
    line = [program, "render", file, "-o", tmp_path, "--quiet", "--device", device]
    for key, value in setting.items():
        line += ["--set", f"{key}={value}"]
    subprocess.run(line, check=True)
    holo = rw.render(rw.load_scene(file, setting), device=device)
    assert np.array_equal(np.load(tmp_path / "field.npy"), holo.field)
    for frame, name in enumerate(["hologram.png", "hologram_2.png"]):
        assert np.array_equal(grey_png((tmp_path / name).read_bytes()), holo.levels[frame])

    subprocess.run(
        [program, "reconstruct", tmp_path / "field.npy", "-z", "100mm", "-o", tmp_path, "--quiet",
         "--view", "0.25,0", "--aperture", "0.5", "--frame", "hologram", "--device", device],
        check=True,
    )  # fmt: skip
    image = rw.reconstruct(holo.field, z=0.1, view=(0.25, 0), aperture=0.5, device=device)
    picture = exr((tmp_path / "reconstruction_100mm.exr").read_bytes())
    assert np.array_equal(picture, image)


def test_views_through_a_pupil_are_those_of_the_command_line(program, tmp_path):
    setting = {"hologram.resolution": [320, 240], "sampling.frames": 1}
    file, sets = DATA / "near_eye.toml", [f"--set={k}={json.dumps(v)}" for k, v in setting.items()]
    scene = rw.load_scene(file, setting)
    holo = rw.render(scene)
    subprocess.run([program, "render", file, "-o", tmp_path, "--quiet", *sets], check=True)
    for pupil, ending in ((None, "_eye1"), ("2mm@0.3mm,0", ""), ("none", "")):
        how = ["-z", "-3mm", "-o", tmp_path, "--quiet", "--frame", "hologram"]
        # The first place in the hologram's frame is the command line's
        how += [] if pupil is None else ["--pupil", pupil]
        subprocess.run([program, "reconstruct", tmp_path / "report.json", *how], check=True)
        subprocess.run([program, "lens", file, *how, "--lens-points", "6", *sets], check=True)
        shown = exr((tmp_path / f"reconstruction_-3mm{ending}.exr").read_bytes())
        seen = exr((tmp_path / f"lens_-3mm{ending}.exr").read_bytes())
        assert np.array_equal(shown, rw.reconstruct(holo, -3e-3, pupil=pupil))
        assert np.array_equal(seen, rw.lens(scene, -3e-3, pupil=pupil, points=6))
    subprocess.run([program, "quality", file, "-o", tmp_path, "--lens-points", "3", "--quiet",
                    "-z", "-3mm", "--pupil", "scene", *sets], check=True)  # fmt: skip
    told = json.loads((tmp_path / "quality.json").read_text())["rows"]
    rows = rw.quality(scene, [-3e-3], lens_points=3)
    assert [row.pupil[1] for row in rows] == [row["pupil"]["position_m"][0] for row in told]
    for row, expected in zip(rows, told):
        assert row.view == "pupil"
        assert abs(row.levels.psnr_db - expected["psnr_db"]) < 1e-6
    assert rw.quality(holo, [-3e-3], pupils="3mm", lens_points=3)[0].pupil == (3e-3, 0, 0)


def test_arrays_have_the_shapes_and_types_that_the_docs_say(scene):
    one = rw.render(scene)
    assert (one.levels.shape, one.levels.dtype) == ((32, 48), np.uint8)
    assert (one.field.shape, one.field.dtype) == ((32, 48), np.complex64)
    assert (one.field.pitch, one.field.wavelength) == (scene.pitch, scene.wavelength)
    assert one.refined is None
    scene.set({"sampling.frames": 3})
    many = rw.render(scene)
    assert many.levels.shape == many.field.shape == many.shown.shape == (3, 32, 48)
    assert many.frames == 3 and many.report["scene"]["sampling"]["frames"] == 3
    assert rw.render(scene, field=False).field is None
    seen = rw.reconstruct(many, z=0.01)
    assert (seen.shape, seen.dtype) == ((32, 48), np.float32)
    assert rw.lens(scene, z=0.01, points=2).shape == (32, 48)


@pytest.mark.parametrize("name", ["study.toml", "colour.toml"])
def test_a_preview_is_the_picture_of_the_command_line(program, tmp_path, name):
    image = pytest.importorskip("matplotlib.image")
    told = json.loads(subprocess.run(
        [program, "preview", DATA / name, "-o", tmp_path, "--json"], check=True, text=True,
        capture_output=True).stdout)
    seen = rw.preview(rw.load_scene(DATA / name))
    assert list(seen.shape[1::-1]) == told["size"]
    light = np.clip(seen[:, ::-1] / told["white"], 0, 1)  # as an eye sees it
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    png = image.imread(tmp_path / "preview.png")
    assert np.abs(srgb - png).max() < 1.01 / 255


def test_what_a_plan_warns_of_is_warned_of_by_what_renders_it(scene):
    scene.set({"hologram.wavelength": "900 nm"})
    (warning, *_) = rw.plan(scene).warnings
    assert "no visible light" in warning
    with pytest.warns(UserWarning, match=warning):
        hologram = rw.render(scene)
    renderer = rw.Renderer(scene)
    with pytest.warns(UserWarning, match=warning):
        renderer.render(out=np.empty(renderer.shape, np.uint8))
    assert warning in hologram.notes and warning in renderer.notes
    assert warning in hologram.report["notes"]


def test_row_0_is_the_top_and_column_0_the_left():
    values = square_values(resolution=[96, 64])
    values["object"][0]["position"] = ["60 um", "40 um", "10 mm"]  # right and up
    values["object"][0]["width"] = "40 um"
    scene = rw.Scene(values)
    for image in [rw.lens(scene, z=0.01, points=2), rw.reconstruct(rw.render(scene).field, z=0.01)]:
        y, x = np.indices(image.shape)
        assert (image * y).sum() / image.sum() < 31.5 - 5
        assert (image * x).sum() / image.sum() > 47.5 + 8


def test_results_share_the_holograms_memory_and_outlive_it(scene):
    holo = rw.render(scene)
    levels, field = holo.levels, holo.field
    assert not levels.flags.owndata and not field.flags.owndata
    assert holo.levels is levels
    assert np.shares_memory(levels, holo._core.levels())
    copy = levels.copy()
    del holo
    gc.collect()
    rw.render(scene)
    assert np.array_equal(levels, copy)


def test_slm_rotation_applies_to_what_the_slm_is_sent_alone(scene):
    plain = rw.render(scene)
    scene.set({"slm.rotate": 90})
    turned = rw.render(scene)
    assert np.array_equal(turned.levels, plain.levels)
    assert np.array_equal(turned.for_slm(), np.rot90(plain.levels))
    with pytest.raises(rw.InputError, match="^frame: must be 0 to 0, got 1"):
        turned.for_slm(1)


def test_notebooks_see_a_plan_and_a_hologram(scene, tmp_path):
    plan = rw.plan(scene, preset="draft")
    assert repr(plan).startswith("hologram  48 x 32 pixels")
    page = plan._repr_html_()
    assert page.count("<tr") == len(plan.text.splitlines()) and "<script" not in page
    assert plan.seconds > 0 and plan.psnr_db > 0 and plan.device_bytes > 0
    assert plan.values["reasons"] and isinstance(plan.warnings, list)
    holo = rw.render(plan)
    assert np.array_equal(holo.field, rw.render(scene, preset="draft").field)
    assert np.array_equal(grey_png(holo._repr_png_()), holo.levels)
    with pytest.raises(rw.InputError, match="^path must end with .png"):
        holo.save(tmp_path / "hologram.jpg")
    holo.save(tmp_path / "hologram.png")
    assert np.array_equal(grey_png((tmp_path / "hologram.png").read_bytes()), holo.levels)
    scene.set({"sampling.frames": 2})
    holo = rw.render(scene)
    holo.save(tmp_path / "two.png")
    for name, levels in zip(("two.png", "two_2.png"), holo.levels, strict=True):
        assert np.array_equal(grey_png((tmp_path / name).read_bytes()), levels)


def test_a_renderer_fills_memory_of_the_callers(scene):
    scene.set({"sampling.frames": 2})
    renderer = rw.Renderer(scene)
    expected = rw.render(scene)
    out, field = np.zeros(renderer.shape, np.uint8), np.zeros(renderer.shape, np.complex64)
    assert renderer.render(out=out, field=field) is out
    assert np.array_equal(out, expected.levels) and np.array_equal(field, expected.field)
    room = bytearray(out.size + 16)  # a buffer that is no array
    renderer.render(out=memoryview(room)[8:-8].cast("B", renderer.shape))
    assert bytes(room[8:-8]) == out.tobytes() and not any(room[:8]) and not any(room[-8:])
    renderer.set_pose(0, (0, 0, 0.012), (0, 20, 0))
    turned = renderer.render().levels.copy()
    assert not np.array_equal(turned, expected.levels)
    renderer.set_pose(0, (0, 0, 0.012), (0, 20, 0), solid=True)  # not as wide as at first
    assert not np.array_equal(renderer.render().levels, turned)
    renderer.set_seed(5)


def test_a_renderer_shows_new_meshes_and_lights_as_a_new_render_does(scene):
    tent = (np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, -0.8)]) * 3e-4,
            np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]))
    scene.set({"light": [{"type": "directional", "direction": (0, 0, 1)}]})
    renderer = rw.Renderer(scene)
    before = renderer.render()
    renderer.set_pose(0, (1e-5, 0, 0.0105), (0, 20, 0))
    renderer.set_light(0, direction=(0.6, 0.1, 0.8), intensity=0.7)
    renderer.set_mesh(0, tent)
    renderer.set_light(0, intensity=0.4)
    again = renderer.render()
    with pytest.raises(rw.InputError, match="^vertices: holds a number"):
        renderer.set_mesh(0, (np.full((3, 3), np.nan), np.array([(0, 1, 2)])))
    for wrong, message in [(dict(light=7), "light 7: there are"), (dict(light=0, size=1), "size"),
                           (dict(light=0, highlights=False), "must stay as they are")]:
        with pytest.raises(rw.InputError, match=message):
            renderer.set_light(**wrong)
    assert np.array_equal(renderer.render().levels, again.levels)
    scene.set({"light.0.direction": (0.6, 0.1, 0.8), "light.0.intensity": 0.4})
    scene.objects[0].mesh = tent
    scene.objects[0].position, scene.objects[0].rotation = (1e-5, 0, 0.0105), (0, 20, 0)
    expected = rw.render(scene)
    assert np.linalg.norm(again.field - expected.field) < 1e-3 * np.linalg.norm(expected.field)
    assert np.linalg.norm(again.field - before.field) > 0.1 * np.linalg.norm(expected.field)
    assert again.report["scene"]["lights"][0]["intensity"] == 0.4


def test_bad_outputs_are_refused_by_name_and_stay_as_they_are(scene):
    renderer = rw.Renderer(scene, field=False)
    read_only = np.zeros((32, 48), np.uint8)
    read_only.flags.writeable = False
    wrong = [
        read_only, np.zeros((32, 47), np.uint8), np.zeros((32, 48), np.int8), "levels", 3,
        np.zeros((32, 96), np.uint8)[:, ::2], np.zeros((2, 32, 48), np.uint8),
        np.zeros((0, 48), np.uint8), np.zeros((1, 1, 32, 48), np.uint8), b"\0" * (32 * 48),
    ]
    for out in wrong:
        with pytest.raises(rw.InputError, match="^out: "):
            renderer.render(out=out)
    with pytest.raises(rw.InputError, match="^field: "):
        renderer.render(field=np.zeros((32, 48), np.complex64))  # it keeps none
    assert not read_only.any()
    for pose in [(0, (0, 0)), (0, (0, 0, np.nan)), (1, (0, 0, 0.1)), (-1, (0, 0, 0.1)), ("a", 1)]:
        with pytest.raises(rw.InputError):
            renderer.set_pose(*pose)
    with pytest.raises(rw.InputError, match="^seed"):
        renderer.set_seed(-1)
    assert renderer.render().levels.std() > 0


def test_progress_runs_to_the_end_and_can_stop(scene):
    steps = []
    rw.render(scene, progress=lambda what, share: steps.append((what, share)))
    assert steps[-1] == ("done", 1.0) and all(0 <= share <= 1 for _, share in steps)
    renderer = rw.Renderer(scene)
    expected = renderer.render().levels.copy()
    with pytest.raises(rw.Cancelled):
        renderer.render(progress=lambda what, share: False)
    with pytest.raises(ZeroDivisionError):
        renderer.render(progress=lambda what, share: 1 / 0)
    assert np.array_equal(renderer.render().levels, expected)


def test_ctrl_c_stops_a_render_at_its_next_step(scene):
    scene.set({"sampling.frames": 4096, "hologram.resolution": [256, 256],
               "sampling.pitch": "5 um"})
    renderer = rw.Renderer(scene, field=False)
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    start = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        renderer.render()
    timer.join()
    assert 0.2 < time.perf_counter() - start < 20


def test_other_threads_run_while_a_picture_is_rendered(scene):
    scene.set({"sampling.frames": 64, "hologram.resolution": [256, 256], "sampling.pitch": "5 um"})
    renderer = rw.Renderer(scene, field=False)
    renderer.render()
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(1e-3)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.perf_counter()
    renderer.render()
    end = time.perf_counter()
    done.set()
    thread.join()
    during = [t for t in ticks if start < t < end]
    assert len(during) > 5, f"{len(during)} ticks in {end - start:.3f} s"


def test_several_threads_may_use_one_renderer_and_several(scene):
    scene.set({"sampling.frames": 2})
    shared = rw.Renderer(scene)
    expected = shared.render().levels.copy()

    def work(own):
        renderer = rw.Renderer(scene) if own else shared
        return all(np.array_equal(renderer.render().levels, expected) for _ in range(3))

    with ThreadPoolExecutor(4) as threads:
        assert all(threads.map(work, (True, False, True, False)))


def test_a_scene_may_change_while_other_threads_render_it(scene):
    done, pictures = threading.Event(), []

    def work():
        while not done.is_set():
            pictures.append(rw.render(scene).levels.shape)

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for seed in range(60):
        scene.set({"sampling.seed": seed})
        scene.objects[0].mesh = scene.objects[0].mesh
        scene.objects[0].position = (0, 0, 0.01 + 1e-6 * seed)
    done.set()
    for thread in threads:
        thread.join()
    assert pictures and set(pictures) == {(32, 48)}


def test_200_renderers_made_and_dropped_leave_memory_as_it_was(scene):
    def resident_mib():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096 / 2**20

    def make(count):
        for _ in range(count):
            rw.Renderer(scene).render()
        gc.collect()
        return resident_mib()

    first, then = make(20), make(40)  # each opens the device anew
    assert then - first < 0.4, f"{first:.1f} MiB after 20, {then:.1f} MiB after 60"
    with_one = rw.Renderer(scene)  # whose programs the others share
    first, last = make(20), make(160)
    assert last - first < 1.6, f"{first:.1f} MiB after 20, {last:.1f} MiB after 180"
    assert with_one.render().levels is not None


def test_devices_errors_and_forks_are_told(scene):
    assert all(d.index and d.name and d.kind for d in rw.devices())
    for kind in {d.kind for d in rw.devices()}:
        named = rw.render(scene, device=kind).report["device"]["index"]
        assert named in [d.index for d in rw.devices() if d.kind == kind]
    with pytest.raises(rw.DeviceError, match="no such device"):
        rw.render(scene, device="none of these")
    assert issubclass(rw.InputError, ValueError) and issubclass(rw.DeviceError, RuntimeError)
    code = (
        "import os, raywave as rw\n"
        "rw.devices(); rw.plan(rw.load_scene(%r))\n"
        "pid = os.fork()\n"
        "if pid == 0:\n"
        "    try: rw.plan(rw.load_scene(%r))\n"
        "    except rw.DeviceError as e: os._exit(0 if 'fork' in str(e) else 2)\n"
        "    os._exit(1)\n"
        "raise SystemExit(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))\n"
    ) % ((str(DATA / "teapot.toml"),) * 2)
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_wrong_options_are_refused(scene):
    wrong = [
        ({"preset": "best"}, "best"), ({"method": "magic"}, "method"), ({"fft": "none"}, "fft"),
        ({"budget": -1.0}, "budget"), ({"preset": "draft", "psnr": 20}, "at most 1"),
        ({"budget": "soon"}, "budget"), ({"method": "rays", "rays": 0}, "rays"),
        ({"preset": 3}, "^preset: must be text"), ({"device": 0}, "^device: must be text"),
        ({"rays": 1.5}, "^rays: must be a whole"), ({"rays": 2**40}, "^rays: must be 1 to 1000"),
    ]
    for options, text in wrong:
        with pytest.raises(rw.InputError, match=text):
            rw.render(scene, **options)
    with pytest.raises(rw.InputError, match="^progress: must be a function"):
        rw.render(scene, progress=3)
    with pytest.raises(rw.InputError, match="^scene: must be a Scene"):
        rw.render("scene.toml")
    with pytest.raises(rw.InputError, match="mesh is missing"):
        rw.render(rw.Scene({**square_values(), "object": [{"width": "1 mm"}]}))


def test_help_tells_shapes_units_and_errors():
    for function in (rw.render, rw.reconstruct, rw.propagate, rw.encode, rw.lens, rw.refine):
        text = function.__doc__
        for word in ("(ny, nx)", "InputError", "DeviceError"):
            assert word in text, (function.__name__, word)
        assert "metres" in text, function.__name__


def test_three_lasers_are_the_bits_of_the_command_line(program, tmp_path):
    text = (
        '[hologram]\nresolution = [48, 32]\npitch = "4 um"\n[sampling]\npitch = "20 um"\n'
        '[[light]]\ndirection = [0, 0, 1]\n[materials.red]\ndiffuse = [0.9, 0.2, 0.1]\n'
        '[[object]]\nmesh = "square.obj"\nwidth = "0.2 mm"\nposition = [0, 0, "10 mm"]\n'
        'material = "red"\n'
    )
    square_file(tmp_path)
    (tmp_path / "scene.toml").write_text(text)
    lasers = "hologram.wavelength=" + json.dumps(LASERS)
    out = tmp_path / "out"
    subprocess.run(
        [program, "render", tmp_path / "scene.toml", "--set", lasers, "-o", out, "--quiet"],
        check=True,
    )
    scene = rw.load_scene(tmp_path / "scene.toml", {"hologram.wavelength": LASERS})
    assert scene.wavelengths == pytest.approx((638e-9, 520e-9, 450e-9))
    with pytest.raises(rw.InputError, match="several lasers"):
        scene.wavelength
    holo = rw.render(scene)
    assert holo.levels.shape == holo.field.shape == (3, 1, 32, 48)
    assert sum(holo.powers) == pytest.approx(1)
    assert len(holo.lasers) == 3
    holo.save(tmp_path / "holo.png")
    holo.save(tmp_path / "packed.png", rgb=True)
    for i, name in enumerate(["638nm", "520nm", "450nm"]):
        one = holo.lasers[i]
        assert one.wavelength == scene.wavelengths[i] and one.levels.shape == (32, 48)
        assert np.shares_memory(one.levels, holo.levels)
        assert (one.levels == holo.levels[i, 0]).all()
        assert (one.field == np.load(out / f"field_{name}.npy")).all()
        sent = grey_png((out / f"hologram_{name}.png").read_bytes())
        assert (sent == one.for_slm()).all()
        assert (grey_png((tmp_path / f"holo_{name}.png").read_bytes()) == sent).all()
    packed = (tmp_path / "packed.png").read_bytes()
    assert packed[24:26] == b"\x08\x02"

    # In Python's own frames
    renderer = rw.Renderer(scene)
    levels, field = np.empty(renderer.shape, np.uint8), np.empty(renderer.shape, np.complex64)
    renderer.render(out=levels, field=field)
    assert (levels == holo.levels).all() and (field == holo.field).all()
    assert renderer.powers == holo.powers
    with pytest.raises(rw.InputError, match="out: must have the shape"):
        renderer.render(out=np.empty((3, 32, 48), np.uint8))

    # Pictures in colour, red
    seen, sharp = rw.reconstruct(holo, z=0.01), rw.lens(scene, z=0.01, points=2)
    assert seen.shape == sharp.shape == (32, 48, 3)
    for picture in seen, sharp:
        red, green, blue = picture.mean(axis=(0, 1))
        assert red > 2 * green and red > 2 * blue
    assert rw.compare(sharp, sharp).delta_e == (0, 0, 0, 0)
    assert rw.compare(sharp, seen, blur=4).delta_e[0] > 0.1
    assert rw.compare(sharp[..., 0].copy(), seen[..., 0].copy()).delta_e is None
    with pytest.raises(rw.InputError, match="several lasers"):
        rw.reconstruct(holo.field, z=0.01)
    assert rw.reconstruct(holo.lasers[2].field, z=0.01).shape == (32, 48)


def test_quality_compares_what_the_levels_show_with_the_lens(scene):
    scene.set({"sampling.frames": 2})
    holo = rw.render(scene)
    how = {"blur": 6e-6, "border": 3, "lens_points": 3, "window": (160e-6, 120e-6)}
    quality = rw.quality(holo, [0.01, 0.011], **how)
    assert [(row.z, row.view) for row in quality] == [(0.01, "whole"), (0.011, "whole")] + [
        (0.01, view) for view in ("left", "right", "top", "bottom")
    ]
    parts = {"whole": ((0, 0), (1, 1)), "left": ((0.5, 0), (0.5, 0.5)),
             "top": ((0, 0.5), (0.5, 0.5))}  # fmt: skip
    for row in quality:
        if row.view not in parts:
            continue
        view, aperture = parts[row.view]
        seen = {"view": view, "aperture": aperture, "window": how["window"]}
        lens = rw.lens(scene, row.z, points=3, **seen)
        for light, figures in ((holo.shown, row.levels), (holo.field, row.field)):
            expected = rw.compare(lens, rw.reconstruct(light, row.z, **seen), blur=1.5, border=3)
            assert abs(figures.psnr_db - expected.psnr_db) < 1e-3
            assert abs(figures.ssim - expected.ssim) < 1e-5
        assert row.lens.shape == row.hologram.shape == (lens.shape[0] - 6, lens.shape[1] - 6)
    assert quality.psnr_db == (quality[0].levels.psnr_db + quality[1].levels.psnr_db) / 2
    assert f"{quality[1].levels.psnr_db:.2f}" in repr(quality) + quality._repr_html_()
    assert repr(rw.quality(scene, [0.01, 0.011], **how)) == repr(quality)
    with pytest.raises(rw.InputError, match="^hologram: has no field"):
        rw.quality(rw.render(scene, field=False))


def test_quality_has_the_figures_of_the_command_line(program, tmp_path):
    for values in ({}, {"hologram.wavelength": LASERS}):
        file = DATA / "study.toml"
        small = {"hologram.resolution": [160, 96], "sampling.frames": 1, **values}
        sets = [f"--set={key}={json.dumps(value)}" for key, value in small.items()]
        subprocess.run([program, "quality", file, "-o", tmp_path, "--lens-points", "3", "--quiet",
                        "--no-views", *sets], check=True)  # fmt: skip
        told = json.loads((tmp_path / "quality.json").read_text())["rows"]
        rows = rw.quality(rw.load_scene(file, small), views=False, lens_points=3)
        assert len(rows) == len(told) > 1
        for row, expected in zip(rows, told):
            assert (row.z, row.view) == (expected["z_m"], expected["view"])
            for name, figures in (("psnr_db", row.levels), ("ssim", row.levels)):
                assert abs(getattr(figures, name) / expected[name] - 1) < 1e-6
            assert abs(row.field.psnr_db / expected["field"]["psnr_db"] - 1) < 1e-6
            assert abs(row.light_share / expected["light_share"] - 1) < 1e-6
            if values:
                assert abs(row.levels.delta_e[0] / expected["delta_e_2000"]["mean"] - 1) < 1e-6


def test_a_trade_is_a_table_rows_and_a_picture(tmp_path):
    scene = rw.Scene({**square_values(), "sampling": {}})
    made = rw.trade(scene, presets=True, renders=1, views=False, lens_points=4, border=2,
                    folder=tmp_path)
    assert "balanced" in repr(made) and made.csv.startswith("row,")
    rows = made.values["rows"]
    assert {one["preset"] for one in made.values["presets"]} == {
        "draft", "balanced", "accurate", "reference"}
    assert all(row["psnr_db"] > 0 for row in rows)
    assert made.sheet.dtype == np.uint8 and made.sheet.shape[2] == 3 and made.sheet.max() > 0
    assert made._repr_png_()[24:26] == b"\x08\x02"
    assert json.loads((tmp_path / "trade.json").read_text()) == made.values


def test_notes_on_a_lut_are_warned_of(scene, tmp_path):
    lut = [0, 0.4, 0.39, 1]
    with pytest.warns(UserWarning, match="taken as noise"):
        rw.Scene({**square_values(), "slm": {"lut": lut}})
    with pytest.warns(UserWarning, match="it lists 4 of 256 levels"):
        scene.set({"slm.lut": lut})
    assert len(scene.notes) == 2
    field = np.ones((8, 8), np.complex64)
    (tmp_path / "slm.toml").write_text("[slm]\nlut = [0, 0.5, 1]\n")
    for slm in ({"lut": [0, 0.5, 1]}, tmp_path / "slm.toml"):
        with pytest.warns(UserWarning, match="it lists 3 of 256 levels") as caught:
            rw.encode(field, slm, pitch=4e-6, wavelength=633e-9)
        assert caught[0].filename == __file__
    with pytest.warns(UserWarning, match="it lists 3 of 256 levels"):
        rw.pattern("lens", (8, 8), 4e-6, 633e-9, {"lut": [0, 0.5, 1]})


def test_a_rate_is_a_goal_as_a_budget_is(scene):
    scene.set({"sampling.pitch": "auto", "slm.rate": 120})
    plan = rw.plan(scene, rate=40)
    assert plan.seconds <= 1.02 / 40 and plan.scene.frames <= 3
    assert rw.render(scene, rate=40).report["goal"]["rate_per_s"] == 40
    with pytest.raises(rw.InputError, match="at most 1"):
        rw.plan(scene, rate=40, psnr=30)
