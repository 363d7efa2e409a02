"""What a policy does to others, to its process and to the files: the batch goes on."""

from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evaluation_doubles import HERE as DOUBLES
from evaluation_doubles import Ahead, LineScenario
from fault_doubles import HERE, NOTE

from pushplan.evaluation import Job, JobSettings, ResultRow, parse_policies, run_batch
from pushplan.metrics import lengths
from pushplan.world import GoalDisc, World

SETTINGS = JobSettings(make_env=f"{DOUBLES}:make_env", timeout_s=5.0, grace_s=0.5, dry_run=False)


def run(
    out: Path, names: str, *, workers: int = 1, timeout_s: float = 5.0, **options: object
) -> dict[str, ResultRow]:
    files = {"Ahead": DOUBLES, "Raises": DOUBLES}
    specs = parse_policies([f"{files.get(name, HERE)}:{name}" for name in names.split()])
    jobs = [Job(spec, LineScenario(0)) for spec in specs]
    settings = replace(SETTINGS, timeout_s=timeout_s)
    rows = run_batch(jobs, out=out, workers=workers, settings=settings, **options)  # type: ignore[arg-type]
    assert len(rows) == len(jobs)
    return {row.policy: row for row in rows}


@pytest.mark.slow
def test_texts_that_cannot_be_written_down_become_rows(tmp_path: Path) -> None:
    names = "Surrogate Unspeakable BadLog Ahead"
    for workers in (0, 1):
        rows = run(tmp_path / str(workers), names, workers=workers)
        assert "ValueError: no" in rows["Surrogate"].reason
        assert rows["Ahead"].status == "done"
        assert all(rows[name].status == "policy_error" for name in names.split()[:3])


@pytest.mark.slow
def test_limits_that_a_policy_sets_hold_nobody_else_up(tmp_path: Path) -> None:
    rows = run(tmp_path, "NoTemporaryFolder NoFiles Ahead")
    assert {row.status for row in rows.values()} == {"done"}
    assert len(list((tmp_path / "episodes").iterdir())) == 3


@pytest.mark.slow
def test_memory_that_is_gone_for_good_is_a_row(tmp_path: Path) -> None:
    # filling so much takes about a second, and far longer where others compute
    rows = run(tmp_path, "OutOfMemoryForGood Ahead", memory_limit_mb=1500.0, timeout_s=60.0)
    assert rows["OutOfMemoryForGood"].status == "out_of_memory"
    assert rows["Ahead"].status == "done"


@pytest.mark.slow
def test_shared_memory_counts(tmp_path: Path) -> None:
    rows = run(tmp_path, "SharesMuch Ahead", memory_limit_mb=600.0)
    assert rows["SharesMuch"].status == "out_of_memory" and "600 MB" in rows["SharesMuch"].reason
    assert rows["Ahead"].status == "done"


