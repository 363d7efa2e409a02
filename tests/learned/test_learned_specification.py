from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from policy_files import map_specification, maze_specification

from pushplan.envs import PushEnv
from pushplan.learned import ActionSpec, FeatureObservation, RobotSpec, Specification
from pushplan.learned.network_policy import NetworkPolicy
from pushplan.learned.outputs import APART, BadOutputError
from pushplan.observation import ImageObservation
from pushplan.world import InvalidInputError, SchemaError, UnknownNameError
from pushplan.world.outline import transform


def changed(**changes: object) -> str:
    data = json.loads(maze_specification().to_json())
    for key, value in changes.items():
        where, _, inner = key.partition("__")
        if inner:
            data[where][inner] = value
        else:
            data[where] = value
    return json.dumps(data)


class TestJson:
    @pytest.mark.parametrize(
        "specification",
        [
            maze_specification(),
            map_specification(),
            maze_specification(observation=FeatureObservation(rays=8, objects=2, range=3.0)),
            maze_specification(tasks=(), presets=(), robot=None, control_step=0.0),
            maze_specification(action=ActionSpec("heading", "direction", (2,), repeat=3, step=1.5)),
        ],
    )
    def test_round_trip(self, specification):
        assert Specification.from_json(specification.to_json()) == specification

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("", "not valid JSON"),
            ("[1, 2]", "format"),
            ("[" * 5000, "nested 64 deep"),
            (changed(format="pushplan-policy/99"), "reads 'pushplan-policy/1'"),
            (changed(extra=1), "unknown key in the specification 'extra'"),
            (changed(tasks="maze"), "list of names"),
            (changed(control_step=float("inf")), "control_step"),
            (changed(robot={"drive": "tank"}), "robot"),
            (changed(robot__max_speed="fast"), "robot.max_speed"),
            (changed(training=[1]), "training"),
            (changed(observation=3), "observation"),
            (changed(observation__kind="pickle"), "unknown observation kind 'pickle'"),
            (changed(observation__shape=[7]), r"says float32 of shape \(7,\)"),
            (changed(observation__dtype="float64"), "says float64"),
            (changed(observation__max_objects=10**9), "too large"),
            (changed(action__mode="fly"), "unknown action mode"),
            (changed(action__output="pixel_values"), "belongs to action mode 'waypoint'"),
            (changed(action__shape=[3]), "cannot have shape"),
            (changed(action__shape=[-1]), "at least 1|must be in"),
            (changed(action__repeat=0), "repeat"),
            (changed(action__step=None), "action.step"),
        ],
    )
    def test_what_is_wrong_is_said(self, text, message):
        with pytest.raises((InvalidInputError, UnknownNameError), match=message):
            Specification.from_json(text)

    def test_a_long_text_is_refused(self):
        with pytest.raises(SchemaError, match="longer"):
            Specification.from_json(" " * 2_000_000)

    def test_own_builders_do_not_travel(self):
        class Mine:
            shape, dtype = (3,), np.dtype(np.float32)

        with pytest.raises(InvalidInputError, match="one of image, state, features"):
            maze_specification(observation=Mine()).to_json()


class TestEnvironment:
    def test_the_right_one_passes(self):
        env = PushEnv(task="maze", observation="state")
        NetworkPolicy(np.zeros, maze_specification()).check_environment(env)
        assert RobotSpec.of(env.task.robot) == maze_specification().robot

    def test_both_sides_are_named(self):
        env = PushEnv(task="maze", observation="state")
        for specification, message in (
            (maze_specification(tasks=("ship_ice",)), "task ship_ice, the environment has maze"),
            (maze_specification(control_step=0.5), r"control_step \[s\] 0.5.*has 0.8"),
            (
                maze_specification(observation=FeatureObservation(rays=8, objects=1)),
                r"shape \(35,\), the environment has \(106,\)",
            ),
        ):
            with pytest.raises(InvalidInputError, match=message):
                NetworkPolicy(np.zeros, specification).check_environment(env)

    def test_maps_have_the_window_that_waypoints_reach(self):
        spec = map_specification()
        env = PushEnv(task="box_delivery", action="waypoint", observation=spec.observation)
        NetworkPolicy(np.zeros, spec).check_environment(env)
        area = PushEnv(task="area_clearing", action="waypoint", observation=spec.observation)
        wide = map_specification(tasks=("area_clearing",), control_step=0.0)
        with pytest.raises(InvalidInputError, match=r"waypoint_window \[m\] 10, .* has 24"):
            NetworkPolicy(np.zeros, wide).check_environment(area)


