"""Disks of clusters that have no file locks: runs work there, and nothing false is said."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
from pathlib import Path

import pytest
from evaluation_doubles import SETTINGS, line_jobs

from pushplan.cli import main
from pushplan.evaluation import Results, merge, run_batch, run_status
from pushplan.files.file_locks import is_locked, take_lock
from pushplan.world import InvalidInputError

JOBS = line_jobs(3, "Ahead")


def without_locks(monkeypatch: pytest.MonkeyPatch, code: int, *names: str) -> None:
    def refuse(*arguments: object) -> None:
        raise OSError(code, os.strerror(code))

    for name in names:
        monkeypatch.setattr(fcntl, name, refuse)


@pytest.mark.parametrize(
    ("code", "names"),
    [
        (errno.ENOLCK, ("flock",)),
        (errno.EOPNOTSUPP, ("flock", "lockf")),
        pytest.param(errno.ENOSYS, ("flock", "lockf"), marks=pytest.mark.slow),
    ],
)
def test_a_batch_runs_with_one_warning_and_goes_on(
    code: int,
    names: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:
    without_locks(monkeypatch, code, *names)
    run_batch(JOBS[:1], out=tmp_path / "run", workers=0, settings=SETTINGS)
    assert [record.message for record in caplog.records] == [
        f"{tmp_path / 'run'} is on a disk without file locks: let only one process write"
    ]
    run_batch(JOBS, out=tmp_path / "run", workers=0, settings=SETTINGS)
    assert len(Results.load(tmp_path / "run").rows) == 3
    assert merge(tmp_path / "all", [tmp_path / "run"]).added == 3
    assert run_status(tmp_path / "run").active is None
    assert main(["runs", "status", str(tmp_path / "run")]) == 0
    assert "no file locks" in capsys.readouterr().out


def test_rows_that_are_only_in_the_log_are_read_without_locks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def keep(done: int, total: int, row: object) -> None:
        if done == 2:  # as a writer that is killed leaves it
            shutil.copytree(tmp_path / "run", tmp_path / "killed")

    run_batch(JOBS, out=tmp_path / "run", workers=0, settings=SETTINGS, progress=keep)
    assert (tmp_path / "killed" / "results.db-wal").stat().st_size
    without_locks(monkeypatch, errno.ENOSYS, "lockf")
    assert len(Results.load(tmp_path / "killed").rows) == 2


@pytest.mark.parametrize("code", [errno.EWOULDBLOCK, errno.EACCES])
def test_a_lock_that_is_held_is_no_missing_lock(
    code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_locks(monkeypatch, code, "flock")
    with pytest.raises(InvalidInputError, match="another process is writing"):
        run_batch(JOBS, out=tmp_path / "run", workers=0, settings=SETTINGS)
    assert is_locked(tmp_path / "run" / ".lock") is True


def test_a_pipe_in_the_place_of_the_lock_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / ".lock")
    assert is_locked(tmp_path / ".lock") is False
    with open(tmp_path / "file", "w") as file:
        assert take_lock(file) is True and is_locked(tmp_path / "file") is True
