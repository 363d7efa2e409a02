"""The notebooks run from top to bottom, carry no outputs, and are what the documentation shows."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
ALONE = "planner_in_a_control_loop"
"""Checks itself that no simulator is loaded, which needs a process of its own."""


@pytest.fixture(scope="module")
def render() -> ModuleType:
    spec = importlib.util.spec_from_file_location("render", ROOT / "notebooks" / "render.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


def test_there_are_notebooks(render):
    assert {path.stem for path in NOTEBOOKS} == set(render.ORDER)


@pytest.mark.release
@pytest.mark.parametrize(
    "path", [path for path in NOTEBOOKS if path.stem != ALONE], ids=lambda path: path.stem
)
def test_a_notebook_runs(path, render):
    outputs = [output for _, _, output in render.run_notebook(path) if output is not None]
    assert any(output.text for output in outputs)
    pictures = [picture for output in outputs for picture in output.pictures]
    assert pictures and all(len(picture) < 150_000 for picture in pictures)


@pytest.mark.release
def test_the_control_loop_runs_without_a_simulator():
    command = [sys.executable, str(ROOT / "notebooks" / "render.py"), ALONE, "--check"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path):
    code = [c for c in json.loads(path.read_text("utf-8"))["cells"] if c["cell_type"] == "code"]
    assert code and not any(cell["outputs"] or cell["execution_count"] for cell in code)


def test_the_pages_show_what_the_notebooks_say(render):
    for path in NOTEBOOKS:
        page = render.page_of(path).read_text("utf-8")
        for kind, source in render.cells_of(path):
            seen = render.shown(kind, source) in page
            assert seen == (kind != "hidden"), f"python notebooks/render.py {path.stem}"
    assert (ROOT / "docs" / "notebooks.md").read_text("utf-8") == render.overview()
    pages = {path.name for path in (ROOT / "docs").glob("notebook-*.md")}
    assert pages == {render.page_of(path).name for path in NOTEBOOKS}


def test_the_pages_have_their_pictures(render):
    pages = "".join(render.page_of(path).read_text("utf-8") for path in NOTEBOOKS)
    named = set(re.findall(r"images/(notebook-[\w-]+\.png)", pages))
    there = {path.name for path in (ROOT / "docs" / "images").glob("notebook-*.png")}
    assert named == there
    assert sum((ROOT / "docs" / "images" / name).stat().st_size for name in named) < 1_500_000


def test_a_cell_gives_what_jupyter_shows(render):
    scope: dict[str, object] = {}
    assert render.run_cell("x = 3\nprint('a')\nx + 1", scope) == render.Output("a\n4\n")
    assert render.run_cell("x = 5", scope) == render.Output("")
    assert render.run_cell("x;", scope) == render.Output("")
    picture = render.run_cell("from PIL import Image\nImage.new('RGB', (4, 4))", scope)
    assert picture.text == "" and len(picture.pictures) == 1
    figure = render.run_cell("from matplotlib import pyplot as plt\nplt.plot([1, 2]);", scope)
    assert figure.text == "" and len(figure.pictures) == 1
