"""The code blocks of docs/extending.md, run from top to bottom in a folder of their own."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.envs import registry
from pushplan.metrics import METRICS

PAGE = Path(__file__).parents[1] / "docs" / "extending.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.slow
def test_the_code_blocks_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    tables = [(table, dict(table)) for table in (METRICS, registry.TASKS)]
    modules = set(sys.modules)
    names: dict[str, object] = {}
    try:
        for language, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
            first, _, rest = text.partition("\n")
            if language == "bash":
                for line in text.splitlines():
                    assert main(shlex.split(line)[1:]) == 0, line
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
