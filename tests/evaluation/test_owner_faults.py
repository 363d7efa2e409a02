"""What goes wrong with the owner's files, limits and memory is no policy's result."""

from __future__ import annotations

import errno
import os
import resource
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest
from evaluation_doubles import HERE, LineScenario

from pushplan.cli import main
from pushplan.evaluation import Job, JobSettings, Results, parse_policies, run_batch
from pushplan.world import InvalidInputError, MissingDependencyError

SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=60.0, dry_run=False)
KEPT = "what was stored is kept, and the same command goes on"


def batch(out: Path, names: str = "Ahead Logs Raises", **options: Any) -> list[Any]:
    specs = parse_policies([f"{HERE}:{name}" for name in names.split()])
    jobs = [Job(spec, LineScenario(seed)) for spec in specs for seed in range(2)]
    given = {"workers": 1, "settings": SETTINGS, **options}
    return run_batch(jobs, out=out, **given)


def after_first(act: Callable[[], None]) -> Callable[..., None]:
    """A progress that does something once, after the first row."""
    once: list[bool] = []

    def progress(done: int, total: int, row: Any) -> None:
        if row is not None and not once:
            once.append(True)
            act()

    return progress


def check_stops(out: Path, act: Callable[[], None], match: str, **options: Any) -> None:
    """A batch ends with one line and no false row, and goes on with the next call."""
    with pytest.raises(InvalidInputError, match=match) as told:
        batch(out, progress=after_first(act), **options)
    assert "\n" not in str(told.value)


def check_finishes(out: Path) -> None:
    there = {row.status for row in Results.load(out).rows if row.policy != "Raises"}
    assert there <= {"done"}
    rows = batch(out)
    assert [(row.policy, row.status) for row in rows] == [
        *(("Ahead", "done"), ("Ahead", "done"), ("Logs", "done"), ("Logs", "done")),
        *(("Raises", "policy_error"), ("Raises", "policy_error")),
    ]


@pytest.mark.slow
def test_a_folder_for_logs_that_is_gone(tmp_path: Path) -> None:
    check_stops(tmp_path, lambda: shutil.rmtree(tmp_path / "logs"), f"logs.*{KEPT}")
    check_finishes(tmp_path)


FAILURES: dict[str, BaseException] = {
    "file descriptors": OSError(errno.EMFILE, "Too many open files"),
    "processes": BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"),
    "memory": OSError(errno.ENOMEM, "Cannot allocate memory"),
    "memory of Python": MemoryError("none"),
}


@pytest.mark.parametrize("lack", FAILURES)
def test_a_worker_that_cannot_be_started(
    tmp_path: Path, lack: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: Any) -> Any:
        raise FAILURES[lack]

    with monkeypatch.context() as patched:
        patched.setattr("pushplan.evaluation.run.pool.WorkerProcess", fails)
        with pytest.raises(InvalidInputError, match=KEPT):
            batch(tmp_path)
    assert not Results.load(tmp_path).rows


def test_a_thread_that_cannot_be_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def start(self: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", start)
        with pytest.raises(InvalidInputError, match=f"can't start new thread.*{KEPT}"):
            batch(tmp_path)
    assert not Results.load(tmp_path).rows


class Failing(Executor):
    """An executor of somebody else, whose machine is in trouble."""

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def submit(self, *_: Any, **__: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(self.error)
        return future


@pytest.mark.parametrize("lack", FAILURES)
def test_an_executor_that_fails(tmp_path: Path, lack: str) -> None:
    with pytest.raises(InvalidInputError, match=KEPT):
        batch(tmp_path, executor=Failing(FAILURES[lack]))
    assert not Results.load(tmp_path).rows


def test_limits_of_the_shell_that_would_make_policies_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = {resource.RLIMIT_NOFILE: 40}

    def getrlimit(which: int) -> tuple[int, int]:
        most = limits.get(which, resource.RLIM_INFINITY)
        return most, most

    monkeypatch.setattr(resource, "getrlimit", getrlimit)
    with pytest.raises(InvalidInputError, match="need 68 file descriptors and the limit is 40"):
        batch(tmp_path)
    limits = {resource.RLIMIT_AS: 1_000_000_000}
    with pytest.raises(InvalidInputError, match="4000 MB and 'ulimit -v' allows 1000 MB"):
        batch(tmp_path)
    limits = {resource.RLIMIT_DATA: 1_000_000_000}
    with pytest.raises(InvalidInputError, match="4000 MB and 'ulimit -d' allows 1000 MB"):
        batch(tmp_path)
    assert not Results.load(tmp_path).rows


def test_a_library_that_an_environment_lacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def environment(*_: Any, **__: Any) -> Any:
        raise MissingDependencyError("this needs mujoco: pip install 'pushplan[sim]'")

    with monkeypatch.context() as patched:
        patched.setattr(JobSettings, "environment", environment)
        with pytest.raises(InvalidInputError, match="this needs mujoco"):
            batch(tmp_path, workers=0)
    assert not Results.load(tmp_path).rows


@pytest.mark.parametrize(
    "how",
    ["removed", pytest.param("replaced", marks=pytest.mark.slow), "moved with its folder"],
)
def test_results_that_are_taken_away(tmp_path: Path, how: str) -> None:
    out, file = tmp_path / "run", tmp_path / "run" / "results.db"

    def take() -> None:
        if how == "moved with its folder":
            out.rename(tmp_path / "elsewhere")
            return
        file.unlink()
        if how == "replaced":
            file.write_bytes(b"other")

    check_stops(out, take, "results.db was removed or replaced", workers=0)
    whole = tmp_path / ("elsewhere" if how == "moved with its folder" else "another")
    assert len(batch(whole, workers=0)) == 6


def test_a_database_that_goes_after_the_last_row(tmp_path: Path) -> None:
    def progress(done: int, total: int, row: Any) -> None:
        if done == total:
            (tmp_path / "results.db").unlink()

    with pytest.raises(InvalidInputError, match="was removed or replaced"):
        batch(tmp_path, workers=0, progress=progress)


@pytest.mark.parametrize("folder", ["episodes", "failures"])
def test_a_folder_of_ours_that_is_gone(tmp_path: Path, folder: str) -> None:
    check_stops(tmp_path, lambda: shutil.rmtree(tmp_path / folder), KEPT, workers=0)
    rows = batch(tmp_path, workers=0)
    assert [row.status for row in rows] == ["done"] * 4 + ["policy_error"] * 2


def test_the_command_says_one_line_and_ends_with_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda which: (40, 40))
    words = ["bench", "maze-2d-3", "--policies", "random", "--episodes", "1", "--workers", "1"]
    assert main([*words, "--out", str(tmp_path / "run")]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("pushplan: 1 workers need 68 file descriptors")


@pytest.mark.slow
def test_the_command_says_so_under_a_real_limit(tmp_path: Path) -> None:
    code = (
        "import resource, sys\n"
        "from pushplan.cli import main\n"
        "resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    words = ["bench", "maze-2d-3", "--policies", "random", "--episodes", "1", "--workers", "1"]
    done = subprocess.run(
        [sys.executable, "-c", code, *words, "--out", str(tmp_path / "run")],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": ":".join(sys.path)},
    )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("pushplan: 1 workers need 68 file descriptors")
