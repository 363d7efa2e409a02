from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from evaluation_doubles import HERE, Ahead, LineScenario

from pushplan.evaluation import (
    TIMING_COLUMNS,
    Job,
    JobSettings,
    ResultRow,
    Results,
    columns,
    parse_policies,
    run_batch,
)
from pushplan.evaluation.run.job_identity import versions
from pushplan.world import Episode, InvalidInputError

SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=3.0, grace_s=0.5)


def jobs_of(names: str, seeds: range = range(2)) -> list[Job]:
    specs = parse_policies([f"{HERE}:{name}" for name in names.split()])
    return [Job(spec, LineScenario(seed)) for seed in seeds for spec in specs]


def by_policy(rows: list[ResultRow]) -> dict[str, ResultRow]:
    return {row.policy: row for row in rows}


def without_timings(path: Path) -> list[list[str]]:
    with (path / "results.csv").open() as file:
        lines = list(csv.reader(file))
    keep = [i for i, name in enumerate(lines[0]) if name not in TIMING_COLUMNS]
    return [[line[i] for i in keep] for line in lines]


def test_a_run_directory_holds_rows_and_traces(tmp_path: Path) -> None:
    rows = run_batch(jobs_of("Ahead Logs"), out=tmp_path, workers=0, settings=SETTINGS)
    header = (tmp_path / "results.csv").read_text().splitlines()[0]
    assert header == (
        "policy,task,simulator,scenario,seed,status,reason,success,E_nav,I_nav,S_manip,E_manip,"
        "I_manip,path_length_m,interaction_work_kg_m,steps,sim_time_s,wall_time_s,plan_calls,"
        "plan_time_median_s,plan_time_p99_s,plan_time_max_s,"
        "decision_time_median_s,decision_time_mean_s,decision_time_max_s,began,host,job,trace"
    )
    assert header == ",".join(columns())
    assert [(row.policy, row.seed) for row in rows] == [
        ("Ahead", 0), ("Ahead", 1), ("Logs", 0), ("Logs", 1),
    ]  # fmt: skip
    assert rows[0].plan_calls is None and rows[0].S_manip is None
    assert (rows[2].plan_calls, rows[2].plan_time_median_s, rows[2].plan_time_max_s) == (
        3, 0.002, 0.009,
    )  # fmt: skip
    assert rows[1].trace_file is not None and rows[1].began and rows[1].host
    episode = Episode.load(tmp_path / rows[1].trace_file)
    assert episode.about["policy"] == "Ahead" and episode.success
    assert rows[1].path_length_m == pytest.approx(0.5 * len(episode.actions))


@pytest.mark.slow
def test_whatever_a_policy_does_becomes_a_row(tmp_path: Path) -> None:
    names = (
        "Ahead Raises Exits Nan WrongShape Text Unmakeable Sleeps Swallows HoldsGil Killed "
        "HardExit Segfaults Greedy"
    )
    rows = run_batch(
        jobs_of(names, range(1)),
        out=tmp_path,
        workers=2,
        settings=SETTINGS,
        memory_limit_mb=3000.0,
    )
    found = by_policy(rows)
    assert {name: row.status for name, row in found.items()} == {
        "Ahead": "done",
        "Raises": "policy_error",
        "Exits": "policy_error",
        "Nan": "invalid_action",
        "WrongShape": "invalid_action",
        "Text": "invalid_action",
        "Unmakeable": "policy_error",
        "Sleeps": "timeout",
        "Swallows": "timeout",
        "HoldsGil": "timeout",
        "Killed": "crashed",
        "HardExit": "crashed",
        "Segfaults": "crashed",
        "Greedy": "out_of_memory",
    }
    bad = [row for row in rows if row.policy != "Ahead"]
    assert not any(row.success for row in bad)
    assert all(row.E_nav == 0.0 and row.I_nav is None and row.reason for row in bad)
    assert "SIGKILL" in found["Killed"].reason and "code 7" in found["HardExit"].reason
    assert found["Sleeps"].reason == found["HoldsGil"].reason
    notes = {path.stem: path.read_text() for path in (tmp_path / "failures").iterdir()}
    assert len(notes) == len(bad)
    assert "raise ValueError" in notes[found["Raises"].job]
    for name in ("HoldsGil", "Swallows", "Segfaults"):  # where it happened, from C
        assert "in misbehave" in notes[found[name].job]


def test_an_environment_that_raises_is_told_from_a_policy_that_does(tmp_path: Path) -> None:
    settings = JobSettings(make_env=f"{HERE}:make_broken_env")
    (row,) = run_batch(jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=settings)
    assert row.status == "env_error"
    assert row.reason.startswith("RuntimeError: the engine is broken (evaluation_doubles.py:")


