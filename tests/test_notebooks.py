"""The notebooks run from top to bottom, and carry no outputs in the repository."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, capsys):
    cells = json.loads(path.read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert code and not any(cell["outputs"] for cell in code)
    scope: dict[str, object] = {}
    for cell in code:
        exec(compile("".join(cell["source"]), str(path), "exec"), scope)
    assert capsys.readouterr().out


def test_there_are_notebooks():
    assert NOTEBOOKS
