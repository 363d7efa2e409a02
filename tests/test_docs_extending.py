"""The code blocks of docs/extending.md, each in a process of its own, beside the page's files."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pushplan import geometry
from pushplan.world import Movables, RobotModel, StaticMap, World

PAGE = Path(__file__).parents[1] / "docs" / "extending.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_tables_of_a_world_name_what_is_there() -> None:
    text = PAGE.read_text(encoding="utf-8").partition("## What a planner sees")[2]
    first, second = text.partition("\n## ")[0].split("|---|---|")[1:]
    known = {"robot": RobotModel, "static": StaticMap, "movables": Movables}
    named = set()
    for row in re.findall(r"^\| (.*?) \| .*? \| (.*) \|$", first, re.MULTILINE):
        names = re.findall(r"`([\w.]+)", row[0])
        named |= set(names)
        kind = known.get(names[0]) if names else None
        for name in re.findall(r"`(\w+)`", row[1]) if kind else ():
            assert name in dir(kind) or name in kind.__dataclass_fields__, name
    fields = set(World.__dataclass_fields__)
    assert fields <= named and named <= fields | set(dir(World)) | {"movables.outline_world"}
    helpers = re.findall(r"^\| (.*?) \|", second, re.MULTILINE)
    assert len(helpers) >= 7
    for name in re.findall(r"`(\w+)", " ".join(helpers)):
        assert name in geometry.__all__


def run(kind: str, text: str) -> str:
    """Return the output of a block in a process of its own; it must end well."""
    program = [sys.executable, "-c", text]
    if kind == "bash":
        arguments = shlex.split(text)
        assert arguments.pop(0) == "pushplan"
        program = [sys.executable, "-P", "-m", "pushplan", *arguments]
    done = subprocess.run(
        program,
        env={name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{text}: {done.stderr}"
    return done.stdout


@pytest.mark.release
def test_each_code_block_runs_on_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = []
    for kind, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        first, _, rest = text.partition("\n")
        if kind == "toml":
            assert tomllib.loads(text)
        elif first.startswith("# ") and first.endswith(".py"):
            Path(first[2:]).write_text(rest, encoding="utf-8")
        else:
            blocks += [(kind, one) for one in (text.splitlines() if kind == "bash" else [text])]
    said = [run(kind, text) for kind, text in blocks]
    ends = [re.match(r"([\w-]+) on .*: (\w+)", text) for text in said]
    assert [end.groups() for end in ends if end] == [
        ("Pursuer", "success"),
        ("Circler", "no_progress"),
        ("straight", "success"),
        ("push-aware", "success"),
    ]
    rows = (tmp_path / "runs" / "mine" / "results.csv").read_text().splitlines()
    assert len(rows) == 3 and all(",done,goal," in row for row in rows[1:])
    assert len((tmp_path / "runs" / "field" / "results.csv").read_text().splitlines()) == 5
