"""The compiled core: its sources, its types, and what a tree without it says."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from pushplan import core
from pushplan.cli import main
from pushplan.evaluation.store.provenance import versions

ROOT = Path(__file__).parents[1]


def test_it_is_built_from_the_sources_beside_the_package() -> None:
    assert not core.is_stale(), "run pip install -e . again"


def test_changed_sources_are_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "core/src").mkdir(parents=True)
    (tmp_path / "core/src/other.cpp").write_text("int other;")
    monkeypatch.setattr(core, "__file__", str(tmp_path / "pushplan/core.py"))
    assert core.is_stale()
    assert main(["doctor"]) == 1
    assert "core: core/ has changed since" in capsys.readouterr().out
    (tmp_path / "core/src/other.cpp").unlink()
    assert not core.is_stale()  # an installed package has no sources beside it


@pytest.mark.parametrize("name", ["CMakeLists.txt", "core/CMakeLists.txt"])
def test_options_of_the_compiler_are_among_its_sources(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(ROOT / "core", tmp_path / "core")
    shutil.copy(ROOT / "CMakeLists.txt", tmp_path)
    monkeypatch.setattr(core, "__file__", str(tmp_path / "pushplan/core.py"))
    assert not core.is_stale()
    with (tmp_path / name).open("a") as file:
        file.write("add_compile_options(-O1)\n")
    assert core.is_stale()


def test_options_that_the_user_of_cmake_chooses_are_named() -> None:
    assert re.fullmatch(r"\S+ [\d.]+, OSQP [\d.]+, [^,]*-[^,]*, [^,]*-[^,]*", core.COMPILER)


def test_a_tree_without_it_says_so_in_one_line() -> None:
    code = "import sys\nsys.modules['pushplan._core'] = None\n"
    code += "from pushplan.cli import main\nsys.exit(main(['gtsp', 'any.json']))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "run pip install -e . in it" in done.stderr


def test_results_name_its_sources_and_compiler() -> None:
    assert versions("pymunk")["core"] == f"{core.SOURCES} {core.COMPILER}"


@pytest.mark.parametrize(
    "wrong",
    [
        np.zeros((3, 3), np.float32),
        np.zeros(3),
        np.zeros((3, 3)).T[::2],
        [[0.0] * 3] * 3,
        None,
        "costs",
    ],
)
def test_arrays_of_another_type_or_layout_are_refused(wrong: object) -> None:
    """They are neither copied nor converted, and never read as what they are not."""
    costs = np.zeros((3, 3))
    offsets = np.array([0, 1, 3])
    needed = np.ones(3, np.int64)
    core.gtsp.mark_needed(costs, costs, offsets, needed)
    with pytest.raises(TypeError, match="incompatible function arguments"):
        core.gtsp.mark_needed(wrong, costs, offsets, needed)  # type: ignore[arg-type]


def test_type_checkers_see_every_name_of_the_module() -> None:
    rooms = {name for name, room in vars(core._core).items() if isinstance(room, ModuleType)}
    assert {"geometry", "planners"} <= rooms
    for room in rooms:
        stub = ast.parse((ROOT / f"pushplan/_core/{room}.pyi").read_text("utf-8"))
        lines = (line.target if isinstance(line, ast.AnnAssign) else line for line in stub.body)
        described = {getattr(line, "name", getattr(line, "id", None)) for line in lines}
        assert {name for name in dir(getattr(core, room)) if name[0] != "_"} <= described