@pytest.mark.parametrize("name", ["Chatters", "ClaimsMuch", "SendsCode"])
@pytest.mark.slow
def test_what_no_worker_says_is_a_failed_row(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(NOTE, str(tmp_path / "ran"))
    rows = run(tmp_path / "run", f"{name} Ahead")
    assert rows[name].status == "crashed" and "message" in rows[name].reason
    assert rows["Ahead"].status == "done"
    assert not (tmp_path / "ran").exists()


@pytest.mark.slow
def test_one_policy_does_not_change_the_next_ones_results(tmp_path: Path) -> None:
    alone = run(tmp_path / "alone", "Ahead")["Ahead"]
    after = run(tmp_path / "after", "Patches Ahead")["Ahead"]
    assert (after.metrics, after.reason) == (alone.metrics, alone.reason)


@pytest.mark.parametrize("workers", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_scores_are_of_the_owners_world(tmp_path: Path, workers: int) -> None:
    rows = run(tmp_path, "Ahead Reweighs MovesTheGoal", workers=workers)
    for name in ("Reweighs", "MovesTheGoal"):
        assert rows[name].metrics == rows["Ahead"].metrics
        assert (rows[name].success, rows[name].reason) == (rows["Ahead"].success, "goal")


def test_arrays_of_a_world_that_a_policy_is_shown_are_read_only(tmp_path: Path) -> None:
    seen: list[bool] = []

    class Looks(Ahead):
        def act(self, world: World, observation: object) -> object:
            goal = world.navigation_goal
            assert isinstance(goal, GoalDisc)
            arrays = (world.robot_pose, world.movables.poses, world.movables.masses, goal.center)
            seen.extend(array.flags.writeable for array in arrays)
            assert world.static is self.world.static  # what was made of it may be kept
            return super().act(world, observation)

    job = Job(parse_policies([Looks])[0], LineScenario(0))
    (row,) = run_batch([job], out=tmp_path, workers=0, settings=SETTINGS)
    assert row.status == "done" and seen and not any(seen)


HERE_TOO = "RaisesBase Recurses BadProperties HugeTimes NanTimes RaisesAtReset Counts CountsForEver"
STATUSES = {
    **dict.fromkeys(HERE_TOO.split(), "policy_error"),
    "Interrupts": "policy_error",
    **dict.fromkeys("HugeNumbers LeavesFolder LeavesThread RaisesAtTheEnd".split(), "done"),
    **dict.fromkeys("ClosesAll ExitsQuietly".split(), "crashed"),
    "Deaf": "timeout",
    "Ahead": "done",
}


@pytest.mark.slow
def test_every_kind_of_fault_becomes_a_row_with_a_reason(tmp_path: Path) -> None:
    rows = run(tmp_path / "pool", " ".join(STATUSES), workers=2, timeout_s=8.0)
    assert {name: row.status for name, row in rows.items()} == STATUSES
    assert all(row.reason for row in rows.values())
    assert not any(row.success for row in rows.values() if row.failed)


@pytest.mark.parametrize("name", HERE_TOO.split())
def test_a_fault_in_the_process_of_the_batch_is_a_row_too(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lengths, "steps", lengths.steps)  # which two of them patch
    row = run(tmp_path, name, workers=0, timeout_s=60.0)[name]
    assert row.status == STATUSES[name] and row.reason


@pytest.mark.slow
def test_a_policy_that_changes_the_working_folder_changes_it_for_nobody_else(
    tmp_path: Path,
) -> None:
    before = os.getcwd()
    for workers in (0, 1):
        spec = parse_policies(f"{HERE}:LeavesFolder")[0]
        jobs = [Job(spec, LineScenario(seed)) for seed in range(2)]
        out = tmp_path / str(workers)
        rows = run_batch(jobs, out=out, workers=workers, settings=SETTINGS)
        assert [row.status for row in rows] == ["done", "done"] and os.getcwd() == before


@pytest.mark.slow
def test_files_of_memory_count(tmp_path: Path) -> None:
    rows = run(tmp_path, "HoldsFiles Ahead", memory_limit_mb=600.0, timeout_s=60.0)
    assert rows["HoldsFiles"].status == "out_of_memory"
    assert rows["Ahead"].status == "done"


@pytest.mark.parametrize("name", ["ForksOn", "ForksOnAndDies"])
@pytest.mark.slow
def test_processes_that_start_each_other_end_with_the_batch(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(NOTE, str(tmp_path / "children"))
    run(tmp_path / "run", name)
    pids = [int(pid) for pid in (tmp_path / "children").read_text().split()]
    assert pids and all(map(_gone, pids))


def test_a_score_outside_its_range_is_refused(tmp_path: Path) -> None:
    row = run(tmp_path, "Boasts")["Boasts"]
    assert row.status == "policy_error" and "E_nav" in row.reason and row.E_nav == 0.0


def _gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.mark.parametrize("name", ["HasChildren", "DiesWithChildren"])
@pytest.mark.slow
def test_children_of_a_policy_end_with_its_worker(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(NOTE, str(tmp_path / "children"))
    run(tmp_path / "run", name)
    same_group, apart = map(int, (tmp_path / "children").read_text().split())
    deadline = time.monotonic() + 60.0
    while not _gone(same_group) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert _gone(same_group)
    assert _gone(apart)


@pytest.mark.slow
def test_logs_and_notes_are_bounded(tmp_path: Path) -> None:
    row = run(tmp_path, "Floods")["Floods"]
    assert row.status == "policy_error" and len(row.reason) <= 300
    sizes = [path.stat().st_size for path in tmp_path.rglob("*") if path.is_file()]
    assert sum(sizes) < 2_000_000
    (note,) = (tmp_path / "failures").iterdir()
    assert "raise ValueError" in note.read_text()


@pytest.mark.slow
def test_a_worker_that_was_killed_from_outside_gets_another_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(NOTE, str(tmp_path / "killed"))
    assert run(tmp_path / "run", "KilledOnce")["KilledOnce"].status == "done"


def test_addresses_are_not_in_stored_episodes(tmp_path: Path) -> None:
    run(tmp_path, "Raises", workers=0)
    with np.load(next((tmp_path / "episodes").iterdir())) as data:
        header = json.loads(str(data["header"]))
    assert "0x..." in header["reason"]
