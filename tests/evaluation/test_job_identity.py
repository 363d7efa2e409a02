"""The identity of a job holds everything that its episode depends on, and nothing about reports."""

from __future__ import annotations

import functools
import json
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from evaluation_doubles import HERE, LineScenario

import pushplan
from pushplan.envs import registry
from pushplan.evaluation import Job, JobSettings, PolicySpec, Results, parse_policy, run_batch
from pushplan.evaluation.run.job_identity import job_spec
from pushplan.evaluation.run.jobs import job_id
from pushplan.evaluation.store.provenance import (
    PACKAGES,
    UNSEEN,
    package_digest,
    packages,
    versions,
)
from pushplan.evaluation.stress_testing import UNDISTURBED, stress
from pushplan.scenarios import Scenario
from pushplan.world import InvalidInputError

SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=20.0, dry_run=False)


@pytest.fixture
def no_memory() -> Iterator[None]:
    """Let a test change what a process looks up once."""
    forget()
    yield
    forget()


def forget() -> None:
    for cached in (versions, package_digest, packages):
        cached.cache_clear()


def identity(policy: Any = "straight", scenario: Any = None, settings: Any = SETTINGS) -> str:
    job = Job(parse_policy(policy), LineScenario(0) if scenario is None else scenario)
    return job_id(job_spec(job, settings))


def changes(path: Path, of: Callable[[], str]) -> bool:
    """Whether an identity is another one after a file has been changed."""
    before = of()
    path.write_bytes(path.read_bytes() + b"\n# changed")
    return of() != before


def of_package() -> str:
    forget()
    return identity()


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_memory: None) -> Path:
    """A copy of the package that the identity takes for ours."""
    assert pushplan.__file__ is not None
    there = tmp_path / "pushplan"
    left_out = shutil.ignore_patterns("__pycache__", "training", "ros")
    shutil.copytree(Path(pushplan.__file__).parent, there, ignore=left_out)
    monkeypatch.setattr(pushplan, "__file__", str(there / "__init__.py"))
    return there


def test_any_file_of_ours_counts_that_an_episode_may_run_through(package: Path) -> None:
    seen = [of_package()]
    for name in (
        "evaluation/run/recording.py",
        "evaluation/run/execute.py",
        "evaluation/store/rows.py",
        "evaluation/stress_testing.py",
        "world/seeds.py",
        "runtime/disturbed_policy.py",
        "control/executors.py",
        "metrics/navigation.py",
        "interaction/weights/ice_network.onnx",
        "evaluation/run/brand_new.py",
    ):
        with (package / name).open("ab") as file:
            file.write(b"\n# changed")
        seen.append(of_package())
        assert seen[-1] not in seen[:-1], name


def test_reports_commands_and_caches_do_not_count(package: Path) -> None:
    cache = package / "world" / "__pycache__"
    cache.mkdir()
    (cache / "plan.nbc").touch()
    before = of_package()
    for name in (
        "evaluation/report/tables.py",
        "evaluation/report/plots.py",
        "evaluation/report/page_files/page.css",
        "cli/studies.py",
        "learned/weights/maze-ppo.md",
        "world/__pycache__/plan.nbc",
    ):
        with (package / name).open("ab") as file:
            file.write(b"\n# changed")
    assert of_package() == before


