"""Every file of examples/ runs as shipped, and is named on the page about them."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from pushplan.cli import main
from pushplan.envs import make
from pushplan.evaluation import JobSettings, Results, run_episode
from pushplan.evaluation.run.policy_specs import parse_policy
from pushplan.learned import learned_names
from pushplan.metrics import compute
from pushplan.planners import Deadline, MaxIterations, make_planner, make_policy, policy_names
from pushplan.scenarios import suite, suite_names
from pushplan.world import PlanStatus, Twist, load_world, stream

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
WORLDS = ("room", "blocked_door", "office_map", "ice_field")
STUDIES = ("study", "paper", "full_study", "mppi_study", "ship_study")


def world(name):
    return load_world(EXAMPLES / f"{name}.yaml")


def run(*arguments, timeout=500):
    """The output of an example in a process of its own, which must end well."""
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_page_names_every_example():
    page = (ROOT / "docs" / "examples.md").read_text("utf-8")
    there = {path.name for path in EXAMPLES.iterdir() if not path.name.startswith(("_", "."))}
    assert set(re.findall(r"\(\.\./examples/([\w.]+)\)", page)) == there


class TestWorlds:
    @pytest.mark.parametrize("name", WORLDS)
    def test_the_command_line_plans_and_draws(self, name, tmp_path, capsys):
        picture = tmp_path / "plan.png"
        call = ["plan", str(EXAMPLES / f"{name}.yaml"), "--planner", "straight"]
        assert main([*call, "--render", str(picture)]) == 0
        assert picture.stat().st_size > 1000

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("name", "planner"),
        [
            ("room", "push-aware"),
            ("blocked_door", "namo"),
            ("office_map", "push-aware"),
            ("office_map", "kinodynamic-rrt"),
            ("ice_field", "ship-predictive"),
            ("ice_field", "ship-lattice"),
        ],
    )
    def test_the_planner_that_it_is_for_solves_it(self, name, planner, tmp_path, capsys):
        picture = tmp_path / "plan.png"
        call = ["plan", str(EXAMPLES / f"{name}.yaml"), "--planner", planner]
        assert main([*call, "--render", str(picture)]) == 0
        assert f"{planner}: solved" in capsys.readouterr().out and picture.is_file()

    @pytest.mark.slow
    def test_the_door_is_opened_on_purpose(self):
        result = make_planner("namo").plan(world("blocked_door"), rng=stream(0, "policy"))
        first, last = result.plan.object_poses[0, 0], result.plan.object_poses[-1, 0]
        x, y, turn = last - first
        assert y > 0.4 and abs(x) < 0.15 and abs(turn) < 0.1  # along the wall

    @pytest.mark.parametrize("planner", ["push-aware", "kinodynamic-rrt", "namo"])
    def test_the_box_in_the_door_of_the_room_is_pushed_although_there_is_a_way_around(
        self, planner
    ):
        room = world("room")
        around = replace(room, movables=room.movables.holding_fixed([True, False]))
        plan = make_planner(planner).plan(room, stop=MaxIterations(500)).plan
        moved = np.hypot(*(plan.object_poses[-1] - plan.object_poses[0])[:, :2].T)
        assert moved[0] > 0.1 and moved[1] == 0.0
        longer = make_planner("push-aware").plan(around, stop=MaxIterations(500)).plan
        assert longer.cost > plan.cost

    def test_the_office_is_read_from_its_map(self):
        office = world("office_map")
        assert office.static.bounds.tolist() == [-6.0, -4.0, 6.0, 4.0]
        assert len(office.static.polygons) > 20 and len(office.movables) == 5


class TestPlanner:
    @pytest.fixture
    def planner(self):
        return runpy.run_path(str(EXAMPLES / "my_planner.py"))["GridAStar"]()

    def test_it_finds_the_goal_round_walls_and_boxes(self, planner):
        for name in ("room", "ice_field"):
            scene = world(name)
            plan = planner.plan(scene).plan
            assert scene.goal.distance(*plan.poses[-1, :2]) == 0.0
        assert np.hypot(*(plan.poses[0] - scene.robot_pose)[:2]) == 0.0

    def test_it_obeys_its_stop_rule(self, planner):
        room = world("room")
        assert planner.plan(room, stop=MaxIterations(3)).status is PlanStatus.TIMED_OUT
        assert planner.plan(room, stop=Deadline(120.0)).status.has_plan


class TestPolicies:
    @pytest.mark.slow
    def test_the_teacher_keeps_further_from_walls(self, tmp_path, capsys):
        wide = f"wide={EXAMPLES / 'wide_teacher.py'}:teacher"
        for name, policy in (("wide", wide), ("own", "push-aware-constant-speed")):
            call = ["--policy", policy, "--task", "maze", "--episodes", "1"]
            assert main(["dataset", "export", *call, "--out", str(tmp_path / name)]) == 0
            assert "1 successes" in capsys.readouterr().out
        nearest = {  # rays of features: 1 touches a wall, at a range of 6 m
            name: np.load(tmp_path / name / "data" / "episode_00000.npz")["observations"][:, 10:34]
            for name in ("wide", "own")
        }
        gap = 6.0 * (nearest["own"].max() - nearest["wide"].max())  # [m]
        assert gap > 0.1

    def test_bull_turns_towards_the_goal(self):
        bull = parse_policy(f"{EXAMPLES / 'my_policy.py'}:Bull").make()
        ahead = world("room").moved(robot_pose=[1.0, 1.0, np.pi / 4])
        bull.reset(ahead, np.random.default_rng(0))
        assert bull.act(ahead, None) == Twist(ahead.robot.max_speed, 0.0)
        assert bull.act(ahead.moved(robot_pose=[1.0, 1.0, 0.0]), None).angular > 1.0

    @pytest.mark.slow
    def test_planner_and_policies_drive(self, tmp_path):
        named = f"{EXAMPLES}/my_planner.py:GridAStar,{EXAMPLES}/my_policy.py:Pursuer"
        call = ["bench", "maze-2d-5", "--policies", named, "--episodes", "3", "--workers", "0"]
        assert main([*call, "--out", str(tmp_path / "bench")]) == 0
        rows = (tmp_path / "bench" / "results.csv").read_text().splitlines()
        assert len(rows) == 7 and all(",done,goal," in row for row in rows[1:])


class TestStudies:
    @pytest.mark.parametrize("name", STUDIES)
    def test_a_study_names_what_there_is(self, name):
        study = yaml.safe_load((EXAMPLES / f"{name}.yaml").read_text("utf-8"))
        suites = {one if isinstance(one, str) else one["suite"] for one in study["suites"]}
        policies = {one if isinstance(one, str) else one["policy"] for one in study["policies"]}
        assert suites <= set(suite_names())
        assert policies <= {"all", *policy_names(), *learned_names()}

    @pytest.mark.slow
    def test_the_short_one_runs(self, tmp_path):
        out = tmp_path / "study"
        call = ["experiment", str(EXAMPLES / "study.yaml"), "--out", str(out), "--workers", "1"]
        assert main(call) == 0
        stored = Results.load(out)
        assert not any(row.failed for row in stored.rows)
        speeds = [stored.measured[row.job]["my_metric.py:mean_speed"] for row in stored.rows]
        assert all(0.0 < speed <= 0.15 for speed in speeds)


def test_the_metric_is_one_of_an_episode():
    metric = runpy.run_path(str(EXAMPLES / "my_metric.py"))["mean_speed"]
    scenario = suite("maze-2d-3").scenarios[0]
    episode = run_episode(make(scenario, observation="state"), make_policy("straight"), scenario)
    assert metric(episode) == pytest.approx(0.15, rel=0.02)  # it drives at constant speed
    assert "E_nav" in compute(episode)


@pytest.mark.slow
def test_the_control_loop_arrives():
    """In real time, so a busy machine may spoil a drive: one of three has to arrive."""
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "examples/control_loop.py"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        said = done.stdout
        assert re.search(r"driving\s*\n.*stale\s+the newest world is .* old\n.*driving", said), said
        if done.returncode == 0:
            return
    raise AssertionError(done.stdout + done.stderr)


@pytest.mark.slow
def test_the_client_drives_with_a_server_of_its_own():
    assert "at (1.00, 1.00)" in run("examples/serve_client.py")


@pytest.mark.slow
def test_predictive_control_over_a_simulator_drives():
    policy = parse_policy(f"{EXAMPLES / 'mppi_rollouts.py'}:over_pymunk").make()
    scenario = suite("maze-2d-5").scenarios[0]
    env = JobSettings().environment(scenario, policy)
    env.reset(seed=0)
    policy.reset(env.world, np.random.default_rng(0))
    before = env.world.robot_pose
    for _ in range(5):
        env.step(env.encode(policy.act(env.world, None)))
    assert np.hypot(*(env.world.robot_pose - before)[:2]) > 0.1


@pytest.mark.slow
@pytest.mark.learn
def test_a_network_is_trained_and_compared(tmp_path):
    said = run("examples/train_ppo.py", tmp_path / "ppo", 1024, 1)
    assert "straight" in said and "model" in said
    assert sorted(os.listdir(tmp_path / "ppo")) == ["bench", "model.pushplan.json", "model.zip"]
