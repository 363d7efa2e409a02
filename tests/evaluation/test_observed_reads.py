"""What code of users reads while it runs decides whether its results are used again."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from evaluation_doubles import HERE, LineScenario

from pushplan.evaluation import Job, JobSettings, Results, parse_policy, reproduce, run_batch
from pushplan.evaluation.run.execute import execute
from pushplan.evaluation.run.job_identity import job_spec
from pushplan.evaluation.store.database import read_results, reading
from pushplan.evaluation.store.rows import TIMING_COLUMNS, ResultRow
from pushplan.scenarios import Scenario
from pushplan.world import InvalidInputError

SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=20.0, dry_run=False)

POLICY = """
import functools, os, pathlib
import evaluation_doubles
{imports}
FOLDER = pathlib.Path(__file__).parent
class Mine(evaluation_doubles.Ahead):
    turn = 0.0
    def __init__(self):
        {make}
    def reset(self, world, rng):
        super().reset(world, rng)
        {reset}
    def act(self, world, observation):
        from pushplan.world import Twist
        self.steps += 1
        {act}
        return Twist(0.5, float(self.turn))
"""
KINDS: dict[str, dict[str, str]] = {
    "open in the constructor": {"make": "self.turn = open(FOLDER / 'data').read()"},
    "pathlib in reset": {"reset": "self.turn = (FOLDER / 'data').read_text()"},
    "os.open": {"make": "self.turn = os.read(os.open(FOLDER / 'data', os.O_RDONLY), 99)"},
    "numpy while it is imported": {
        "imports": "import numpy; TURN = numpy.loadtxt(__file__[:-7] + 'data')",
        "make": "self.turn = TURN",
    },
    "a library that kept open() for itself": {
        "imports": "import tokenize",
        "make": "self.turn = tokenize.open(FOLDER / 'data').read()",
    },
    "in the third step": {"act": "if self.steps == 3: self.turn = open(FOLDER / 'data').read()"},
    "in an episode that is not the first": {
        "reset": "box = world.movables.poses[0, 0]; "
        "self.turn = 0 if box == 3.6369616873214543 else open(FOLDER / 'data').read()"
    },
    "once in a process": {
        "imports": "@functools.cache\ndef turn(): return open(FOLDER / 'data').read()",
        "act": "self.turn = turn()",
    },
    "a module by its path": {
        "imports": "import importlib.util as util",
        "make": "spec = util.spec_from_file_location('other', FOLDER / 'data.py'); "
        "other = util.module_from_spec(spec); spec.loader.exec_module(other); "
        "self.turn = other.TURN",
    },
    "runpy": {"make": "import runpy; self.turn = runpy.run_path(FOLDER / 'data.py')['TURN']"},
    "import_module under another name": {
        "imports": "from importlib import import_module as load",
        "make": "self.turn = load('da' + 'ta').TURN",
    },
}


def policy(folder: Path, **parts: str) -> str:
    filled = dict.fromkeys(("imports", "make", "reset", "act"), "pass") | parts
    folder.mkdir(exist_ok=True)
    (folder / "mine.py").write_text(POLICY.format(**filled))
    write(folder, 0.0)
    return f"{folder}/mine.py:Mine"


def write(folder: Path, turn: float) -> None:
    (folder / "data").write_text(f"{turn}")
    (folder / "data.py").write_text(f"TURN = {turn}")


class Batch:
    """Runs jobs in one run directory and counts those that are run."""

    def __init__(self, source: str, out: Path, **options: Any) -> None:
        self.source = source
        self.options = {"out": out, "settings": SETTINGS, "workers": 0, **options}

    def __call__(self, seeds: int = 2) -> tuple[int, list[ResultRow]]:
        ran = []

        def progress(done: int, total: int, row: Any) -> None:
            ran.extend([row] if row is not None else [])

        jobs = [Job(parse_policy(self.source), LineScenario(seed)) for seed in range(seeds)]
        rows = run_batch(jobs, progress=progress, **self.options)
        assert {row.status for row in rows} == {"done"}, [row.reason for row in rows]
        return len(ran), rows


def check_that_all_run_again(
    run: Batch, change: Callable[[], object], back: Callable[[], object]
) -> None:
    """Results of before a change are not used after it, and count once more when it is undone."""
    _, first = run()
    assert run() == (0, first)
    change()
    ran, second = run()
    assert ran == len(first)
    assert second[1].path_length_m != first[1].path_length_m
    assert run() == (0, second)
    back()
    assert run(1) == (0, first[:1])
    assert run() == (0, first)
    assert Results.load(run.options["out"]).rows == tuple(first)


@pytest.mark.parametrize("kind", KINDS)
def test_a_change_of_what_it_reads_runs_all_its_jobs_again(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "own"
    run = Batch(policy(folder, **KINDS[kind]), tmp_path / "run")
    check_that_all_run_again(run, lambda: write(folder, 0.004), lambda: write(folder, 0.0))


@pytest.mark.parametrize(
    ("imports", "read"),
    [
        ("", "os.environ['OWN_TURN']"),
        ("", "os.environ.get('OWN_' + 'TURN', 0)"),
        ("from os import getenv as setting", "setting('OWN_TURN', '0')"),
        ("TURN = os.environb[b'OWN_TURN']", "TURN"),
    ],
)
def test_an_environment_variable_counts(
    imports: str, read: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OWN_TURN", "0")
    source = policy(tmp_path / "own", imports=imports or "pass", make=f"self.turn = {read}")
    check_that_all_run_again(
        Batch(source, tmp_path / "run"),
        lambda: monkeypatch.setenv("OWN_TURN", "0.004"),
        lambda: monkeypatch.setenv("OWN_TURN", "0"),
    )
    text = b"".join(file.read_bytes() for file in (tmp_path / "run").glob("results.db*"))
    assert b"OWN_TURN" in text and b"0.004" not in text  # it may be a password


@pytest.mark.parametrize("change", ["removed", "added"])
def test_a_file_that_is_missing_counts(change: str, tmp_path: Path) -> None:
    data = tmp_path / "data"  # not beside the policy
    read = f"with contextlib.suppress(OSError): self.turn = open({str(data)!r}).read()"
    source = policy(tmp_path / "own", imports="import contextlib", make=read)
    steps = [lambda: data.write_text("0.004"), data.unlink]
    if change == "removed":
        steps[0]()
        steps.reverse()
    check_that_all_run_again(Batch(source, tmp_path / "run"), *steps)


@pytest.mark.parametrize(
    "made",
    [
        # what it makes itself, or another program does for it
        "(FOLDER / 'log').open('a').write('x'); (FOLDER / 'log').read_text()",
        "os.system(f'date +%N > {FOLDER}/log'); (FOLDER / 'log').read_text()",
        "os.environ['OWN_SEED'] = str(id(self)); os.environ['OWN_SEED']",
        "import evaluation_doubles as e; e.tempfile.NamedTemporaryFile().read()",
        # what libraries ask for, and whole environments for other programs
        "dict(os.environ); os.environ.copy(); pathlib.Path.home(); e = os.path.expandvars('$PATH')",
        "open('/proc/self/stat').read(); open('/etc/hostname').read(); open(os.__file__).read()",
    ],
)
def test_products_and_what_belongs_to_the_system_do_not_count(
    made: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Batch(policy(tmp_path / "own", reset=made), tmp_path / "run")
    _, first = run()
    monkeypatch.setenv("OWN_OTHER", "1")
    assert run() == (0, first)
    with reading(tmp_path / "run") as db:
        assert not [one.spec["read"] for one in read_results(db) if "read" in one.spec]


class OtherScenario(LineScenario):
    @property
    def key(self) -> str:
        return f"other-{self.seed}"


def test_old_results_of_other_settings_count_no_more(tmp_path: Path) -> None:
    """A label is one policy, and what it reads belongs to it."""
    spec = parse_policy(policy(tmp_path / "own", **KINDS["open in the constructor"]))
    jobs = [Job(spec, LineScenario(0)), Job(spec, OtherScenario(0))]
    options: dict[str, Any] = {"out": tmp_path / "run", "workers": 0, "settings": SETTINGS}
    assert len(run_batch(jobs, **options)) == 2
    write(tmp_path / "own", 0.004)
    assert [row.scenario for row in run_batch(jobs[1:], **options)] == ["other-0"]


def test_it_may_be_moved_with_its_files(tmp_path: Path) -> None:
    source = policy(tmp_path / "own", **KINDS["open in the constructor"])
    _, first = Batch(source, tmp_path / "run")()
    moved = shutil.move(tmp_path / "own", tmp_path / "elsewhere")
    run = Batch(f"{moved}/mine.py:Mine", tmp_path / "run")
    assert run() == (0, first)
    write(moved, 0.004)
    assert run()[0] == 2


def test_processes_see_the_same_and_store_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    source = policy(folder, **KINDS["once in a process"])
    settings = JobSettings(make_env=f"{HERE}:make_env", timeout_s=20.0)

    def timeless(rows: list[ResultRow]) -> list[dict[str, Any]]:
        return [
            {name: value for name, value in row.by_column().items() if name not in TIMING_COLUMNS}
            for row in rows
        ]

    found = {}
    for workers in (0, 2):
        run = Batch(source, tmp_path / f"run{workers}", workers=workers, settings=settings)
        found[workers] = run(4)
        assert run(4)[0] == 0
        write(folder, 0.004)
        assert run(4)[0] == 4
        write(folder, 0.0)
    assert timeless(found[0][1]) == timeless(found[2][1])


def test_data_that_changes_while_the_batch_runs_stops_it(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    source = policy(folder, **KINDS["in the third step"])
    jobs = [Job(parse_policy(source), LineScenario(seed)) for seed in range(4)]
    options: dict[str, Any] = {"out": tmp_path / "run", "workers": 0, "settings": SETTINGS}

    def change(done: int, total: int, row: Any) -> None:
        if done == 2:
            write(folder, 0.004)

    with pytest.raises(InvalidInputError, match="data, which code of yours reads, has changed"):
        run_batch(jobs, progress=change, **options)
    assert Batch(source, tmp_path / "run")(4)[0] == 4


def test_an_episode_that_ends_by_force_of_its_limit_tells_what_it_has_read(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    source = policy(folder, make="self.turn = open(FOLDER / 'data').read()", act="while True: pass")
    jobs = [Job(parse_policy(source), LineScenario(0))]
    settings = JobSettings(make_env=f"{HERE}:make_env", timeout_s=0.5, dry_run=False)
    ran: list[Any] = []

    def note(done: int, total: int, row: Any) -> None:
        ran.extend([row] if row is not None else [])

    for turn in (0.0, 0.0, 0.004):
        write(folder, turn)
        run_batch(jobs, out=tmp_path / "run", workers=0, settings=settings, progress=note)
    assert [row.status for row in ran] == ["timeout", "timeout"]


ROBOT = """
import pathlib
from pushplan.world import box_delivery_robot
def cart(drive, **limits):
    mass = float((pathlib.Path(__file__).parent / "mass").read_text())
    return box_delivery_robot(drive=drive, **{"mass": mass, **limits})
