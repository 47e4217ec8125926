#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of scripts/measure in a small tree whose program is a shell script."""
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True
LOADER = importlib.machinery.SourceFileLoader("measure", str(ROOT / "scripts/measure"))
measure = importlib.util.module_from_spec(importlib.util.spec_from_loader("measure", LOADER))
LOADER.exec_module(measure)

RECIPES = '''
TABLES = {
    "errors": {"page": "accuracy", "sources": ["host/trace"],
               "runs": {n: f"raywave quality data/{n}.toml" for n in ("a", "b")},
               "rows": lambda r: [[n, r[n]["psnr_db"]] for n in r],
               "form": "| scene | dB |\\n|---|---|\\n| {} | {:.1f} |"},
    "times": {"page": "accuracy", "sources": ["host"], "timed": True,
              "runs": {"all": "raywave bench"},
              "rows": lambda r: [["frame", 1e3 * r["all"]["s"]]],
              "form": "| | ms |\\n|---|---|\\n| {} | {:.0f} |"},
}
'''
PAGE = """# Accuracy

<!--measured:errors-->
<!--end-->

Between.

<!--measured:times-->
<!--end-->
"""
PROGRAM = """#!/bin/sh
pwd >>"$(dirname "$0")/folders"
case "$*" in
  "devices --json") echo '[{"default": false}, {"default": true, "name": "gpu-x", "platform": "P",
    "driver": "1", "compute_units": 2}]' ;;
  "quality data/a.toml --json") echo >left; echo '{"psnr_db": 31.25}' ;;
  "quality data/b.toml --json") cat data/b.toml ;;
  "bench --json") echo '{"s": 0.025}' ;;
  *) echo "unknown: $*" >&2; exit 2 ;;
esac
"""


