#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of scripts/attack: it sees each way in which a small program falls short, and nothing in
the program given as the argument, where one is given."""
import contextlib
import importlib.machinery
import importlib.util
import io
import math
import os
import random
import shutil
import struct
import sys
import tempfile
import types
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True
LOADER = importlib.machinery.SourceFileLoader("attack", str(ROOT / "scripts/attack"))
attack = importlib.util.module_from_spec(importlib.util.spec_from_loader("attack", LOADER))
LOADER.exec_module(attack)

PROGRAM = sys.argv.pop(1) if len(sys.argv) > 1 else ""
DARK = attack.npy_of("(9, 16)", bytes(8 * 9 * 16))
LIT = attack.npy_of("(9, 16)", struct.pack("<f", 0.5) * 2 * 9 * 16)
NEW = attack.npy_of("(9, 16)", struct.pack("<f", 0.25) * 2 * 9 * 16)
PICTURE = attack.png_of(16, 9, b"".join(b"\0" + bytes(range(y, y + 16)) for y in range(9)))
REFUSAL = "echo 'raywave: scene.toml:3: unknown key' >&2; exit 2"


class Attack(unittest.TestCase):
    def setUp(self):
        self.root = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)

    def faults(self, script, files=(), words=("render", "scene.toml", "-o", "out"), **more):
        """What the attack says of a program that is this shell script."""
        program = self.root / "program"
        program.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
        program.chmod(0o755)
        runner = attack.Runner(types.SimpleNamespace(
            program=program, output=self.root / "attack", memory=0, limit=3, keep=False))
        case = attack.Case("", list(words), dict(files), part="models", **more)
        _, faults, _ = runner.run(case)
        self.assertEqual((runner.folder_of(case) / "repeat").exists(), bool(faults))
        return {kind for kind, _ in faults}

    def made(self, field, picture, script="", **more):
        files = {"new/field.npy": field, "new/hologram.png": picture}
        return self.faults("cp -r new out;" + script, files, **more)

    def test_a_whole_result_and_a_refusal_in_one_line_are_none(self):
        self.assertEqual(self.made(LIT, PICTURE), set())
        self.assertEqual(self.faults(REFUSAL), set())

    def test_a_signal_and_other_exit_codes_are_crashes(self):
        self.assertEqual(self.faults("kill -SEGV $$"), {"crash"})
        for code in (1, 4, 70, 134):
            self.assertEqual(self.faults(f"echo 'raywave: no' >&2; exit {code}"), {"crash"})

    def test_a_run_beyond_the_limit_is_a_hang_unless_plan_expects_it(self):
        self.assertEqual(self.faults("exec sleep 9"), {"hang"})
        plan = '{"prediction": {"seconds": {"total": 99}, "device_bytes": 1}}'
        self.assertEqual(self.faults(f"[ $1 = plan ] && echo '{plan}' || exec sleep 9"), set())

    def test_a_dark_hologram_needs_a_note(self):
        self.assertEqual(self.made(DARK, PICTURE), {"blank"})
        self.assertEqual(self.made(DARK, PICTURE, "echo 'raywave: dark' >&2"), set())

    def test_no_number_is_seen_in_fields_reports_and_on_standard_output(self):
        for value in (math.nan, math.inf):
            self.assertEqual(self.made(LIT[:-4] + struct.pack("<f", value), PICTURE), {"nan"})
        self.assertEqual(self.made(LIT, PICTURE, "echo '{\"x\": NaN}' >out/report.json"), {"nan"})
        self.assertEqual(self.made(LIT, PICTURE, "echo PSNR nan"), {"nan"})

    def test_cut_and_missing_files_are_damage(self):
        self.assertEqual(self.made(LIT[:-1], PICTURE), {"damage"})
        self.assertEqual(self.made(LIT, PICTURE[:-5]), {"damage"})
        self.assertEqual(self.made(LIT, PICTURE, "echo '{' >out/report.json"), {"damage"})
        self.assertEqual(self.faults("true"), {"damage"})

    def test_another_field_than_expected_is_damage(self):
        self.assertEqual(self.made(LIT, PICTURE, expect={"field.npy": LIT}), set())
        self.assertEqual(self.made(LIT, PICTURE, expect={"field.npy": NEW}), {"damage"})

    def test_files_of_a_refusal_and_lost_or_temporary_files_are_damage(self):
        self.assertEqual(self.made(LIT, PICTURE, REFUSAL), {"damage"})
        old = {"out/field.npy": LIT}
        self.assertEqual(self.faults("rm out/field.npy;" + REFUSAL, old), {"damage"})
        self.assertEqual(self.faults("echo >out/field.7-0.tmp.npy;" + REFUSAL, old), {"damage"})

    def test_after_a_kill_files_are_as_before_or_as_they_should_become(self):
        def killed(script, how=attack.signal.SIGKILL):
            files = {"out/field.npy": LIT, "out/report.json": b"{}", "new/field.npy": NEW,
                     "other/field.npy": DARK}
            return self.faults(script + "; exec sleep 9", files, kill=(how, .8),
                               expect={"field.npy": NEW})
        self.assertEqual(killed("true"), set())
        left = "cp new/field.npy out; echo >out/report.7-0.tmp.json"
        self.assertEqual(killed(left), set())
        self.assertEqual(killed(left, attack.signal.SIGTERM), {"damage"})
        for script in ("cp other/field.npy out", "rm out/field.npy", ": >out/field.npy",
                       "echo '[]' >out/report.json"):
            self.assertEqual(killed(script), {"damage"}, script)

    def test_what_a_killed_run_leaves_goes_with_the_next(self):
        script = "[ -e out ] || { mkdir out; echo >out/field.7-0.tmp.npy; exec sleep 9; }; "
        more = {"kill": (attack.signal.SIGKILL, .3), "follow": True}
        new = {"new/field.npy": LIT}
        self.assertEqual(self.faults(script + "rm out/*; cp new/field.npy out", new, **more), set())
        self.assertEqual(self.faults(script + "cp new/field.npy out", new, **more), {"damage"})
        self.assertEqual(self.faults(script + REFUSAL, **more), {"damage"})

    def test_a_refusal_must_say_what_is_wrong_in_the_program_s_own_lines(self):
        for said in ("true", "echo oops >&2", "echo 'raywave: no'", "echo 'raywave: ' >&2",
                     "printf 'raywave: a b c d\\nb\\n' >&2",
                     "printf 'raywave: a \\033[31m b\\n' >&2",
                     "echo 'raywave: terminate: std::bad_alloc what' >&2"):
            self.assertEqual(self.faults(said + "; exit 2"), {"message"}, said)

    def test_output_that_is_lost_without_a_word_is_damage(self):
        lost = {"words": ("plan", "scene.toml", "--json"), "redirect": ">/dev/full"}
        self.assertEqual(self.faults("true", **lost), {"damage"})
        self.assertEqual(self.faults(REFUSAL, **lost), {"message"})

    def test_a_process_that_stays_is_seen(self):
        self.assertEqual(self.made(LIT, PICTURE, "sleep 9 &"), {"orphan"})

    def test_inputs_depend_on_the_seed_alone(self):
        scenes = attack.Scenes(None)
        for number in range(20):
            first, again = (scenes.case(random.Random(f"1/{number}"), number) for _ in range(2))
            self.assertEqual((first.files, first.what), (again.files, again.what))

    def test_keys_and_ranges_come_from_the_documentation(self):
        keys = attack.documented_keys()
        self.assertEqual(set(keys), {"hologram", "colour", "slm", "illumination",
                                     "wrp", "sampling", "trace", "accuracy",
                                     "viewer", "refine", "light", "materials.x", "object",
                                     "animation", "animation.camera", "animation.track",
                                     "scene"})
        self.assertIn("1e-10", keys["hologram"]["pitch"])
        self.assertIn("16", keys["trace"]["depth"])

    def test_every_finding_is_printed_with_its_seed_and_ends_with_1(self):
        program = self.root / "program"
        program.write_text("#!/bin/sh\necho 'raywave: no' >&2\nexit 70\n", encoding="utf-8")
        program.chmod(0o755)
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = attack.main(["scenes", "--count", "2", "--seed", "5", "--program", str(program),
                                "--output", str(self.root / "attack")])
        self.assertEqual(code, 1)
        self.assertIn("scripts/attack scenes --seed 5 --only 1: ", out.getvalue())

    @unittest.skipUnless(PROGRAM, "no program was given")
    def test_each_part_finds_nothing_in_the_program(self):
        for name in ("RAYWAVE_CACHE_DIR", "POCL_CACHE_DIR"):
            os.environ.setdefault(name, str(Path(PROGRAM).parent / "attack" / "cache" / name))
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = attack.main(["--count", "2", "--program", PROGRAM, "--output",
                                str(self.root / "attack")])
        self.assertEqual(code, 0, out.getvalue())


if __name__ == "__main__":
    unittest.main()
