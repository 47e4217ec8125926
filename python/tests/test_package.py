# SPDX-License-Identifier: Apache-2.0
"""The package as it is typed, packed and installed."""

import locale
import os
import pathlib
import subprocess
import sys

import pytest
from conftest import DATA, ROOT

import raywave as rw

PACKAGE = pathlib.Path(rw.__file__).parent


def test_types_are_complete_for_mypy(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "user.py").write_text(
        "import numpy as np\nimport raywave as rw\n"
        "scene = rw.load_scene('teapot.toml', {'sampling.frames': 2})\n"
        "holo: rw.Hologram = rw.render(scene, preset='draft')\n"
        "field = holo.field\nassert field is not None\n"
        "image = rw.reconstruct(field, z=0.1)\n"
        "reveal_type(image.dtype)\n"
        "rw.propagate(field, 8e-6, 638e-9, 0.1, (0, 0))\n"
        "rw.refine(scene).levels\n"
        "rw.Renderer(scene).render(out=np.empty((2, 2), np.uint8))\n"
    )
    for what in (["-p", "raywave"], [tmp_path / "user.py"]):
        done = subprocess.run(
            [sys.executable, "-m", "mypy", "--config-file", ROOT / "pyproject.toml", "--strict",
             "--cache-dir", tmp_path / "cache", *what],
            cwd=PACKAGE.parent, env={**os.environ, "MYPYPATH": str(PACKAGE.parent)},
            text=True, capture_output=True)
        assert done.returncode == 0, done.stdout + done.stderr
    assert "float32" in done.stdout or "_32Bit" in done.stdout


GERMAN = """
import locale, sys
if sys.argv[1] == "before": locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
import raywave as rw
from conftest import square_values
if sys.argv[1] == "after": locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
assert locale.str(1.5) == ("1.5" if sys.argv[1] == "never" else "1,5")
scene = rw.Scene(square_values(pitch="4.5 um"))
holo = rw.render(scene, "draft")
print(scene, scene.values, rw.plan(scene, "draft").text, holo.report["scene"], holo.report["plan"])
print(holo, holo.notes, hash(holo.field.tobytes()), hash(holo.levels.tobytes()))
try: scene.set({"hologram.pitch": "1234.5 km"})
except rw.InputError as error: print(error)
"""


def test_a_german_locale_changes_nothing():
    try:
        before = locale.setlocale(locale.LC_ALL)
        locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
        locale.setlocale(locale.LC_ALL, before)
    except locale.Error:
        pytest.skip("this system has no locale de_DE.UTF-8 (localedef makes it)")
    where = os.pathsep.join([str(ROOT / "python" / "tests"), str(PACKAGE.parent)])
    texts = {
        subprocess.run(
            [sys.executable, "-c", GERMAN, when], check=True, capture_output=True,
            env={**os.environ, "PYTHONPATH": where, "PYTHONHASHSEED": "0"},
        ).stdout
        for when in ("never", "before", "after")
    }  # fmt: skip
    assert len(texts) == 1 and b"4.5 um" in texts.pop()


def test_all_names_have_a_text():
    for name in rw.__all__:
        if name not in ("torch", "jax", "__version__"):
            assert getattr(rw, name).__doc__, name
    with pytest.raises(AttributeError):
        rw.no_such_name


def test_dir_names_what_is_for_users_alone():
    assert set(rw.__all__) <= set(dir(rw))
    assert all(name in rw.__all__ or name.startswith("__") for name in dir(rw))
    assert all(hasattr(rw, name) for name in dir(rw) if name not in ("torch", "jax"))


def test_the_version_is_that_of_the_program(program):
    said = subprocess.run([program, "--version"], text=True, capture_output=True).stdout
    assert rw.__version__ in said
    assert f"raywave VERSION {rw.__version__} " in (ROOT / "CMakeLists.txt").read_text()
    assert f"\nversion: {rw.__version__}\n" in (ROOT / "CITATION.cff").read_text()


def test_a_wheel_installs_into_an_empty_environment_and_runs(tmp_path):
    build = os.environ.get("RAYWAVE_BUILD")
    if not build:
        pytest.skip("RAYWAVE_BUILD does not name the build folder")
    pytest.importorskip("scikit_build_core")
    plain = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "RAYWAVE_READER_DIR")}

    def run(*words, **more):
        done = subprocess.run(words, env=plain, text=True, capture_output=True, **more)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    run(sys.executable, "-m", "pip", "wheel", "-q", "--disable-pip-version-check", "--no-deps",
        "--no-build-isolation", "-C", f"cmake.define.RAYWAVE_PREBUILT={build}",
        "-C", f"build-dir={tmp_path / 'cmake'}", "-w", tmp_path, ROOT)
    (wheel,) = tmp_path.glob("raywave-*.whl")
    run(sys.executable, "-m", "venv", "--without-pip", tmp_path / "empty")
    python = tmp_path / "empty/bin/python"
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", python]
    run(*pip, "install", "-q", "--no-compile", wheel)
    # The README's lines
    shown = run(
        python, "-c",
        "import raywave as rw\n"
        f"assert rw.__file__.startswith({str(tmp_path)!r})\n"
        f"scene = rw.load_scene({str(DATA / 'teapot.toml')!r}, "
        "{'hologram.resolution': [160, 120], 'sampling.pitch': '250 um', 'sampling.frames': 2})\n"
        "print(rw.plan(scene))\n"
        "holo = rw.render(scene)\n"
        "image = rw.reconstruct(holo, z=0.1)\n"
        "print(rw.compare(rw.lens(scene, z=0.1, points=2), image, blur=4))\n"
        "print(rw.quality(holo, views=False, lens_points=2))\n"
        "assert holo.for_slm().shape == (2, 120, 160)\n"
        "holo.save('hologram.png')\n",
        cwd=tmp_path)
    assert "hologram  160 x 120 pixels" in shown and "psnr_db" in shown and "PSNR, dB" in shown
    assert (tmp_path / "hologram.png").stat().st_size > 1000
    files = run(*pip, "show", "-f", "raywave")
    for name in ("py.typed", "_core.pyi", "_widget.js", "raywave_mesh_reader", "LICENSE-WHEEL.md"):
        assert name in files, files
