# SPDX-License-Identifier: Apache-2.0
"""Runs what examples/cluster/ shows, and Open Job Description, beside one process."""

import os
import pathlib
import subprocess
import sys

import pytest
from conftest import ROOT

SCENE = """
[hologram]
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
[animation]
frames = 6
[[animation.track]]
of = "object.0.rotation"
at = [0, 6]
values = [[0, 0, 0], [0, 0, 90]]
"""
SQUARE = "v -1 -1 0\nv -1 1 0\nv 1 1 0\nv 1 -1 0\nf 1 2 3 4\n"
KEYS = ["--set", "slm.encoding=double-phase"]
EACH = "1ms"  # a picture for each unit


@pytest.fixture(scope="module")
def run(program, tmp_path_factory):
    """Runs words in one folder, where `raywave` is on PATH, and tells that they made the film."""
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "scene.toml").write_text(SCENE)
    (folder / "square.obj").write_text(SQUARE)
    path = str(pathlib.Path(program).resolve().parent) + ":" + os.environ["PATH"]

    def call(words, makes="", **environment):
        made = subprocess.run(words, cwd=folder, text=True, capture_output=True,
                              env={**os.environ, "PATH": path, **environment})
        assert made.returncode == 0, made.stdout + made.stderr
        if makes:
            one, other = ({p.name: p.read_bytes() for p in (folder / name).iterdir()
                           if p.suffix not in (".mkv", ".mp4")} for name in ("alone", makes))
            assert len(one) == 6 + 2 and one == other
        return made.stdout

    call(["raywave", "animate", "scene.toml", *KEYS, "-o", "alone", "--no-video", "--no-preview",
          "--quiet"])
    return call


def test_two_workers_of_hyperqueue_make_the_film_of_one_process(run):
    pytest.importorskip("hyperqueue")
    run([sys.executable, str(ROOT / "examples/cluster/hyperqueue_local.py"), "--each", EACH,
         "scene.toml", "made_by_hq", *KEYS], "made_by_hq")


@pytest.mark.parametrize("names", [("RANK", "SIZE"),
                                   ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT"),
                                   ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE")])
def test_ranks_and_tasks_of_arrays_make_each_part_once(run, names, tmp_path):
    units = run(["raywave", "units", "scene.toml", "--each", EACH, *KEYS])
    parts = [line.split()[0] for line in units.splitlines()]
    assert parts == [f"{i}..{i}" for i in range(6)]
    (tmp_path / "units.txt").write_text(units)
    says = tmp_path / "raywave"  # in the place of the program: only what it was asked for
    says.write_text('#!/bin/sh\necho "$*"\n')
    says.chmod(0o755)
    made = []
    for rank in ("1", "2"):  # as arrays count; modulo 2, as MPI does
        asked = run([str(ROOT / "examples/cluster/parts.sh"), str(tmp_path / "units.txt"),
                     "raywave", "animate", "SCENE", "--pictures"],
                    PATH=f"{tmp_path}:{os.environ['PATH']}", **dict(zip(names, (rank, "2"))))
        made += asked.splitlines()
    assert sorted(made) == sorted(f"animate SCENE --pictures {p}" for p in parts)


def test_a_job_of_open_job_description_makes_the_film_of_one_process(run):
    pytest.importorskip("openjd.cli")
    run(["raywave", "units", "scene.toml", "--each", EACH, *KEYS, "--openjd", "job.json"])
    openjd = [sys.executable, "-m", "openjd"]
    run([*openjd, "check", "job.json"])
    run([*openjd, "run", "job.json", "-p", "Output=made_by_openjd"], "made_by_openjd")