@pytest.mark.slow
def test_no_episode_imports_what_does_not_count() -> None:
    code = (
        "import importlib, sys\n"
        "from pushplan.evaluation.run.pool import PRELOAD\n"
        "for name in (*PRELOAD, 'pushplan.evaluation.run.worker'): importlib.import_module(name)\n"
        "from pushplan.evaluation import Job, JobSettings, parse_policy\n"
        "from pushplan.evaluation.run.execute import execute\n"
        "from pushplan.scenarios import Scenario\n"
        "for task, policy in (('maze', 'straight'), ('ship_ice', 'ship-predictive-network'),\n"
        "        ('box_delivery', 'greedy'), ('area_clearing', 'area-clearing-ppo')):\n"
        "    job = Job(parse_policy(policy), Scenario(task))\n"
        "    assert execute(job, JobSettings(timeout_s=60)).row.steps, policy\n"
        "print(*(name for name in sys.modules if name.startswith('pushplan.')))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    seen = {name.removeprefix("pushplan.").replace(".", "/") for name in done.stdout.split()}
    rooms = {name.partition("/")[0] for name in seen}
    assert "evaluation/run/recording" in seen
    assert not UNSEEN & (seen | rooms)


@pytest.mark.usefixtures("no_memory")
@pytest.mark.parametrize("name", [*PACKAGES, "python"])
def test_versions_of_what_lies_below_count(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def version(asked: str) -> str:
        return "1" if asked != name else newest

    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setattr("pushplan.evaluation.store.provenance.package_digest", lambda: "0")
    scenario = LineScenario(0, simulator=name if name in ("mujoco", "pymunk") else "fake")
    newest = "1"
    before = identity(scenario=scenario)
    newest = "2"
    forget()
    if name == "python":
        monkeypatch.setattr("platform.python_version", lambda: "4.0")
    assert (identity(scenario=scenario) != before) == (name != "torch")  # no episode needs it
    other = LineScenario(0, simulator="other")
    if name in ("mujoco", "pymunk"):
        changed = identity(scenario=other)
        newest = "3"
        forget()
        assert identity(scenario=other) == changed


MINE = """
import evaluation_doubles
import helper, numpy
from parts import inner
def later():
    import late, importlib
    return importlib.import_module("named")
class Mine(evaluation_doubles.Ahead):
    def act(self, world, observation):
        from pushplan.world import Twist
        return Twist(0.5, helper.TURN)
"""


@pytest.fixture
def mine(tmp_path: Path) -> str:
    folder = tmp_path / "own"
    (folder / "parts").mkdir(parents=True)
    (folder / "mine.py").write_text(MINE)
    for name in ("late", "named", "unused", "parts/__init__", "parts/deep"):
        (folder / f"{name}.py").write_text("VALUE = 1\n")
    (folder / "helper.py").write_text("TURN = 0.0\n")
    (folder / "parts" / "inner.py").write_text("from . import deep\n")
    return f"{folder}/mine.py:Mine"


def test_an_own_file_and_the_local_modules_that_it_imports_count(mine: str) -> None:
    folder = Path(mine).parent
    for source in (mine, functools.partial(PolicySpec, parse_policy(mine))):
        for name in ("mine", "helper", "late", "named", "parts/__init__", "parts/inner"):
            assert changes(folder / f"{name}.py", lambda s=source: identity(s)), name
        assert changes(folder / "parts" / "deep.py", lambda s=source: identity(s))
        assert not changes(folder / "unused.py", lambda s=source: identity(s))


def test_the_version_of_a_library_that_an_own_file_imports_counts(
    mine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Path(mine.rpartition(":")[0])
    file.write_text(f"{MINE}\nimport pytest\n")
    spec = job_spec(Job(parse_policy(mine), LineScenario(0)), SETTINGS)
    assert spec["versions"]["pytest"] == metadata.version("pytest")
    assert "pytest" not in job_spec(Job(parse_policy("straight"), LineScenario(0)), SETTINGS)


def test_a_file_that_was_moved_is_the_same_policy(mine: str, tmp_path: Path) -> None:
    before = identity(mine)
    moved = shutil.move(Path(mine).parent, tmp_path / "elsewhere")
    assert identity(f"{moved}/mine.py:Mine") == before


@pytest.mark.parametrize("source", ["onnx:net.onnx", "sb3:net.zip"])
def test_weights_count_and_what_is_said_beside_them(
    tmp_path: Path, source: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    weights = tmp_path / source.partition(":")[2]
    beside = tmp_path / "net.pushplan.json"
    for file in (weights, beside):
        file.write_bytes(b"{}")
        assert changes(file, lambda: identity(source))


def test_objects_that_a_policy_is_made_with_count(tmp_path: Path) -> None:
    weights = tmp_path / "weights.bin"
    weights.write_bytes(b"1")
    given = PolicySpec("p", "straight", {"weights": str(weights)})
    assert changes(weights, lambda: identity(given))
    arrays = [np.zeros(5000), np.zeros(5000)]
    arrays[1][2500] = 1.0  # which no ``repr`` shows
    assert len({identity(PolicySpec("p", "straight", {"w": one})) for one in arrays}) == 2
    gains = [functools.partial(dict, gain=gain) for gain in (1.0, 2.0)]

    def with_gain(gain: float) -> Callable[[], float]:
        return lambda: gain

    closures = [with_gain(gain) for gain in (1.0, 2.0)]
    bodies: list[Any] = []
    for number in (1, 2):
        space: dict[str, Any] = {"__name__": "no_file_at_all"}
        exec(f"class Cell:\n    def act(self): return {number}", space)
        bodies.append(space["Cell"])
    for pair in (gains, closures, bodies):
        assert len({identity(PolicySpec("p", one)) for one in pair}) == 2
    assert identity(PolicySpec("p", gains[0])) == identity(PolicySpec("p", gains[0]))


def test_a_set_has_the_same_identity_in_every_process() -> None:
    code = (
        "from pushplan.evaluation import PolicySpec\n"
        "names = {'a', 'b', 'c', 'd', 'e'}\n"
        "print(PolicySpec('p', lambda: 'x' in {'q', 'r', 's', 't'}, {'names': names}).identity)"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(texts) == 1


def test_files_of_a_scenario_count_and_the_files_that_they_name(tmp_path: Path) -> None:
    (tmp_path / "world.yaml").write_text("static: {map: map.yaml}\n")
    (tmp_path / "map.yaml").write_text("image: map.pgm\n")
    (tmp_path / "map.pgm").write_bytes(b"P5 1 1 255 \0")
    variations = {"world_file": str(tmp_path / "world.yaml")}
    scenario = Scenario("room", variations=variations)
    for name in ("map.pgm", "map.yaml", "world.yaml"):
        assert changes(tmp_path / name, lambda: identity(scenario=scenario)), name


def test_environments_tasks_and_settings_of_ones_own_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "own_env.py"
    file.write_text("def make(scenario, observation): ...\n")
    assert changes(file, lambda: identity(settings=JobSettings(make_env=f"{file}:make")))
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_task.py").touch()
    monkeypatch.setitem(registry.TASKS, "maze", "own_task:Task")
    assert changes(tmp_path / "own_task.py", identity)
    (tmp_path / "own_robot.py").write_text("import shape\n")
    (tmp_path / "shape.py").touch()
    for scenario in (
        Scenario("ship_ice", variations={"robot": f"{tmp_path}/own_robot.py:cart"}),
        Scenario(f"{tmp_path}/own_robot.py:Task"),
    ):
        for name in ("own_robot.py", "shape.py"):
            assert changes(tmp_path / name, lambda s=scenario: identity(scenario=s)), name
    several = [
        JobSettings(timeout_s=1.0),
        JobSettings(timeout_s=2.0),
        JobSettings(latency_factor=1.0),
        JobSettings(observation="image"),
        JobSettings(clock="cpu"),
    ]
    assert len({identity(settings=one) for one in several}) == len(several)


def batch(mine: str, out: Path, seeds: int = 1, **options: Any) -> Any:
    spec = parse_policy(mine)
    jobs = [Job(spec, LineScenario(seed)) for seed in range(seeds)]
    return run_batch(jobs, out=out, workers=0, settings=SETTINGS, **options)


def test_files_of_one_name_beside_two_policies_are_not_mixed_up(mine: str, tmp_path: Path) -> None:
    other = shutil.copytree(Path(mine).parent, tmp_path / "other")
    (other / "helper.py").write_text("TURN = 0.005\n")
    specs = [parse_policy(f"{label}={where}/mine.py:Mine") for label, where in
             (("a", Path(mine).parent), ("b", other))]  # fmt: skip
    assert specs[0].identity != specs[1].identity
    jobs = [Job(spec, LineScenario(seed)) for seed in range(2) for spec in specs]
    a, _, b, _ = run_batch(jobs, out=tmp_path / "both", workers=0, settings=SETTINGS)
    for spec, row in zip(specs, (a, b), strict=True):
        out = tmp_path / row.policy
        (alone,) = run_batch([Job(spec, LineScenario(0))], out=out, workers=0, settings=SETTINGS)
        assert (alone.job, alone.metrics) == (row.job, row.metrics)
    assert a.metrics != b.metrics


def test_an_edited_helper_is_run_as_it_is_now(mine: str, tmp_path: Path) -> None:
    (first,) = batch(mine, tmp_path / "run")
    (Path(mine).parent / "helper.py").write_text("TURN = 0.005\n")
    (second,) = batch(mine, tmp_path / "run")
    assert first.job != second.job
    assert first.path_length_m != second.path_length_m or first.steps != second.steps
    (fresh,) = batch(mine, tmp_path / "fresh")
    assert (fresh.job, fresh.metrics) == (second.job, second.metrics)


def test_old_rows_of_an_edited_policy_are_not_averaged_with_new_ones(
    mine: str, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    old = batch(mine, out, seeds=3)
    helper = Path(mine).parent / "helper.py"
    before = helper.read_text()
    helper.write_text("TURN = 0.004\n")
    (new,) = batch(mine, out)
    assert Results.load(out).rows == (new,)
    helper.write_text(before)
    assert batch(mine, out, seeds=3) == old


def test_a_stress_test_runs_an_edited_policy_again(mine: str, tmp_path: Path) -> None:
    ran: list[Any] = []

    def note(done: int, total: int, row: Any) -> None:
        ran.extend([row] if row is not None else [])

    file = Path(mine.rpartition(":")[0])
    file.write_text(
        "from pushplan.planners.random_twist import RandomTwist as Mine\nimport helper\n"
    )
    given: dict[str, Any] = {"conditions": {}, "workers": 0, "out": tmp_path / "run"}
    short = {"boxes": 1, "time_limit": 2.0}
    starts = [Scenario("maze", variations=short, seed=seed) for seed in range(2)]
    for expected, changed, episodes in (
        (2, None, 2),
        (2, None, 2),
        (3, "helper", 1),
        (4, "mine", 1),
    ):
        if changed is not None:
            with (file.parent / f"{changed}.py").open("a") as source:
                source.write("# another one\n")
        sheet = stress(mine, starts[:episodes], progress=note, **given)
        assert len(ran) == expected
        assert sheet.rows[0].condition == UNDISTURBED and sheet.rows[0].episodes == episodes


@pytest.mark.parametrize("changed", ["edited", "removed"])
def test_a_file_that_changes_while_the_batch_runs_stops_it(
    mine: str, tmp_path: Path, changed: str
) -> None:
    helper = Path(mine).parent / "helper.py"
    before = helper.read_text()

    def disturb(done: int, total: int, row: Any) -> None:
        if done != 1:
            return
        if changed == "edited":
            helper.write_text("TURN = 0.1\n")
        else:
            helper.unlink()

    with pytest.raises(InvalidInputError, match=r"policy identity .* the same command goes on"):
        batch(mine, tmp_path / "run", seeds=3, progress=disturb)
    assert [row.status for row in Results.load(tmp_path / "run").rows] == ["done"]
    helper.write_text(before)
    assert [row.status for row in batch(mine, tmp_path / "run", seeds=3)] == ["done"] * 3


@pytest.mark.slow
def test_no_file_of_a_report_stays_beside_new_rows(tmp_path: Path) -> None:
    jobs = [Job(parse_policy(f"{HERE}:Ahead"), LineScenario(seed)) for seed in range(4)]
    run_batch(jobs[:3], out=tmp_path, workers=0, settings=SETTINGS)
    before = {path for path in tmp_path.rglob("*") if path.is_file()}
    Results.load(tmp_path).report(figures=("pdf", "png"), replays="beside")
    made = {path for path in tmp_path.rglob("*") if path.is_file()} - before
    assert {"report.html", "intervals.svg", "intervals.pdf", "scores.png"} <= {p.name for p in made}
    assert any(path.parent.name == "replays" for path in made)
    others = [tmp_path / "figure.svg", tmp_path / "replays" / "notes.txt"]
    for path in others:
        path.touch()
    run_batch(jobs, out=tmp_path, workers=0, settings=SETTINGS)
    assert not [path for path in made if path.exists()]
    assert all(path.exists() for path in others)
    Results.load(tmp_path).report(figures=("pdf",))
    Results.load(tmp_path).report()
    assert not list(tmp_path.glob("*.pdf"))


def test_a_run_directory_of_version_0_2_is_continued(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    jobs = [Job(parse_policy(f"{HERE}:Ahead"), LineScenario(seed)) for seed in range(2)]
    run_batch(jobs, out=tmp_path, workers=0, settings=SETTINGS)
    with sqlite3.connect(tmp_path / "results.db") as db:  # as it wrote them
        for job, text in db.execute("SELECT job, spec FROM results").fetchall():
            spec = json.loads(text)
            kept = {name: spec["versions"][name] for name in ("pushplan", "numpy", "scipy")}
            spec["versions"] = {**kept, "code": "0123456789ab"}
            spec.pop("files", None)
            row = (job_id(spec), json.dumps(spec), job)
            db.execute("UPDATE results SET job = ?, spec = ? WHERE job = ?", row)
    old = Results.load(tmp_path).rows
    assert len(old) == 2
    assert run_batch(jobs[:1], out=tmp_path, workers=0, settings=SETTINGS) != list(old)
    (line,) = caplog.messages
    assert "versions code '0123456789ab' ->" in line and len(line) < 600 and "\n" not in line
