"""Jobs on a Dask cluster: the same bytes, each job still alone, lost machines cost nothing."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from evaluation_doubles import HERE, LineScenario, timeless

from pushplan.evaluation import (
    Experiment,
    Job,
    JobSettings,
    PolicySpec,
    Results,
    parse_policies,
    run_batch,
)
from pushplan.scenarios import suite
from pushplan.world import InvalidInputError

distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
pytestmark = pytest.mark.slow
SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=3.0, grace_s=0.5)


def test_the_same_bytes_as_without(tmp_path: Path) -> None:
    specs = (PolicySpec("straight", "straight"), PolicySpec("random", "random"))
    study = Experiment("study", (suite("maze-2d-3", episodes=4),), specs, JobSettings())
    study.run(tmp_path / "one", workers=1)
    study.run(tmp_path / "two", workers=2)
    study.run(tmp_path / "dask", dask="local:2")
    for part in (1, 2, 3):
        study.run(tmp_path / f"part{part}", shard=(part, 3), workers=1)
    from pushplan.evaluation import merge

    merge(tmp_path / "merged", [tmp_path / f"part{part}" for part in (1, 2, 3)])
    texts = [timeless(tmp_path / name) for name in ("one", "two", "dask", "merged")]
    assert texts[0] == texts[1] == texts[2] == texts[3] and len(texts[0]) == 8


def test_each_job_is_alone_on_its_worker(tmp_path: Path) -> None:
    from pushplan.evaluation.run.cluster import dask_executor

    names = "Ahead Raises Sleeps HoldsGil Killed Segfaults Greedy"
    specs = parse_policies([f"{HERE}:{name}" for name in names.split()])
    jobs = [Job(spec, LineScenario(0)) for spec in specs]
    with dask_executor("local:2", 3000.0) as executor:
        rows = run_batch(jobs, out=tmp_path, executor=executor, workers=8, settings=SETTINGS)
    assert {row.policy: row.status for row in rows} == {
        "Ahead": "done",
        "Raises": "policy_error",
        "Sleeps": "timeout",
        "HoldsGil": "timeout",
        "Killed": "crashed",
        "Segfaults": "crashed",
        "Greedy": "out_of_memory",
    }


@pytest.fixture
def cluster(tmp_path: Path):
    """A scheduler and two workers, as processes: address, scheduler, workers."""
    tool = shutil.which("dask") or str(Path(sys.executable).parent / "dask")
    file = tmp_path / "scheduler.json"
    path = os.pathsep.join([str(Path(HERE).parent), os.environ.get("PYTHONPATH", "")])
    quiet = {
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
        "env": {**os.environ, "PYTHONPATH": path},
    }
    command = [tool, "scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
    scheduler = subprocess.Popen(command, **quiet)
    worker = [tool, "worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-nanny"]
    workers = [subprocess.Popen([*worker, "--no-dashboard"], **quiet) for _ in range(2)]
    deadline = time.monotonic() + 60.0
    while not file.is_file() or not file.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    import json

    yield json.loads(file.read_text())["address"], scheduler, workers
    for process in (scheduler, *workers):
        process.kill()
        process.wait()


def slow_jobs(count: int) -> list[Job]:
    (spec,) = parse_policies([f"{HERE}:SlowAhead"])
    return [Job(spec, LineScenario(seed)) for seed in range(count)]


def test_a_lost_worker_costs_nothing(tmp_path: Path, cluster) -> None:
    from pushplan.evaluation.run.cluster import dask_executor

    address, _, workers = cluster

    def end_one(done: int, total: int, row: object) -> None:
        if done == 3:
            workers[0].send_signal(signal.SIGKILL)

    with dask_executor(address, None) as executor:
        rows = run_batch(
            slow_jobs(12),
            out=tmp_path / "run",
            executor=executor,
            workers=12,
            settings=SETTINGS,
            progress=end_one,
        )
    assert [row.status for row in rows] == ["done"] * 12


def test_a_lost_scheduler_is_one_line_and_a_restart_finishes(tmp_path: Path, cluster) -> None:
    from pushplan.evaluation.run.cluster import dask_executor

    address, scheduler, _ = cluster

    def end_it(done: int, total: int, row: object) -> None:
        if done == 3:
            os.kill(scheduler.pid, signal.SIGKILL)

    with (
        pytest.raises(InvalidInputError, match=r"scheduler of the cluster was lost|takes no jobs"),
        dask_executor(address, None) as executor,
    ):
        run_batch(
            slow_jobs(40),
            out=tmp_path / "run",
            executor=executor,
            workers=4,
            settings=SETTINGS,
            progress=end_it,
        )
    stored = Results.load(tmp_path / "run").rows
    assert 3 <= len(stored) < 40 and {row.status for row in stored} == {"done"}
    rows = run_batch(slow_jobs(40), out=tmp_path / "run", workers=2, settings=SETTINGS)
    assert len(rows) == 40 and set(stored) <= set(rows)


def test_no_cluster_is_one_line() -> None:
    from pushplan.evaluation.run import cluster

    for where in ("local:0", "local:x", "nonsense", ""):
        with pytest.raises(InvalidInputError, match="'local:N' or the address"):
            cluster.dask_executor(where, None).__enter__()


def test_no_scheduler_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    from pushplan.evaluation.run import cluster

    monkeypatch.setattr(cluster, "CONNECT_S", 1.0)
    with pytest.raises(InvalidInputError, match="no Dask scheduler at"):
        cluster.dask_executor("tcp://127.0.0.1:1", None).__enter__()


def test_the_slurm_example_asks_for_what_it_says() -> None:
    pytest.importorskip("dask_jobqueue", reason="needs the extra 'cluster'")
    from pushplan.imports.named_objects import load_object

    example = Path(__file__).parents[2] / "examples" / "slurm_cluster.py"
    with load_object(f"{example}:cluster")() as nodes:
        script = nodes.job_script()
    for line in ("#SBATCH -p normal", "#SBATCH --exclusive", "#SBATCH -t 04:00:00"):
        assert line in script
    assert "--nworkers 16" in script and "--nthreads 1" in script