"""


def test_files_of_robots_and_tasks_count_and_what_they_read(tmp_path: Path) -> None:
    for name, text in (("robot.py", ROBOT), ("mass", "5.0"), ("task.py", TASK)):
        (tmp_path / name).write_text(text)
    given = {"boxes": 1, "time_limit": 2.0, "robot": f"{tmp_path}/robot.py:cart"}
    own = Scenario("maze", variations=given)
    other = Scenario(f"{tmp_path}/task.py:Mine", variations={"boxes": 1, "time_limit": 2.0})
    ours = Scenario("maze", variations={"boxes": 1, "time_limit": 2.0}, seed=1)
    policies = [parse_policy("straight"), parse_policy("random")]

    def ran() -> int:
        rows: list[Any] = []
        jobs = [Job(one, scene) for one in policies for scene in (own, other, ours)]
        run_batch(
            jobs, out=tmp_path / "run", workers=0, progress=lambda *a: rows.append(a[2]),
            settings=JobSettings(dry_run=False),
        )  # fmt: skip
        assert all(row is None or not row.failed for row in rows), rows
        return len(rows) - 1

    assert ran() == 6
    assert ran() == 0
    (tmp_path / "mass").write_text("6.0")
    run_batch([Job(policies[0], replace(own, seed=1))], out=tmp_path / "run", workers=0)
    shown = [row for row in Results.load(tmp_path / "run").rows if row.policy == "straight"]
    assert sorted(row.seed for row in shown if row.task == "maze") == [1]
    assert ran() == 2
    for name in ("robot.py", "task.py"):
        with (tmp_path / name).open("a") as file:
            file.write("# edited\n")
        assert ran() == 2, name
    assert ran() == 0
    (tmp_path / "mass").write_text("5.0")
    (row,) = [one for one in Results.load(tmp_path / "run").rows if one.scenario == own.key][:1]
    again = reproduce(tmp_path / "run", row.job)
    assert again.changed.startswith(f"read {tmp_path}/mass ")


TASK = """
from pushplan.envs.tasks.maze import MazeTask
class Mine(MazeTask):
    name = "mine"
"""


def test_without_code_of_a_user_nothing_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pushplan's own files are in the versions."""
    monkeypatch.chdir(tmp_path)
    job = Job(parse_policy("straight"), Scenario("maze", variations={"time_limit": 1.0}))
    job = Job(job.policy, job.scenario, job_spec(job, JobSettings()))
    found = execute(job, JobSettings())
    assert not found.row.failed and not found.read


def test_a_directory_of_before_counts_as_it_is(tmp_path: Path) -> None:
    """Results of version 0.3.0 do not say what was read."""
    folder = tmp_path / "own"
    run = Batch(policy(folder, **KINDS["runpy"]), tmp_path / "run")
    _, first = run()
    with sqlite3.connect(tmp_path / "run/results.db") as db:
        for job, text in db.execute("SELECT job, spec FROM results").fetchall():
            spec = {name: value for name, value in json.loads(text).items() if name != "read"}
            db.execute("UPDATE results SET spec = ? WHERE job = ?", (json.dumps(spec), job))
    write(folder, 0.004)
    assert run() == (0, first)
