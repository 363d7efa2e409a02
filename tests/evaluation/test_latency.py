"""The mode in which the world goes on while a policy computes."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from evaluation_doubles import HERE, Ahead, LineEnv, LineScenario

from pushplan.cli import main
from pushplan.control import clamp_twist
from pushplan.envs import PushEnv
from pushplan.evaluation import (
    Job,
    JobSettings,
    Results,
    bench,
    parse_policy,
    run_batch,
    run_episode,
)
from pushplan.planners import PlanFollower, make_planner, make_policy
from pushplan.scenarios import Scenario, suite
from pushplan.world import Drive, Episode, InvalidInputError, Twist

pytestmark = pytest.mark.usefixtures("empty_figures")
MAZE = suite("maze-2d-3", episodes=1).scenarios[0]


class Ticks:
    """A clock in which everything that is timed takes the same time."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.shown = 0.0

    def __call__(self) -> float:
        self.shown += self.seconds
        return self.shown


class Turns:
    """Turns one way, then the other; remembers what it was shown."""

    def reset(self, world, rng) -> None:
        self.times: list[float] = []

    def act(self, world, observation):
        self.times.append(world.time)
        return Twist(0.15, 0.05 if len(self.times) % 2 else -0.05)


class Thinks(Turns):
    """A policy of whose time one tick goes on beside driving."""

    def plan_with(self, executor) -> None:
        self.executor = executor

    def act(self, world, observation):
        self.executor.submit(lambda stop: None, world.time)
        return super().act(world, observation)


class Planning:
    """A planner for each of whose calls the clock goes on by ten seconds."""

    def __init__(self) -> None:
        self.now = 0.0
        self.planner = make_planner("kinodynamic-rrt")

    def plan(self, world, *, stop=None, rng=None):
        self.now += 10.0
        return self.planner.plan(world, stop=stop, rng=rng)


class SlowPlanner(PlanFollower):
    def __init__(self) -> None:
        super().__init__(Planning())

    def clock(self) -> float:
        return self.planner.now


class Waits:
    """Plans while the robot waits for its command."""

    def __init__(self) -> None:
        self.inner = SlowPlanner()
        self.clock, self.reset, self.act = self.inner.clock, self.inner.reset, self.inner.act


def length(episode: Episode) -> float:
    return float(np.hypot(*np.diff(episode.robot_poses[:, :2], axis=0).T).sum())


def maze(**options: object) -> PushEnv:
    return PushEnv(task="maze", observation="state", **options)


