"""Run directories that are torn, flipped, locked or full: one clear line, and nothing is lost."""

from __future__ import annotations

import json
import shutil
import sqlite3
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evaluation_doubles import SETTINGS, LineScenario, line_jobs, stored_run

from pushplan.cli import main
from pushplan.evaluation import DamagedResultsError, Results, run_batch, salvage
from pushplan.world import InvalidInputError, PushplanError

JOBS = line_jobs(3)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return stored_run(tmp_path / "run", 3)


def flip(file: Path, bits: int, rng: np.random.Generator) -> None:
    data = bytearray(file.read_bytes())
    for position in rng.integers(0, len(data), bits):
        data[position] ^= 1 << rng.integers(8)
    file.write_bytes(data)


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[: len(data) // 2],
        lambda data: b"",
        lambda data: b"no database at all, but some text" * 100,
        lambda data: data[:4096] + bytes(4096) + data[8192:],
    ],
    ids=["torn", "empty", "text", "page"],
)
def test_a_damaged_database_is_one_line_and_results_are_saved(
    run: Path, damage: object, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    before = Results.load(run).rows
    file = run / "results.db"
    file.write_bytes(damage(file.read_bytes()))  # type: ignore[operator]
    with pytest.raises(PushplanError) as caught:
        Results.load(run)
    assert len(str(caught.value)) < 301
    assert main(["report", str(run)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    done = salvage(run, tmp_path / "saved")
    assert done.rows == 6 and not done.without_episode
    assert Results.load(tmp_path / "saved").rows == before
    again = run_batch(JOBS, out=tmp_path / "saved", workers=0, settings=SETTINGS)
    assert tuple(again) == before  # nothing had to be run again


def test_wrong_values_are_one_line(run: Path) -> None:
    for change in ("E_nav = 7.0", "status = 'fine'", "reason = x'ff'", "began = 'today'"):
        with sqlite3.connect(run / "results.db") as db:
            db.execute(f"UPDATE results SET {change} WHERE seed = 1")
        with pytest.raises(DamagedResultsError, match="pushplan runs salvage"):
            Results.load(run)
    done = salvage(run, run.parent / "saved")
    assert done.from_csv == 2 and done.rows == 6


COMMANDS = ("status RUN", "verify RUN --workers 1", "compare RUN RUN", "export RUN rows.csv")


@pytest.mark.parametrize(
    "note",
    [{"began": text} for text in ("yesterday", "2026-02-30T10:00:00.000Z", "2026-02-03", "", None)]
    + [{"began": "2026-02-03T10:00:00.000"}, {"jobs": "many"}, {"done": None}],
    ids=str,
)
def test_odd_notes_on_a_call_are_one_line(
    run: Path, note: dict[str, object], capsys: pytest.CaptureFixture[str]
) -> None:
    with sqlite3.connect(run / "results.db") as db:
        ((runs,),) = db.execute("SELECT value FROM about WHERE key = 'runs'")
        changed = [{**json.loads(runs)[0], **note}]
        db.execute("UPDATE about SET value = ? WHERE key = 'runs'", (json.dumps(changed),))
    for command in COMMANDS:
        words = [str(run) if word == "RUN" else word for word in command.split()]
        assert main(["runs", *words]) == 2
        said = capsys.readouterr().err
        assert "is damaged" in said and "runs salvage" in said and said.count("\n") == 1
    saved = run.parent / "saved"
    assert main(["runs", "salvage", str(run), str(saved)]) == 0
    assert main(["runs", "status", str(saved)]) == 0


@pytest.mark.parametrize("date", ["2026-99-99T10:00:00.000Z", "9999-01-01T00:00:00.000Z", "0001"])
def test_odd_dates_of_rows_are_one_line_or_no_matter(
    run: Path, date: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with sqlite3.connect(run / "results.db") as db:
        db.execute("UPDATE results SET began = ? WHERE seed = 1", (date,))
    for command in COMMANDS[:1], COMMANDS[2:3]:
        words = [str(run) if word == "RUN" else word for word in command[0].split()]
        code = main(["runs", *words])
        assert (code, capsys.readouterr().err.count("\n")) in ((0, 0), (2, 1))


@pytest.mark.slow
def test_flipped_bits_never_end_in_a_traceback(run: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    file = run / "results.db"
    good = file.read_bytes()
    outcomes = []
    for trial in range(100):
        file.write_bytes(good)
        flip(file, int(rng.integers(1, 20)), rng)
        for attempt in (Results.load, lambda path: run_batch(
            JOBS, out=path, workers=0, settings=replace(SETTINGS, timeout_s=4.0)
        )):  # fmt: skip
            try:
                attempt(run)
            except InvalidInputError as error:
                outcomes.append(error)
            for rest in ("results.db-wal", "results.db-shm"):
                (run / rest).unlink(missing_ok=True)
        assert salvage(run, tmp_path / f"saved{trial}").rows >= len(JOBS)
    assert outcomes


def test_an_episode_that_does_not_fit_its_name_is_not_saved(run: Path) -> None:
    row = Results.load(run).rows[0]
    assert row.trace_file is not None
    flip(run / row.trace_file, 3, np.random.default_rng(0))
    assert salvage(run, run.parent / "saved").without_episode == (row.job,)
    with pytest.raises(InvalidInputError, match="holds a run already"):
        salvage(run, run.parent / "saved")
    with pytest.raises(InvalidInputError, match="neither"):
        salvage(run.parent / "nothing", run.parent / "new")


def test_a_locked_database_is_waited_for_and_then_one_line(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pushplan.evaluation.store.database.WAIT_S", 0.1)
    with sqlite3.connect(run / "results.db", isolation_level=None) as db:
        db.execute("BEGIN IMMEDIATE")
        with pytest.raises(InvalidInputError, match="database is locked"):
            run_batch(JOBS, out=run, workers=0, settings=SETTINGS)
        assert len(Results.load(run).rows) == 6  # readers do not wait
    assert len(run_batch(JOBS, out=run, workers=0, settings=SETTINGS)) == 6


def _mounted(folder: Path, options: str) -> bool:
    folder.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    return subprocess.run(words, capture_output=True).returncode == 0


@pytest.mark.slow
def test_a_full_disk_loses_nothing_and_a_restart_finishes(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    if not _mounted(disk, "size=600k"):
        pytest.skip("no right to mount a small file system")
    try:
        jobs = [replace(job, scenario=LineScenario(seed)) for job in JOBS[:2] for seed in range(60)]
        with pytest.raises(InvalidInputError, match="what was stored is kept"):
            run_batch(jobs, out=disk / "run", workers=0, settings=SETTINGS)
        subprocess.run(["mount", "-o", "remount,size=40m", str(disk)], check=True)
        stored = len(Results.load(disk / "run").rows)
        assert 0 < stored < 120
        ran = []
        rows = run_batch(
            jobs, out=disk / "run", workers=0, settings=SETTINGS, progress=lambda *a: ran.append(a)
        )
        assert len(rows) == 120 and len(ran) == 120 - stored + 1
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        assert len(Results.load(disk / "run").rows) == 120
        with pytest.raises(InvalidInputError, match="Read-only"):
            run_batch(jobs, out=disk / "run", workers=0, settings=SETTINGS)
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_a_folder_that_goes_away_is_one_line(tmp_path: Path) -> None:
    def remove(done: int, total: int, row: object) -> None:
        if done == 2:
            shutil.rmtree(tmp_path / "run")

    with pytest.raises(InvalidInputError, match="was removed or replaced"):
        run_batch(JOBS, out=tmp_path / "run", workers=0, settings=SETTINGS, progress=remove)
