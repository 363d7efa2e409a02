"""The code blocks of docs/extending.md, run from top to bottom in a folder of their own.

Commands run as a shell runs them: in a process that knows nothing of the blocks before, and
without the folder on the import path.
"""

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
from pushplan.envs import registry
from pushplan.metrics import METRICS
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


def run(line: str) -> str:
    """What a command prints; it must end well."""
    program, *arguments = shlex.split(line)
    start = {"pushplan": ["-P", "-m", "pushplan"], "python": []}[program]
    done = subprocess.run(
        [sys.executable, *start, *arguments],
        env={name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{line}: {done.stderr}"
    return done.stdout


@pytest.mark.release
def test_the_code_blocks_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    tables = [(table, dict(table)) for table in (METRICS, registry.TASKS)]
    modules = set(sys.modules)
    names: dict[str, object] = {}
    said: list[str] = []
    try:
        for language, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
            first, _, rest = text.partition("\n")
            if language == "bash":
                said += map(run, text.splitlines())
            elif language == "toml":
                assert tomllib.loads(text)
            elif first.startswith("# ") and first.endswith(".py"):
                Path(first[2:]).write_text(rest, encoding="utf-8")
            else:
                exec(compile(text, str(PAGE), "exec"), names)
    finally:
        for table, before in tables:
            table.clear()
            table.update(before)
        for name in set(sys.modules) - modules:
            if name.startswith("my_"):
                del sys.modules[name]
    assert (tmp_path / "field.yaml").is_file()
    runs = [text for text in said if re.match(r"\w+ on ", text)]
    assert [text.split()[0] for text in runs] == ["Pursuer", "Circler", "straight"]
    ends = [re.match(r".*: (\w+)", text)[1] for text in runs]
    assert ends == ["success", "no_progress", "success"]
    rows = (tmp_path / "runs" / "mine" / "results.csv").read_text().splitlines()
    assert len(rows) == 3 and all(",done,goal," in row for row in rows[1:])
