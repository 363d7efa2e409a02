"""The commands of docs/paper.md lead from a study to tables and figures, and LaTeX takes them."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from pushplan.evaluation import Results

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "paper.md").read_text("utf-8")
(BLOCK,) = re.findall(r"^```bash\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
COPY, *COMMANDS, COMPILE = BLOCK.splitlines()
LATEX = ROOT / "examples" / "latex"


def run(command: str, folder: Path) -> str:
    """The output of a command, which must end well."""
    done = subprocess.run(
        [sys.executable, "-m", *shlex.split(command)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_there_are_five_commands() -> None:
    assert COPY == "cp -r examples/latex paper && cd paper"
    assert len(COMMANDS) == 3 and all(line.startswith("pushplan ") for line in COMMANDS)
    assert COMPILE == "pdflatex paper.tex"


@pytest.mark.slow
def test_a_small_study_becomes_tables_and_figures(tmp_path: Path) -> None:
    paper = tmp_path / "paper"
    shutil.copytree(LATEX, paper)
    study = yaml.safe_load((LATEX / "study.yaml").read_text("utf-8"))
    study |= {"suites": ["maze-2d-5"], "episodes": 2}
    (paper / "study.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
    for command in COMMANDS:
        line, _, file = command.partition(" > ")
        printed = run(line, paper)
        if file:
            (paper / file).write_text(printed, encoding="utf-8")
    assert len(Results.load(paper / "run").rows) == 2 * len(study["policies"])
    source = (paper / "paper.tex").read_text("utf-8")
    named = re.findall(r"\\(?:includegraphics(?:\[.*?\])?|input){(.*?)}", source)
    assert len(named) == 3 and all((paper / name).stat().st_size > 0 for name in named)
    tables = (paper / "tables.tex").read_text("utf-8")
    assert tables.count(r"\begin{table}") == 2 and "push-aware" in tables
    if shutil.which("pdflatex"):
        options = ["-interaction=nonstopmode", "-halt-on-error"]
        program, *arguments = COMPILE.split()
        command = [program, *options, *arguments]
        done = subprocess.run(command, cwd=paper, capture_output=True, check=False, timeout=300)
        log = (paper / "paper.log").read_text(errors="replace")
        assert done.returncode == 0, log[-2000:]
        assert "Overfull \\hbox" not in log
