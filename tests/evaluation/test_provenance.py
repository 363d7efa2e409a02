"""Where rows come from is noted for each call that ran jobs, and stands on the page."""

from __future__ import annotations

import platform
import sqlite3
from importlib import metadata
from pathlib import Path

import pytest

import pushplan
from pushplan.evaluation import Results, bench
from pushplan.evaluation.store.provenance import _checkout, in_words

pytestmark = pytest.mark.usefixtures("empty_figures")


def test_each_call_that_ran_jobs_is_noted(tmp_path: Path) -> None:
    for episodes in (1, 1, 2):
        bench("maze-2d-3", "straight", episodes=episodes, workers=0, out=tmp_path)
    results = Results.load(tmp_path)
    runs = results.about["runs"]
    assert len(runs) == 2  # the second call had nothing to run
    for run in runs:
        assert run["pushplan"] == pushplan.__version__ and run["workers"] == 0
        assert run["python"] == platform.python_version()
        assert run["packages"]["numpy"] == metadata.version("numpy")
        assert run["began"].endswith("Z")
    page = results.report().read_text()
    assert page.count(in_words(runs[0])[:19]) >= 1


def test_rows_do_not_depend_on_it(tmp_path: Path) -> None:
    first, second = (
        bench("maze-2d-3", "straight", episodes=1, workers=0, out=tmp_path / name) for name in "ab"
    )
    assert first.rows[0].E_nav == second.rows[0].E_nav
    with sqlite3.connect(tmp_path / "a" / "results.db") as db:
        db.execute("DELETE FROM about WHERE key = 'runs'")  # as a version before wrote it
    assert "<summary>Runs" not in Results.load(tmp_path / "a").report().read_text()


def test_code_that_is_no_checkout_has_no_commit(tmp_path: Path) -> None:
    assert _checkout(tmp_path) == (None, None)
    (tmp_path / ".git").mkdir()
    assert _checkout(tmp_path) == (None, None)