class TestStepLate:
    def test_no_lag_is_a_step(self):
        poses = []
        for late in (False, True):
            env = maze()
            env.reset(seed=3)
            for turn in (0.5, -1.0, 0.2):
                done = env.step_late([turn], 0.0) if late else env.step([turn])
                assert len(done) == 5
            poses.append((env.world, env.trace))
        assert poses[0] == poses[1]

    @pytest.mark.parametrize("lag", [0.03, 0.8, 1.0, 4.1])
    def test_the_last_command_goes_on(self, lag):
        late, reference = maze(), maze()
        for env in (late, reference):
            env.reset(seed=3)
            env.step([0.8])
        late.step_late([-0.5], lag)
        simulator = reference._simulator
        limit = reference.task.robot.max_turn_rate
        simulator.step(Twist(0.15, np.float32(0.8) * limit), lag)
        simulator.step(Twist(0.15, -0.5 * limit), 0.8)
        assert late.world.robot_pose == pytest.approx(simulator.robot_pose, abs=1e-6)
        assert late.world.time == pytest.approx(0.8 + lag + 0.8)
        assert late.trace.times[0] < 0.8 + max(lag, 0.1)
        assert np.all(np.diff(late.trace.times) > 0.0)

    @pytest.mark.parametrize(("drive", "metres"), [("constant_speed", 0.15), ("differential", 0.0)])
    def test_before_the_first_command(self, drive, metres):
        task, action = ("maze", "turn_rate") if metres else ("area_clearing", "velocity")
        env = PushEnv(task=task, action=action, observation="state")
        env.reset(seed=1)
        start = env.world
        assert start.robot.drive is Drive(drive)
        env.step_late(env.encode(clamp_twist(start.robot, 0.0, 0.0)), 1.0)
        moved = np.hypot(*(env.world.robot_pose - start.robot_pose)[:2])
        assert moved == pytest.approx(metres * (1.0 + env.task.control_step), abs=1e-9)

    def test_after_an_action_of_many_steps_it_stands(self):
        worlds = []
        for lag in (0.0, 3.3):
            env = PushEnv(task="area_clearing", action="heading", observation="state")
            env.reset(seed=1)
            env.step([0.3])
            env.step_late([0.1], lag)
            worlds.append(env.world)
        assert worlds[1].robot_pose == pytest.approx(worlds[0].robot_pose, abs=1e-9)
        assert worlds[1].time == pytest.approx(worlds[0].time + 3.3)

    def test_the_episode_may_end_while_it_waits(self):
        env = maze(variations={"boxes": 0})
        env.reset(seed=0)
        done = env.step_late([0.0], 500.0)
        assert done[2] and done[4]["reason"] == "wall"
        assert env.world.time < 120.0

    @pytest.mark.slow
    def test_waiting_counts_for_the_time_limit(self):
        env = PushEnv(task="area_clearing", action="velocity", observation="state")
        env.reset(seed=0)
        *_, truncated, info = env.step_late([0.0, 0.0], 4000.0)
        assert truncated and info["reason"] in ("time_limit", "no_progress")

    @pytest.mark.parametrize("lag", [-1.0, np.nan, np.inf, "x"])
    def test_a_lag_is_a_time(self, lag):
        env = maze()
        env.reset(seed=0)
        with pytest.raises(InvalidInputError, match="lag"):
            env.step_late([0.0], lag)


class TestRunEpisode:
    def test_the_clock_of_the_world_goes_on_by_the_time_times_the_factor(self):
        policy = Turns()
        env = maze(variations={"time_limit": 30.0})
        episode = run_episode(env, policy, MAZE, latency_factor=3.0, clock=Ticks(0.1))
        assert np.diff(policy.times) == pytest.approx(0.8 + 0.3)
        assert episode.about["latency_factor"] == 3.0
        assert (np.diff(episode.times) > 0.0).all()

    def test_it_repeats_with_the_same_clock(self):
        one, other = (
            run_episode(
                maze(), make_policy("kinodynamic-rrt"), MAZE, latency_factor=5.0, clock=Ticks(0.2)
            )
            for _ in range(2)
        )
        assert one == other
        assert one.success

    def test_no_time_is_the_frozen_world(self):
        class Instant(Ticks):
            def __call__(self) -> float:
                return 0.0

        env = maze(variations={"time_limit": 30.0})
        frozen = run_episode(env, Turns(), MAZE)
        instant = run_episode(env, Turns(), MAZE, latency_factor=1.0, clock=Instant(0.0))
        assert frozen == instant
        assert "latency_factor" not in frozen.about

    def test_what_goes_on_beside_driving_does_not_hold_the_robot(self):
        policy = Thinks()
        run_episode(maze(), policy, MAZE, latency_factor=2.0, clock=Ticks(1.0))
        # of the three ticks of a call one is the planning's own
        assert np.diff(policy.times) == pytest.approx(0.8 + 2.0 * 2.0)

    @pytest.mark.slow
    def test_slow_planning_costs_a_plan_follower_little(self):
        """It drives the old plan until the new one is there; one that waits for it does not."""
        frozen = run_episode(maze(), make_policy("kinodynamic-rrt"), MAZE)
        beside, waiting = (
            run_episode(maze(), policy, MAZE, latency_factor=1.0, clock=policy.clock)
            for policy in (SlowPlanner(), Waits())
        )
        assert beside.success
        assert length(beside) < 1.05 * length(frozen)
        assert not waiting.success or length(waiting) > length(beside)

    def test_an_environment_that_cannot(self):
        scenario = LineScenario(0)
        with pytest.raises(InvalidInputError, match="step_late"):
            run_episode(LineEnv(scenario), Ahead(), scenario, latency_factor=1.0)

    @pytest.mark.parametrize("factor", [-1.0, np.nan, np.inf, "1", True])
    def test_a_factor_is_a_number(self, factor):
        with pytest.raises(InvalidInputError, match="latency_factor"):
            run_episode(maze(), Turns(), MAZE, latency_factor=factor)
        with pytest.raises(InvalidInputError, match="latency_factor"):
            JobSettings(latency_factor=factor)


