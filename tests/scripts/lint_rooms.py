#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of scripts/lint_rooms: each rule is broken once in a small tree, and once in a copy of the real one."""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))

TREE = {
    "docs/architecture.md": (
        "# Rooms\n\n```rooms\ncommon:\nscene: common   # reads files\nplan: scene common kernels/common\n"
        "render: plan cl\ncl:\nkernels/common:\nkernels/gather: kernels/common\n```\n\nPlan: no list here.\n"
    ),
    "host/common/error.hpp": "#pragma once\n",
    "host/common/raywave_version.hpp.in": "#pragma once\n",
    "host/scene/scene.hpp": '#include "host/common/error.hpp"\n#include "raywave_version.hpp"\n',
    "host/scene/scene.cpp": '#include "host/scene/scene.hpp"\n',
    "host/plan/plan.hpp": '#include "host/scene/scene.hpp"\n#include "kernels/common/shared.h"\n',
    "host/render.cpp": '#include <vector>\n#include "cl/device.hpp"\n#include "host/plan/plan.hpp"\n',
    "cl/device.hpp": "#pragma once\n",
    "kernels/common/shared.h": "#pragma once\n",
    "kernels/gather/gather.cl": '#include "kernels/common/shared.h"\n',
}


class LintRooms(unittest.TestCase):
    def setUp(self):
        self.root = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.root)

    def lay(self, changes=()):
        for path, text in {**TREE, **dict(changes)}.items():
            os.makedirs(os.path.dirname(os.path.join(self.root, path)), exist_ok=True)
            with open(os.path.join(self.root, path), "w", encoding="utf-8") as stream:
                stream.write(text)

    def lint(self, *arguments):
        done = subprocess.run(
            [sys.executable, os.path.join(ROOT, "scripts/lint_rooms"), "--root", self.root, *arguments],
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout, done.stderr

    def fails(self, message, changes):
        self.lay(changes)
        code, _, errors = self.lint()
        self.assertEqual(code, 1)
        self.assertIn(message, errors)
        self.assertNotIn("Traceback", errors)

    def test_listed_arrows_pass(self):
        self.lay()
        code, output, errors = self.lint()
        self.assertEqual((code, errors), (0, ""))
        self.assertIn("all listed", output)

    def test_an_arrow_that_is_not_listed_fails_with_its_line(self):
        self.fails(
            "host/common/error.hpp:2: common may not include plan",
            {"host/common/error.hpp": '#pragma once\n#  include "host/plan/plan.hpp"\n'},
        )

    def test_an_include_in_a_comment_is_none(self):
        self.lay({"host/common/error.hpp": '// #include "host/plan/plan.hpp"\n'})
        self.assertEqual(self.lint()[0], 0)

    def test_an_arrow_between_kernel_rooms_fails_with_its_line(self):
        self.fails(
            "kernels/common/shared.h:1: kernels/common may not include kernels/gather",
            {"kernels/common/shared.h": '#include "kernels/gather/gather.cl"\n'},
        )

    def test_a_source_and_its_header_are_one_node_of_a_cycle(self):
        self.fails(
            "include cycle: host/plan/lattice -> host/plan/plan -> host/plan/lattice",
            {
                "host/plan/plan.cpp": '#include "host/plan/plan.hpp"\n#include "host/plan/lattice.hpp"\n',
                "host/plan/lattice.hpp": '#include "host/plan/plan.hpp"\n',
            },
        )

    def test_a_room_without_a_line_fails(self):
        self.fails("no line for the room trace", {"host/trace/trace.cpp": "\n"})

    def test_a_line_for_a_room_that_is_gone_fails(self):
        text = TREE["docs/architecture.md"].replace("render:", "attic: plan\nrender:")
        self.fails("there is no room attic", {"docs/architecture.md": text})

    def test_a_list_with_a_cycle_fails(self):
        text = TREE["docs/architecture.md"].replace("common:\n", "common: plan\n", 1)
        self.fails("the list has a cycle: common -> plan -> common", {"docs/architecture.md": text})

    def test_a_missing_list_fails(self):
        self.fails("no block that starts with ```rooms", {"docs/architecture.md": "# Rooms\n"})

    def test_an_include_of_no_file_fails(self):
        self.fails('"host/plan/gone.hpp" is no file', {"host/render.cpp": '#include "host/plan/gone.hpp"\n'})

    def test_explain_names_the_lines_of_an_arrow(self):
        self.lay()
        code, output, _ = self.lint("--explain", "plan", "scene")
        self.assertEqual(code, 0)
        self.assertIn("host/plan/plan.hpp:1: host/scene/scene.hpp", output)

    def test_a_new_arrow_in_the_tree_of_today_fails(self):
        for top in ("host", "cl", "kernels"):
            shutil.copytree(os.path.join(ROOT, top), os.path.join(self.root, top))
        os.makedirs(os.path.join(self.root, "docs"))
        shutil.copy(os.path.join(ROOT, "docs/architecture.md"), os.path.join(self.root, "docs"))
        with open(os.path.join(self.root, "host/common/text.hpp"), "a", encoding="utf-8") as stream:
            stream.write('#include "host/cli/commands.hpp"\n')
        code, _, errors = self.lint()
        self.assertEqual(code, 1)
        self.assertIn("common may not include cli", errors)


if __name__ == "__main__":
    unittest.main()
