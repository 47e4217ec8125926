#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs raywave into an empty prefix, and uses it from there as others do: examples/ through
find_package and pkg-config in an empty folder, the C interface through Octave where that is there.

usage: tests/scripts/install.py BUILD CMAKE NM
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD, CMAKE, NM = (pathlib.Path(word) for word in sys.argv[1:4])
# Of nothing in the build tree
ENVIRONMENT = {k: v for k, v in os.environ.items() if k not in ("RAYWAVE_READER_DIR", "PYTHONPATH")}

SCENE = """[hologram]
resolution = [48, 32]
pitch = "4 um"
[sampling]
pitch = "20 um"
[[light]]
direction = [0, 0, 1]
[[object]]
mesh = "square.obj"
width = "0.2 mm"
position = [0, 0, "10 mm"]
"""
SQUARE = "v -0.5 -0.5 0\nv -0.5 0.5 0\nv 0.5 0.5 0\nv 0.5 -0.5 0\nf 1 2 3\nf 1 3 4\n"


def run(*words, cwd=None, **more):
    done = subprocess.run(
        [str(word) for word in words], cwd=cwd, env={**ENVIRONMENT, **more}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, words))}: {done.returncode}\n{done.stdout}")
    return done.stdout


def pgm(file):
    """Columns, rows and grey levels of what the examples write."""
    header, _, levels = pathlib.Path(file).read_bytes().partition(b"\n")
    kind, width, height, most = header.split()
    assert (kind, most) == (b"P5", b"255"), header
    return int(width), int(height), levels


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="raywave-install-")
        top = pathlib.Path(cls.folder.name)
        cls.prefix, cls.empty = top / "prefix", top / "empty"
        cls.empty.mkdir()
        run(CMAKE, "--install", BUILD, "--prefix", cls.prefix)
        (cls.empty / "scene.toml").write_text(SCENE)
        (cls.empty / "square.obj").write_text(SQUARE)
        run(CMAKE, "-S", ROOT / "examples", "-B", cls.empty / "build",
            f"-DCMAKE_PREFIX_PATH={cls.prefix}", "-DCMAKE_BUILD_TYPE=Release",
            "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror", "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror")
        run(CMAKE, "--build", cls.empty / "build")
        cls.library = next((cls.prefix / "lib").rglob("libraywave.so"))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_turntable_writes_a_picture_of_each_pose(self):
        run(self.empty / "build/turntable", "scene.toml", 3, cwd=self.empty)
        pictures = [pgm(self.empty / f"pose_0{i}.pgm") for i in range(3)]
        self.assertTrue(all(p[:2] == (48, 32) and len(p[2]) == 48 * 32 for p in pictures))
        self.assertNotEqual(pictures[0][2], pictures[1][2])

    def test_c_renders_what_cpp_renders(self):
        run(self.empty / "build/turntable", "scene.toml", 1, cwd=self.empty)
        run(self.empty / "build/render_from_c", "scene.toml", "c.pgm", cwd=self.empty)
        self.assertEqual(pgm(self.empty / "c.pgm"), pgm(self.empty / "pose_00.pgm"))

    def test_a_mesh_of_the_callers_is_seen_as_a_lens_sees_it(self):
        out = run(self.empty / "build/own_mesh", cwd=self.empty)
        self.assertGreater(float(out.split("within ")[1].split()[0]), 15, out)

    def test_errors_of_the_examples_are_one_line(self):
        done = subprocess.run([self.empty / "build/turntable", "none.toml"], text=True,
                              stderr=subprocess.PIPE)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"\Aturntable: none\.toml: there is no such file\n\Z")

    def test_the_prefix_holds_what_the_docs_say(self):
        self.assertEqual({p.name for p in self.prefix.iterdir()},
                         {"bin", "include", "lib", "libexec", "share"})

    def test_the_program_finds_its_readers_in_the_prefix(self):
        run(self.prefix / "bin/raywave", "render", "scene.toml", "-o", "out", "--quiet",
            cwd=self.empty)
        self.assertTrue((self.empty / "out/hologram.png").exists())

    def test_pkg_config_knows_the_library(self):
        folder = next((self.prefix / "lib").rglob("raywave.pc")).parent
        flags = run("pkg-config", "--cflags", "--libs", "raywave", PKG_CONFIG_PATH=str(folder))
        run("g++", "-std=c++20", ROOT / "examples/turntable.cpp", "-o", "turntable",
            *flags.split(), cwd=self.empty)
        run(self.empty / "turntable", "scene.toml", 1, cwd=self.empty)
        version = run("pkg-config", "--modversion", "raywave", PKG_CONFIG_PATH=str(folder)).strip()
        header = (self.prefix / "include/raywave/version.h").read_text()
        self.assertIn(f'"{version}"', header)

    def test_another_version_is_not_taken(self):
        (self.empty / "newer").mkdir()
        (self.empty / "newer/CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.22)\nproject(newer LANGUAGES CXX)\n"
            "find_package(raywave 99 REQUIRED)\n")
        with self.assertRaisesRegex(AssertionError, "99"):
            run(CMAKE, "-S", self.empty / "newer", "-B", self.empty / "newer/build",
                f"-DCMAKE_PREFIX_PATH={self.prefix}")

    def test_the_library_shows_its_own_names_alone(self):
        names = run(NM, "-DC", "--defined-only", self.library).splitlines()
        strong = [line.split(" ", 2)[2] for line in names if line.split(" ", 2)[1] in "TDBR"]
        self.assertGreater(len(strong), 50)
        for name in strong:
            self.assertRegex(name, r"^(typeinfo (name )?for |vtable for )?raywave(::|_)")

    def test_headers_need_nothing_but_the_standard_library(self):
        for header in (self.prefix / "include/raywave").iterdir():
            for line in header.read_text().splitlines():
                if line.startswith("#include"):
                    self.assertRegex(line, r"<(raywave/\w+\.hp?p?|\w+|std\w+\.h)>", header.name)

    def test_octave_renders_through_the_c_interface(self):
        if not shutil.which("mkoctfile") or not shutil.which("octave-cli"):
            print("skipped: Octave: no octave-dev")
            return
        run(self.empty / "build/turntable", "scene.toml", 1, cwd=self.empty)
        run("mkoctfile", "--mex", f"-I{self.prefix}/include", f"-L{self.library.parent}",
            "-lraywave", f"-Wl,-rpath,{self.library.parent}",
            ROOT / "examples/matlab/raywave_render.c", cwd=self.empty)
        run("octave-cli", "--no-gui", "--eval",
            "levels = raywave_render('scene.toml');"
            "assert(class(levels), 'uint8'); assert(size(levels), [32 48]);"
            "file = fopen('octave.raw', 'w'); fwrite(file, levels', 'uint8'); fclose(file);"
            "moved = raywave_render('scene.toml', 'sampling.frames=2', 0, [0 0 0.01], [0 30 0]);"
            "assert(size(moved), [32 48 2]); assert(any(any(moved(:,:,1) != levels)));"
            "try; raywave_render('none.toml'); error('taken'); catch e;"
            "assert(any(strfind(e.message, 'none.toml'))); end",
            cwd=self.empty)
        self.assertEqual((self.empty / "octave.raw").read_bytes(),
                         pgm(self.empty / "pose_00.pgm")[2])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
