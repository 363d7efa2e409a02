"""A user's task and a user's robot, given as a class and a function of a file."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.envs import PushEnv
from pushplan.evaluation import Experiment, JobSettings, bench, parse_policy, reproduce
from pushplan.evaluation.run.job_identity import job_spec
from pushplan.evaluation.run.jobs import Job, job_id
from pushplan.scenarios import Scenario, load_scenarios, save_scenarios
from pushplan.world import InvalidInputError, ScenarioError, SchemaError
from pushplan.world.stored.robots import make_robot

TASK = """
from dataclasses import dataclass

import numpy as np

from pushplan.envs.tasks import StepOutcome, Task
from pushplan.envs.tasks.base import drive_of
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.world import GoalDisc, Movables, StaticMap, World, box_delivery_robot

SQUARE = 0.2 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


@dataclass(frozen=True, kw_only=True)
class FieldVariations(TaskVariations):
    boxes: int = 1


class OpenField(Task):
    name = "open_field"
    actions = ("velocity", "turn_rate")
    variation_class = FieldVariations
    control_step = 0.2
    reach = 20.0

    def _prepare(self):
        self.robot = self.variations.limit(box_delivery_robot(drive=drive_of(self.action)))

    def start(self, rng):
        count = self.variations.boxes
        poses = np.column_stack([rng.uniform((1.0, -1.0), (2.0, 1.0), (count, 2)), np.zeros(count)])
        return World(
            robot=self.robot,
            robot_pose=np.zeros(3),
            static=StaticMap.build(bounds=[-5.0, -5.0, 5.0, 5.0]),
            movables=Movables.from_outlines([SQUARE] * count, poses),
            goal=GoalDisc(np.array([3.0, 0.0]), 0.5),
        )

    def score(self, before, after, *, work, touched_static):
        reached = after.goal.distance(*after.robot_pose[:2]) == 0.0
        return StepOutcome(-0.2, reached, "goal" if reached else "", reached)
"""
ROBOT = """
from pushplan.world import RobotModel


def slab(drive, **limits):
    corners = [(-0.1, -0.2), (0.1, -0.2), (0.1, 0.2), (-0.1, 0.2)]
    return RobotModel.from_outline(
        corners, mass=5.0, drive=drive, max_speed=0.5, max_turn_rate=1.0, **limits
    )


def nothing(drive):
    return None
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own_task.py").write_text(TASK)
    (tmp_path / "own_robot.py").write_text(ROBOT)
    return tmp_path


def job(task: str) -> Job:
    return Job(parse_policy("straight"), Scenario(task))


@pytest.mark.usefixtures("folder")
def test_it_runs_wherever_a_task_is_given(capsys: pytest.CaptureFixture[str]) -> None:
    task = ["--task", "own_task.py:OpenField", "--boxes", "2"]
    assert main(["run", *task, "--policy", "straight"]) == 0
    assert "straight on OpenField-pymunk-benchmark-" in capsys.readouterr().out
    assert main(["describe", *task]) == 0
    bench = ["bench", *task, "--policies", "straight", "--episodes", "2", "--workers", "0"]
    assert main(bench) == 0
    rows = Path("runs/OpenField/results.csv").read_text().splitlines()
    assert [row.split(",")[1] for row in rows] == ["task", "OpenField", "OpenField"]
    assert [row.split(",")[4] for row in rows] == ["seed", "0", "1"]


@pytest.mark.slow
def test_a_study_names_it_and_a_robot_beside_itself(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "study.yaml").write_text(
        "schema: pushplan-experiment/1\n"
        "suites:\n"
        "  - {task: own_task.py:OpenField, label: field, variations: {boxes: 2}}\n"
        "  - {task: maze, variations: {boxes: 1, robot: own_robot.py:slab}}\n"
        "policies: [straight]\n"
        "episodes: 1\n"
    )
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    study = Experiment.load(folder / "study.yaml")
    assert [one.name for one in study.suites] == [
        "field[boxes=2]",
        "maze[boxes=1,robot=own_robot.py:slab]",
    ]
    results = study.run(folder / "run", workers=1)
    assert [row.status for row in results.rows] == ["done", "done"]
    assert {row.task for row in results.rows} == {"OpenField", "maze"}
    assert all(reproduce(folder / "run", row.job).same for row in results.rows)


def test_a_job_is_another_where_the_task_was_edited_and_the_same_where_it_was_moved(
    folder: Path,
) -> None:
    first = job_id(job_spec(job("own_task.py:OpenField"), JobSettings()))
    (folder / "moved").mkdir()
    shutil.copy("own_task.py", "moved/own_task.py")
    assert job_id(job_spec(job("moved/own_task.py:OpenField"), JobSettings())) == first
    (folder / "own_task.py").write_text(TASK.replace("-0.2, reached", "-0.3, reached"))
    assert job_id(job_spec(job("own_task.py:OpenField"), JobSettings())) != first


def test_a_scenario_keeps_its_file_in_another_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = Scenario("own_task.py:OpenField")
    save_scenarios([scenario], "field.yaml")
    (folder / "other").mkdir()
    monkeypatch.chdir(folder / "other")
    assert load_scenarios(folder / "field.yaml") == (scenario,)
    assert scenario.task == f"{folder / 'own_task.py'}:OpenField"


@pytest.mark.usefixtures("folder")
def test_it_is_a_suite_of_its_own() -> None:
    results = bench("own_task.py:OpenField,maze-2d-3", ["straight"], episodes=2, workers=0)
    ran = {(row.task, row.seed) for row in results.rows}
    assert ran == {("OpenField", 0), ("OpenField", 1), ("maze", 0), ("maze", 1)}
    assert all(row.success for row in results.rows)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("task", "said"),
    [
        ("own_task.py", "names no class or function: give own_task.py:FieldVariations or own_"),
        ("own_task.py:Openfield", "did you mean 'OpenField'?"),
        ("none.py:OpenField", "there is no file"),
        ("own_task.py:SQUARE", "must be a class or a function"),
        ("own_robot.py:slab", "must be a class below pushplan.envs.tasks.Task"),
        ("mase", "unknown task 'mase'; did you mean 'maze'?"),
    ],
)
def test_what_is_no_task_is_refused_in_a_line(
    task: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "--task", task, "--policy", "straight"]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
def test_it_has_no_third_dimension(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--simulator", "mujoco", "--policy", "straight"]
    assert main(["run", "--task", "own_task.py:OpenField", *arguments]) == 2
    assert "needs a preset with a third dimension" in capsys.readouterr().err
    with pytest.raises(ScenarioError, match=r"third dimension.*valid: turtlebot3"):
        PushEnv(task="maze", simulator="mujoco", variations={"robot": "own_robot.py:slab"})


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("task", ["maze", "area_clearing", "box_delivery", "rearrange", "office"])
def test_a_robot_of_a_file_drives_in_every_task_that_has_robots(task: str) -> None:
    env = PushEnv(task=task, variations={"robot": "own_robot.py:slab"})
    env.reset(seed=0)
    assert env.world.robot.mass == 5.0


@pytest.mark.usefixtures("folder")
def test_what_makes_no_robot_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="must be a RobotModel, got None"):
        make_robot("own_robot.py:nothing", "differential")
    with pytest.raises(InvalidInputError, match=r"cannot load robot .*valid: nothing, slab"):
        make_robot("own_robot.py:flat", "differential")


@pytest.mark.parametrize("task", ["a:b:", "own.py:1", "x\n:y", ":Name", "../maze"])
def test_a_scenario_takes_no_other_text_for_a_task(task: str) -> None:
    with pytest.raises(SchemaError, match="plain name"):
        Scenario(task)