@pytest.mark.slow
def test_a_foreign_process_pool_that_breaks_costs_the_culprits_only(tmp_path: Path) -> None:
    context = get_context("forkserver")
    jobs = jobs_of("Ahead HoldsGil Killed Logs", range(1)) + jobs_of("Ahead", range(1, 6))
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        rows = run_batch(jobs, out=tmp_path, executor=executor, workers=2, settings=SETTINGS)
    assert len(rows) == len(jobs)
    found = {row.policy: row.status for row in rows}
    assert found == {"Ahead": "done", "HoldsGil": "timeout", "Killed": "crashed", "Logs": "done"}


@pytest.mark.slow
def test_any_executor_gives_the_same_results(tmp_path: Path) -> None:
    jobs = jobs_of("Ahead Raises", range(3))
    with ThreadPoolExecutor(2) as threads:
        run_batch(jobs, out=tmp_path / "threads", executor=threads, workers=2, settings=SETTINGS)
    run_batch(jobs, out=tmp_path / "pool", workers=2, settings=SETTINGS)
    run_batch(jobs[::-1], out=tmp_path / "here", workers=0, settings=SETTINGS)
    texts = [without_timings(tmp_path / name) for name in ("threads", "pool", "here")]
    assert texts[0] == texts[1] == texts[2]


def test_jobs_that_have_a_row_are_not_run_again(tmp_path: Path) -> None:
    stored: list[ResultRow | None] = []

    def note(done: int, total: int, row: ResultRow | None) -> None:
        stored.append(row)

    run_batch(jobs_of("Ahead"), out=tmp_path, workers=0, settings=SETTINGS)
    before = (tmp_path / "results.csv").read_bytes()
    run_batch(jobs_of("Ahead"), out=tmp_path, workers=0, settings=SETTINGS, progress=note)
    assert stored == [None]
    assert (tmp_path / "results.csv").read_bytes() == before
    run_batch(jobs_of("Ahead Logs", range(3)), out=tmp_path, workers=0, settings=SETTINGS)
    assert len(without_timings(tmp_path)) == 1 + 6


def test_failed_jobs_are_run_again_on_request(tmp_path: Path) -> None:
    file = tmp_path / "flaky.py"
    file.write_text(
        f"import pathlib, sys\nsys.path.insert(0, {str(Path(HERE).parent)!r})\n"
        "from evaluation_doubles import Ahead\n"
        "class Flaky(Ahead):\n    def misbehave(self):\n"
        f"        if not pathlib.Path({str(tmp_path / 'well')!r}).exists(): raise OSError('ill')\n"
    )
    jobs = [Job(parse_policies(f"{file}:Flaky")[0], LineScenario(0))]
    out = tmp_path / "run"
    assert run_batch(jobs, out=out, workers=0, settings=SETTINGS)[0].failed
    (tmp_path / "well").touch()
    assert run_batch(jobs, out=out, workers=0, settings=SETTINGS)[0].failed
    (row,) = run_batch(jobs, out=out, workers=0, settings=SETTINGS, retry_failed=True)
    assert row.status == "done"


