# SPDX-License-Identifier: Apache-2.0
"""Runs the code of every notebook, cell by cell, in a program of its own. What a notebook claims
stands in it as an assert.
"""

import json
import os
import subprocess
import sys

import pytest
from conftest import ROOT

import raywave

NOTEBOOKS = sorted((ROOT / "python/notebooks").glob("*.ipynb"))

RUN = """
import ast, json, sys
scope = {"__name__": "__main__"}
for number, cell in enumerate(json.load(open(sys.argv[1], encoding="utf-8"))["cells"]):
    if cell["cell_type"] != "code":
        continue
    tree = ast.parse("".join(cell["source"]), f"cell {number}")
    last = tree.body[-1] if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(ast.Module([n for n in tree.body if n is not last], []), f"cell {number}", "exec"),
         scope)
    if last is None:
        continue
    shown = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), scope)
    for display in ("_repr_html_", "_repr_png_"):  # as a notebook does
        if hasattr(shown, display):
            assert getattr(shown, display)()
"""


def test_there_are_notebooks():
    assert len(NOTEBOOKS) == 4


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_notebook(file, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("anywidget")
    where = os.path.dirname(os.path.dirname(os.path.abspath(raywave.__file__)))
    environment = {**os.environ, "MPLBACKEND": "Agg", "MPLCONFIGDIR": str(tmp_path),
                   "PYTHONPATH": where}
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", RUN, str(file)], cwd=file.parent,
                          env=environment, text=True, capture_output=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_notebook_holds_no_outputs(file):
    for cell in json.loads(file.read_text(encoding="utf-8"))["cells"]:
        assert not cell.get("outputs") and cell.get("execution_count") is None