class Measure(unittest.TestCase):
    def setUp(self):
        self.root = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        for file, text in {"docs/accuracy.md": PAGE, "scripts/measurements.py": RECIPES,
                           "host/trace/trace.cpp": "\n", "host/plan/plan.cpp": "\n",
                           "data/a.toml": "\n", "data/b.toml": '{"psnr_db": 40}\n',
                           "build/raywave": PROGRAM, ".gitignore": "build\n"}.items():
            self.write(file, text)
            os.utime(self.root / file, (1e9, 1e9))
        (self.root / "build/raywave").chmod(0o755)

    def write(self, file, text):
        (self.root / file).parent.mkdir(parents=True, exist_ok=True)
        (self.root / file).write_text(text)

    def read(self, file="docs/accuracy.md"):
        return (self.root / file).read_text()

    def measured(self):
        return json.loads(self.read("docs/measured/accuracy.json"))

    def call(self, *words, code=0):
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                ended = measure.main(["--root", str(self.root), *words])
            except SystemExit as error:  # of the command line
                ended = error.code
        self.assertEqual(ended, code, said.getvalue())
        return said.getvalue()

    def commit(self, change=""):
        if change:
            self.write(change, "// changed\n")
            os.utime(self.root / change, (1e9, 1e9))
        for words in (["init", "-q"], ["add", "-A"],
                      ["-c", "user.name=t", "-c", "user.email=t@t", "commit", "-qm", "all: now"]):
            subprocess.run(["git", "-C", self.root, *words], check=True, capture_output=True)

    def test_tables_are_filled_with_date_commit_device_and_the_share_of_others(self):
        self.call()
        page, entries = self.read(), self.measured()
        self.assertIn("<!--measured:errors-->\n| scene | dB |\n|---|---|\n| a | 31.2 |\n"
                      "| b | 40.0 |\n\n*", page)
        self.assertIn("| frame | 25 |\n", page)
        caption = r"\*\d+ \w+ 20\d\d, unknown, \[commands\]\(measured/accuracy.json\), gpu-x"
        self.assertRegex(page, caption + r"\*\n<!--end-->\n\nBetween")
        self.assertRegex(page, caption + r", others \d+ %\*\n<!--end-->\n$")
        self.assertEqual(entries["errors"]["rows"], [["a", 31.25], ["b", 40]])
        self.assertEqual(entries["times"]["commands"], ["raywave bench"])
        self.assertEqual(entries["times"]["platform"], "P 1")
        self.call("--check")

    def test_a_second_run_changes_nothing_else(self):
        self.call()
        page = self.read()
        self.call("errors", "accuracy", "times")
        without_others = [text.split(", others")[0] for text in (page, self.read())]
        self.assertEqual(*without_others)

    def test_commands_run_in_a_folder_that_goes(self):
        self.call("errors")
        folders = set(self.read("build/folders").split())
        self.assertEqual(len(folders), 1)
        self.assertFalse(Path(*folders).exists())
        self.assertFalse((self.root / "left").exists())

    def test_only_what_is_named_is_measured(self):
        self.call("times")
        self.assertEqual(list(self.measured()), ["times"])
        self.assertIn("<!--measured:errors-->\n<!--end-->", self.read())
        self.assertIn("errors is not measured", self.call("--check", code=1))
        self.assertIn("room: no page", self.call("room", code=2))

    def test_what_fails_stays_as_it_was_and_the_others_are_measured(self):
        self.call()
        page = self.read()
        for damage in ("no JSON", '{"psnr_db": NaN}', '{"psnr": 1}', '{"psnr_db": null}', "[]"):
            self.write("data/b.toml", damage)
            os.utime(self.root / "data/b.toml", (1e9, 1e9))
            self.assertIn("errors stays as it was", self.call("errors", code=1))
            self.assertEqual(self.read(), page, damage)
        known = self.measured()
        self.write("scripts/measurements.py", RECIPES.replace("{:.0f}", "{:.0f} {}"))
        self.assertIn("times stays as it was", self.call("times", code=1))
        self.assertEqual(self.measured(), known)
        self.write("scripts/measurements.py", RECIPES.replace("/{n}", "/{n}{n}"))
        (self.root / "docs/measured/accuracy.json").unlink()
        self.assertIn("unknown: quality data/aa.toml --json", self.call(code=1))
        self.assertEqual(list(self.measured()), ["times"])

    def test_a_program_that_is_missing_or_older_than_its_sources_measures_nothing(self):
        os.utime(self.root / "host/plan/plan.cpp")
        self.assertIn("raywave is older than host/plan/plan.cpp", self.call(code=1))
        (self.root / "build/raywave").unlink()
        self.assertIn("build/raywave is missing", self.call(code=1))
        self.assertEqual(self.read(), PAGE)

    def test_a_table_that_is_changed_by_hand_fails_and_is_filled_again(self):
        self.call()
        page = self.read()
        self.write("docs/accuracy.md", page.replace("31.2", "41.2"))
        self.assertIn("errors is not what docs/measured/accuracy.json says",
                      self.call("--check", code=1))
        self.call("--fill")
        self.assertEqual(self.read(), page)

    def test_a_new_form_is_filled_without_measuring(self):
        self.call()
        (self.root / "build/raywave").unlink()
        self.write("scripts/measurements.py", RECIPES.replace("{:.1f}", "{:.2f}"))
        self.call("--check", code=1)
        self.call("--fill")
        self.assertIn("| a | 31.25 |", self.read())
        self.call("--check")

    def test_markers_recipes_and_sources_that_lack_each_other_fail(self):
        self.call()
        page = self.read()
        for wrong, message in ((page.replace("<!--end-->\n", "", 1), "are no pairs"),
                               (page.replace("<!--measured:times-->", ""), "are no pairs"),
                               (page.replace("measured:times", "measured:time"), "has no time for"),
                               (page + page, "has no errors for")):
            self.write("docs/accuracy.md", wrong)
            self.assertIn(message, self.call("--check", code=1))
        self.write("docs/accuracy.md", page.split("Between")[0])
        self.assertIn("docs/accuracy.md has no <!--measured:times-->", self.call("--check"))
        (self.root / "docs/accuracy.md").unlink()
        self.write("docs/other.md", page)
        self.assertIn("docs/other.md: scripts/measurements.py has no errors",
                      self.call("--check", code=1))
        (self.root / "docs/other.md").unlink()
        self.write("docs/accuracy.md", page)
        shutil.rmtree(self.root / "host/trace")
        self.assertIn("errors: there is no host/trace", self.call("--check", code=1))

    def test_other_commands_make_a_table_old(self):
        self.call()
        self.write("scripts/measurements.py", RECIPES.replace("wave bench", "wave bench --quick"))
        said = self.call("--check")
        self.assertIn("accuracy.md: times is old: its commands have changed since", said)
        self.assertNotIn("errors is old", said)

    def test_without_history_ages_are_unknown_and_nothing_fails(self):
        self.call()
        self.assertIn("ages are unknown", self.call("--check"))

    @unittest.skipUnless(shutil.which("git"), "no git")
    def test_tables_older_than_their_sources_are_named_and_do_not_fail(self):
        self.commit()
        self.call()
        self.commit()
        said = self.call("--check")
        self.assertNotIn("old", said)
        self.assertNotIn("unknown", said)
        self.commit("host/plan/plan.cpp")
        said = self.call("--check")
        self.assertRegex(said, "docs/accuracy.md: times is old: measured at .*, before .* all: now")
        self.assertNotIn("errors is old", said)
        self.call("times")
        self.assertNotIn("old", self.call("--check"))
        self.commit("data/a.toml")
        self.assertIn("errors is old", self.call("--check"))

    @unittest.skipUnless(shutil.which("git"), "no git")
    def test_a_changed_tree_is_said(self):
        self.commit()
        self.write("host/plan/plan.cpp", "int changed;\n")
        os.utime(self.root / "host/plan/plan.cpp", (1e9, 1e9))
        self.call("times")
        self.assertRegex(self.read(), r"20\d\d, [0-9a-f]{7,}-dirty, .*, gpu-x, others")
        self.assertIn("times is old: measured in a changed tree", self.call("--check", code=1))


if __name__ == "__main__":
    unittest.main()
