"""The size gate, `python -m benchmarks.structure --check`: limits only fall."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from benchmarks import structure

Repository = Callable[[dict[str, int], dict[str, int]], None]


@pytest.fixture
def commit_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Repository:
    """Commit limits and later rises to a repository with a package of ten lines."""
    limits = tmp_path / "limits.yaml"
    monkeypatch.setattr(structure, "ROOT", tmp_path)
    monkeypatch.setattr(structure, "LIMITS", limits)
    monkeypatch.delenv("GIT_DIR", raising=False)
    (tmp_path / "pushplan").mkdir()
    (tmp_path / "core/tests").mkdir(parents=True)
    (tmp_path / "pushplan/plan.py").write_text("a = 1\n" * 6)
    (tmp_path / "core/plan.cpp").write_text("int a;\n" * 4)
    (tmp_path / "core/tests/plan_test.cpp").write_text("int a;\n" * 90)

    def git(*arguments: str) -> None:
        who = ("-c", "user.name=x", "-c", "user.email=x@y")
        subprocess.run(["git", *who, *arguments], cwd=tmp_path, check=True, capture_output=True)

    def commit(most: dict[str, int], later: dict[str, int]) -> None:
        limits.write_text(yaml.safe_dump({"mechanisms": {}, "most": most, "later rises": later}))
        git("add", "-A")
        git("commit", "-m", "limits")

    git("init")
    return commit


def test_all_languages_count_and_tests_do_not(commit_limits: Repository) -> None:
    commit_limits({structure.TOTAL: 10}, {})
    assert structure.package_lines(structure.ROOT) == 10
    assert structure.breaches({structure.TOTAL: "10"}) == []
    assert structure.breaches({structure.TOTAL: "11"}) == [f"{structure.TOTAL}: 11, at most 10"]


def test_a_new_file_counts_before_it_is_committed(commit_limits: Repository) -> None:
    commit_limits({structure.TOTAL: 10}, {})
    (structure.ROOT / "pushplan/table.toml").write_text("a = 1\n")
    assert structure.package_lines(structure.ROOT) == 11


@pytest.mark.parametrize(
    ("before", "after", "passes"),
    [
        (({"x": 2}, {}), ({"x": 1}, {}), True),
        (({"x": 2}, {}), ({"x": 3}, {}), False),
        (({"x": 2}, {}), ({}, {}), False),
        (({}, {"speed": 5}), ({structure.TOTAL: 15}, {}), True),
        (({}, {"speed": 5}), ({structure.TOTAL: 16}, {}), False),
        (({}, {}), ({structure.TOTAL: 11}, {}), False),
        (({}, {}), ({}, {"speed": 5}), False),
    ],
)
def test_limits_only_fall(
    commit_limits: Repository,
    before: tuple[dict[str, int], dict[str, int]],
    after: tuple[dict[str, int], dict[str, int]],
    passes: bool,
) -> None:
    """A later rise moves into the limit of the total once; nothing else raises a limit."""
    for most, later in (before, after):
        commit_limits({structure.TOTAL: 10} | most, later)
    (structure.ROOT / "CHANGELOG.md").write_text("## 1\n- Size: there is a good reason for it.\n")
    assert (structure.raised_limits() == []) == passes


def test_a_limit_that_was_raised_commits_ago_is_found(commit_limits: Repository) -> None:
    for limit in (10, 12, 11):
        commit_limits({structure.TOTAL: limit}, {})
    assert structure.raised_limits() == [
        "the limit of the total with its later rises: 11, it was 10"
    ]