class TestBatch:
    def test_results_say_in_which_mode_they_were_made(self, tmp_path):
        results = bench([MAZE], [straight], workers=0, out=tmp_path, latency_factor=2.0)
        assert results.about["configuration"]["latency_factor"] == 2.0
        assert "latency-aware x 2" in results.table()
        assert "latency_factor 2" in results.report().read_text()
        trace = next((tmp_path / "episodes").glob("*.npz"))
        assert Episode.load(trace).about["latency_factor"] == 2.0

    def test_frozen_results_do_not_mention_it(self, tmp_path):
        results = bench([MAZE], [straight], workers=0, out=tmp_path)
        assert results.about["configuration"]["latency_factor"] is None
        assert "latency" not in results.table()

    def test_another_mode_is_another_result(self, tmp_path):
        jobs = [Job(parse_policy(straight), MAZE)]
        (still,) = run_batch(jobs, out=tmp_path, workers=0)
        (goes_on,) = run_batch(
            jobs, out=tmp_path, workers=0, settings=JobSettings(latency_factor=1.0)
        )
        assert goes_on.job != still.job
        assert "latency-aware x 1" in Results.load(tmp_path).table()

    @pytest.mark.slow
    def test_the_columns_are_the_same(self, tmp_path):
        for name, factor in (("frozen", None), ("honest", 1.0)):
            bench([MAZE], [straight], workers=0, out=tmp_path / name, latency_factor=factor)
        heads = [
            next(csv.reader((tmp_path / name / "results.csv").open()))
            for name in ("frozen", "honest")
        ]
        assert heads[0] == heads[1]
        assert Results.load(tmp_path / "honest").rows[0].status == "done"


def straight():
    return make_policy("straight")


class TestCommands:
    def test_bench(self, tmp_path, capsys):
        code = main(
            [
                *("bench", "maze-2d-3", "--policies", "straight", "--episodes", "1"),
                *("--workers", "0", "--latency", "1.0", "--out", str(tmp_path)),
            ]
        )
        assert code == 0
        assert "latency-aware x 1" in capsys.readouterr().out

    def test_run(self, capsys):
        assert main(["run", "maze-2d-3", "--policy", "straight", "--latency", "0.5"]) == 0
        assert "was 0.5 s for the robot" in capsys.readouterr().out

    @pytest.mark.parametrize("factor", ["0", "-1", "fast"])
    def test_bad_factors(self, factor, capsys):
        assert main(["run", "maze-2d-3", "--policy", "straight", "--latency", factor]) == 2


def test_a_foreign_environment_can_do_it_too():
    class Late(LineEnv):
        lags: list[float] = []  # noqa: RUF012

        def step_late(self, action, lag):
            self.lags.append(lag)
            return self.step(action)

    scenario = LineScenario(0)
    episode = run_episode(Late(scenario), Ahead(), scenario, latency_factor=2.0, clock=Ticks(0.5))
    assert Late.lags == [1.0] * len(episode.actions)
    assert HERE.endswith("evaluation_doubles.py")


def test_scenarios_do_not_know_about_it():
    assert "latency_factor" not in Scenario.from_dict(MAZE.to_dict()).to_dict()
