#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of scripts/lint_includes in small trees."""

import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))


def complaints(files):
    """Exit status and lines of the script in a tree of these files."""
    with tempfile.TemporaryDirectory() as root:
        for path, text in files.items():
            os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
            with open(os.path.join(root, path), "w", encoding="utf-8") as stream:
                stream.write(text)
        done = subprocess.run(
            [os.path.join(ROOT, "scripts/lint_includes"), "--root", root],
            capture_output=True, text=True, check=False)
        return done.returncode, done.stdout.splitlines()


class LintIncludes(unittest.TestCase):
    def test_a_missing_header_is_reported_with_its_line(self):
        status, lines = complaints({"host/a.cpp": "#include <string>\n\nstd::vector<int> v;\n"})
        self.assertEqual((status, lines), (1, ["host/a.cpp:3: std::vector needs #include <vector>"]))

    def test_headers_count_through_files_of_ours(self):
        status, _ = complaints({
            "host/a.hpp": "#include <vector>\n",
            "tests/b.cpp": '#include "host/a.hpp"\nstd::vector<int> v;\n',
        })
        self.assertEqual(status, 0)

    def test_a_header_stands_alone_though_its_users_include_more(self):
        status, lines = complaints({
            "host/a.hpp": "inline std::string a();\n",
            "host/a.cpp": '#include <string>\n#include "host/a.hpp"\n',
        })
        self.assertEqual((status, len(lines)), (1, 1))

    def test_comments_and_texts_are_no_uses(self):
        status, _ = complaints({"cl/a.cpp": '// std::vector\nconst char* a = "std::map";\n'})
        self.assertEqual(status, 0)


if __name__ == "__main__":
    sys.exit(unittest.main())