def test_what_has_changed_is_run_again_and_the_old_result_stays(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (first,) = run_batch(jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=SETTINGS)
    other = replace(SETTINGS, timeout_s=9.0)
    (second,) = run_batch(jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=other)
    assert second.job != first.job and second.began > first.began
    assert "settings timeout_s 3.0 -> 9.0; they are run again" in caplog.text
    changed = [Job(parse_policies(f"Ahead={HERE}:Logs")[0], LineScenario(0))]
    (third,) = run_batch(changed, out=tmp_path, workers=0, settings=SETTINGS)
    assert third.plan_calls == 3 and third.job not in (first.job, second.job)
    assert len(list((tmp_path / "episodes").iterdir())) == 3
    caplog.clear()
    again = run_batch(jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=SETTINGS)
    assert again == [first] and not caplog.text


def test_other_versions_count_on_request(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (first,) = run_batch(jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=SETTINGS)
    monkeypatch.setattr("pushplan.__version__", "99.0")
    versions.cache_clear()
    again = run_batch(
        jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=SETTINGS, any_version=True
    )
    assert again == [first]
    (new,) = run_batch(jobs_of("Ahead", range(1)), out=tmp_path, workers=0, settings=SETTINGS)
    assert new.job != first.job
    versions.cache_clear()


def test_two_jobs_that_are_the_same_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="two jobs are the same"):
        run_batch(jobs_of("Ahead") * 2, out=tmp_path, workers=0, settings=SETTINGS)


def test_a_policy_that_cannot_be_sent_is_an_error_with_a_remedy(tmp_path: Path) -> None:
    jobs = [Job(parse_policies([lambda: Ahead()])[0], LineScenario(0))]
    with pytest.raises(InvalidInputError, match="cannot be sent to a worker process"):
        run_batch(jobs, out=tmp_path, workers=1, settings=SETTINGS)
    (row,) = run_batch(jobs, out=tmp_path, workers=0, settings=SETTINGS)
    assert row.status == "done"


MAIN = """
import sys
sys.path.insert(0, {folder!r})
from evaluation_doubles import Ahead, LineScenario
from pushplan.evaluation import Job, JobSettings, parse_policies, run_batch

class Mine(Ahead):
    pass

{guard}
    jobs = [Job(parse_policies([Mine])[0], LineScenario(0))]
    settings = JobSettings(make_env={here!r} + ":make_env")
    print(run_batch(jobs, out=sys.argv[1], workers=1, settings=settings)[0].status)
"""


@pytest.mark.parametrize("guarded", [True, False])
@pytest.mark.slow
def test_a_policy_of_the_main_script_runs_and_a_missing_guard_is_explained(
    tmp_path: Path, guarded: bool
) -> None:
    guard = 'if __name__ == "__main__":' if guarded else "if True:"
    script = tmp_path / "script.py"
    script.write_text(MAIN.format(folder=str(Path(HERE).parent), here=HERE, guard=guard))
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path / "run")], capture_output=True, text=True
    )
    if guarded:
        assert done.stdout == "done\n"
    else:
        assert "under `if __name__ == '__main__':`" in done.stderr.splitlines()[-1]


SCRIPT = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs of a shell ignore it
sys.path.insert(0, {folder!r})
from evaluation_doubles import LineScenario
from pushplan.evaluation import Job, JobSettings, parse_policies, run_batch
specs = parse_policies([{here!r} + ":" + name for name in ("SlowAhead", "Raises", "Killed")])
jobs = [
    Job(spec, LineScenario(seed))
    for seed in range(8)
    for spec in specs
    if seed < 2 or spec.label != "Killed"
]
settings = JobSettings(make_env={here!r} + ":make_env", timeout_s=20.0)
run_batch(jobs, out=sys.argv[1], workers=2, settings=settings)
"""


def start(out: Path) -> subprocess.Popen[bytes]:
    # no guard for __main__: importing the engine must not need one
    script = SCRIPT.format(folder=str(Path(HERE).parent), here=HERE)
    return subprocess.Popen(
        [sys.executable, "-c", script, str(out)], start_new_session=True, stderr=subprocess.PIPE
    )


def wait_for_traces(out: Path, count: int, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 120.0
    while len(list((out / "episodes").glob("*.npz"))) < count:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)


@pytest.mark.slow
def test_a_run_killed_many_times_ends_with_the_same_bytes(tmp_path: Path) -> None:
    undisturbed, disturbed = tmp_path / "whole", tmp_path / "killed"
    assert start(undisturbed).wait(300) == 0
    rng = np.random.default_rng(0)
    stored: set[ResultRow] = set()
    for _ in range(25):
        process = start(disturbed)
        try:
            process.wait(rng.uniform(0.2, 1.5))
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if (disturbed / "results.db").is_file():
            now = set(Results.load(disturbed).rows)
            assert stored <= now
            stored = now
    assert start(disturbed).wait(300) == 0
    assert stored <= set(Results.load(disturbed).rows)
    assert without_timings(disturbed) == without_timings(undisturbed)
    assert len(without_timings(disturbed)) == 1 + 18


@pytest.mark.slow
def test_workers_end_with_their_owner_and_ctrl_c_is_clean(tmp_path: Path) -> None:
    process = start(tmp_path)
    wait_for_traces(tmp_path, 2, process)
    workers = Path(f"/proc/{process.pid}/task")
    children = [
        int(pid) for task in workers.iterdir() for pid in (task / "children").read_text().split()
    ]
    os.killpg(process.pid, signal.SIGINT)
    assert process.stderr is not None
    assert b"KeyboardInterrupt" in process.communicate(timeout=120)[1]
    assert children
    assert not any(Path(f"/proc/{pid}").exists() for pid in children)
    assert start(tmp_path).wait(300) == 0
    assert len(without_timings(tmp_path)) == 1 + 18


@pytest.mark.slow
def test_two_runs_do_not_write_into_one_directory(tmp_path: Path) -> None:
    process = start(tmp_path)
    try:
        wait_for_traces(tmp_path, 1, process)
        with pytest.raises(InvalidInputError, match="another process is writing"):
            run_batch(jobs_of("Ahead"), out=tmp_path, workers=0, settings=SETTINGS)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