class TestOutputs:
    def test_continuous_is_clipped(self):
        spec = ActionSpec("velocity", "continuous", (2,))
        assert spec.steps(np.array([-3.0, 0.5])).tolist() == [[-1.0, 0.5]]

    def test_a_chunk_is_carried_out_action_by_action(self):
        spec = ActionSpec("velocity", "chunk", (4, 2), repeat=3)
        chunk = np.array([[0.1, 0.2], [0.3, -7.0], [0.5, 0.6], [0.7, 0.8]])
        assert spec.steps(chunk) == pytest.approx(
            np.array([[0.1, 0.2], [0.3, -1.0], [0.5, 0.6]]), abs=1e-6
        )
        asked = []
        policy = NetworkPolicy(
            lambda seen: asked.append(seen) or chunk,
            maze_specification(robot=None, action=spec),
        )
        env = PushEnv(task="maze", observation="state")
        seen, _ = env.reset(seed=0)
        policy.reset(env.world, np.random.default_rng(0))
        done = [policy.act(env.world, seen).tolist()[0] for _ in range(4)]
        assert done == pytest.approx([0.1, 0.3, 0.5, 0.1])
        assert len(asked) == 2
        policy.reset(env.world, np.random.default_rng(0))
        assert policy.act(env.world, seen)[0] == pytest.approx(0.1)
        with pytest.raises(InvalidInputError, match=r"at most the 4 actions of a chunk, got 5"):
            ActionSpec("velocity", "chunk", (4, 2), repeat=5)

    @given(st.floats(-3.1, 3.1), st.floats(0.1, 50.0))
    def test_a_direction_is_a_heading(self, angle, size):
        spec = ActionSpec("heading", "direction", (2,), step=1.0)
        (action,) = spec.steps(size * np.array([np.cos(angle), np.sin(angle)]))
        assert action.shape == (1,)
        assert float(action[0]) * np.pi == pytest.approx(angle, abs=1e-5)

    @pytest.mark.parametrize(
        "output", [np.zeros(2), np.zeros((1, 1)), np.array([np.nan]), np.array(["a"])]
    )
    def test_what_is_no_action_is_refused(self, output):
        with pytest.raises(BadOutputError):
            ActionSpec("turn_rate", "continuous", (1,)).steps(output)

    def test_a_pixel_is_the_place_that_it_shows(self):
        env = PushEnv(task="box_delivery", observation="state", action="waypoint")
        env.reset(seed=1000)
        world = env.world
        view = ImageObservation(("movable",), (10.0, 10.0), (96, 96))
        spec = ActionSpec("waypoint", "pixel_values", (96, 96), window=10.0)
        shown = np.argwhere(view.observe(world)[0] == 255)
        assert len(shown) > 20
        centres = world.movables.poses[:, :2]
        for row, col in shown:
            at = transform(world.robot_pose, 5.0 * spec.chosen((row, col)))[0]
            assert np.hypot(*(centres - at).T).min() <= world.movables.radii[0] + 1e-6
        values = np.zeros((96, 96))
        values[tuple(shown[7])] = 1.0
        assert np.array_equal(spec.steps(values), spec.chosen(shown[7]))

    def test_a_tried_pixel_is_left_out_with_its_neighbours(self):
        spec = ActionSpec("waypoint", "pixel_values", (96, 96), window=10.0)
        values = np.random.default_rng(0).uniform(size=(96, 96))
        best = np.unravel_index(np.argmax(values), values.shape)
        assert spec.choose(values) == best
        second = spec.choose(values, [best])
        apart = np.abs(np.subtract(np.indices(values.shape).T, best)).max(axis=2).T
        assert apart[second] > 3
        assert values[second] == values[apart > 3].max()
        flat = ActionSpec("waypoint", "pixel_values", (32, 96), window=10.0)
        values = np.full((32, 96), 0.5)
        values[16, 48], values[16, 51], values[18, 48] = 1.0, 0.9, 0.8
        assert flat.choose(values, [(16, 48)]) == (18, 48)  # a pixel up is as far as three aside
        with pytest.raises(InvalidInputError, match="nothing to choose"):
            ActionSpec("turn_rate", "continuous", (1,)).choose(np.zeros(1))
        values = np.random.default_rng(0).uniform(size=(96, 96))
        everywhere = [(row, col) for row in range(96) for col in range(96)]
        assert spec.choose(values, everywhere) == best

    def test_a_tried_direction_is_left_out_with_its_neighbours(self):
        spec = ActionSpec("heading", "direction", (2,), step=1.75)
        ahead = np.array([2.0, 0.2])
        first = spec.choose(ahead)
        assert first == pytest.approx(math.atan2(0.2, 2.0))
        assert spec.choose(ahead, [first]) == pytest.approx(first + APART)
        assert spec.choose(ahead, [first + 0.1]) == pytest.approx(first + 0.1 - APART)
        back = np.array([-1.0, 0.0])  # across the seam of the circle
        beside = spec.choose(back, [np.pi - 0.1])
        assert math.remainder(beside + np.pi, math.tau) == pytest.approx(APART - 0.1)
        assert spec.choose(back, np.linspace(-3.0, 3.0, 20)) == pytest.approx(np.pi)
        with pytest.raises(InvalidInputError, match="nothing to choose"):
            ActionSpec("turn_rate", "continuous", (1,)).choose(np.zeros(1))


class TestNoRepeat:
    @pytest.fixture()
    def world(self):
        env = PushEnv(task="box_delivery", observation="state", action="waypoint")
        env.reset(seed=0)
        return env.world

    def policy(self, world, values):
        policy = NetworkPolicy(lambda seen: values, map_specification())
        policy.reset(world, np.random.default_rng(0))
        return policy

    def act(self, policy, world):
        return tuple(policy.act(world, np.zeros(policy.observation.shape, np.uint8)))

    @pytest.mark.parametrize(
        ("move", "is_elsewhere"),
        [
            ((0.0, 0.0, 0.0), False),
            ((0.04, 0.0, 0.01), False),  # by the width of less than a pixel
            ((0.0, 0.06, 0.0), True),
            ((0.0, 0.0, 0.03), True),
            ((0.0, 0.0, 2.0 * np.pi), False),
        ],
    )
    def test_a_pixel_that_led_nowhere_is_not_chosen_again(self, world, move, is_elsewhere):
        policy = self.policy(world, np.random.default_rng(1).uniform(size=(32, 32)))
        first = self.act(policy, world)
        moved = world.moved(robot_pose=world.robot_pose + move)
        assert (self.act(policy, moved) == first) == is_elsewhere

    def test_an_object_elsewhere_is_another_place(self, world):
        policy = self.policy(world, np.random.default_rng(1).uniform(size=(32, 32)))
        first = self.act(policy, world)
        poses = np.array(world.movables.poses)
        poses[3, 0] += 0.1
        assert self.act(policy, world.moved(movable_poses=poses)) == first
        poses[3, 0] -= 0.07
        poses[:, 2] += 1.0  # centres count
        assert self.act(policy, world.moved(movable_poses=poses)) != first
        fewer = replace(world, movables=world.movables.select(np.arange(4)))
        assert self.act(policy, fewer) == first

    def test_each_is_another_until_the_next_episode(self, world):
        policy = self.policy(world, np.random.default_rng(1).uniform(size=(32, 32)))
        chosen = [self.act(policy, world) for _ in range(21)]
        assert len(set(chosen)) == len(chosen)
        policy.reset(world, np.random.default_rng(0))
        assert [self.act(policy, world) for _ in range(21)] == chosen

    def test_it_goes_on_when_everything_was_tried(self, world):
        policy = self.policy(world, np.zeros((32, 32)))
        chosen = [self.act(policy, world) for _ in range(300)]
        assert len(set(chosen)) == 256  # neighbours go with each
        assert chosen[-1] == chosen[0]

    def test_a_direction_that_led_nowhere_is_not_chosen_again(self, world):
        action = ActionSpec("heading", "direction", (2,), step=1.75)
        spec = maze_specification(action=action, robot=None)
        policy = NetworkPolicy(lambda seen: np.array([1.0, 0.0], np.float32), spec)
        seen = np.zeros(policy.observation.shape, np.float32)
        chosen = [float(policy.act(world, seen)[0]) for _ in range(25)]
        assert chosen[0] == 0.0
        assert len(set(chosen[:20])) == 20  # a full turn of neighbours
        assert chosen[24] == 0.0  # everything was tried
        moved = world.moved(robot_pose=world.robot_pose + np.array([0.01, 0.0, 0.0]))
        assert float(policy.act(moved, seen)[0]) == 0.0
        policy.reset(world, np.random.default_rng(0))
        assert [float(policy.act(world, seen)[0]) for _ in range(25)] == chosen

    def test_other_outputs_repeat(self, world):
        policy = NetworkPolicy(lambda seen: np.array([0.5], np.float32), maze_specification())
        seen = np.zeros(policy.observation.shape, np.float32)
        assert [float(policy.act(world, seen)[0]) for _ in range(3)] == [0.5] * 3
