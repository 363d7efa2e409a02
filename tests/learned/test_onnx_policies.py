from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from policy_files import (
    channel_model,
    finish,
    linear_model,
    map_specification,
    maze_specification,
    save,
    turning,
)

from pushplan.envs import PushEnv
from pushplan.evaluation import bench, parse_policy, run_episode
from pushplan.evaluation.run.jobs import JobSettings
from pushplan.evaluation.run.policy_specs import policy_names
from pushplan.learned import OnnxPolicy, learned_names, load_policy, onnx_policy
from pushplan.learned.loading import weights_of
from pushplan.learned.onnx_policy import read_specification
from pushplan.learned.outputs import ActionSpec, BadOutputError
from pushplan.scenarios import Scenario
from pushplan.world import InvalidInputError, UnknownNameError

pytestmark = pytest.mark.learn
onnx = pytest.importorskip("onnx", reason="needs the extra 'learn' (onnx)")
helper, TensorProto, numpy_helper = onnx.helper, onnx.TensorProto, onnx.numpy_helper


def graph(nodes, *, constants=(), inputs=None, outputs=None, kind=TensorProto.FLOAT):
    """A graph from a batch of maze states to turn rates, unless said otherwise."""
    return helper.make_graph(
        nodes,
        "policy",
        inputs or [helper.make_tensor_value_info("seen", kind, ["batch", 106])],
        outputs or [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 1])],
        list(constants),
    )


def constant(name, values):
    return numpy_helper.from_array(np.asarray(values), name)


def noisy(shape):
    """A graph that gives the sum of its noise, whatever is seen."""
    nodes = [
        helper.make_node("MatMul", ["seen", "none"], ["nothing"]),
        helper.make_node("ReduceSum", ["noise", "axis"], ["sum"], keepdims=1),
        helper.make_node("Add", ["nothing", "sum"], ["action"]),
    ]
    constants = [
        constant("none", np.zeros((106, 1), np.float32)),
        constant("axis", np.array([1], np.int64)),
    ]
    inputs = [
        helper.make_tensor_value_info("seen", TensorProto.FLOAT, ["batch", 106]),
        helper.make_tensor_value_info("noise", TensorProto.FLOAT, shape),
    ]
    return graph(nodes, constants=constants, inputs=inputs)


class TestGood:
    def test_it_drives(self, tmp_path):
        policy = OnnxPolicy(turning(tmp_path / "turn.onnx"))
        scenario = Scenario("maze", "pymunk", "benchmark", {"boxes": 3}, 1000)
        env = JobSettings().environment(scenario, policy)
        episode = run_episode(env, policy, scenario)
        assert np.allclose(episode.actions, 0.25)
        assert policy.actions == ("turn_rate",)
        assert policy.label == "turn"

    def test_a_decision_stands_as_long_as_it_was_trained_to(self, tmp_path):
        spec = maze_specification(action=ActionSpec("turn_rate", "continuous", (1,), repeat=3))
        weights = np.zeros((106, 1))
        weights[0] = 0.05  # x of the robot
        policy = OnnxPolicy(save(linear_model(spec, weights), tmp_path / "x.onnx"))
        env = PushEnv(task="maze", observation=policy.observation)
        seen, _ = env.reset(seed=1000)
        policy.reset(env.world, np.random.default_rng(0))
        actions = []
        for _ in range(6):
            actions.append(float(policy.act(env.world, seen)[0]))
            seen, *_ = env.step([actions[-1]])
        assert actions[0] == actions[1] == actions[2] != actions[3]
        policy.reset(env.world, np.random.default_rng(0))
        assert policy.act(env.world, seen) == policy.act(env.world)  # made from the world

    def test_a_map_sends_the_robot_to_its_best_pixel(self, tmp_path):
        spec = map_specification()
        policy = OnnxPolicy(save(channel_model(spec, 1), tmp_path / "stay.onnx"))
        env = PushEnv(task="box_delivery", observation=policy.observation, action="waypoint")
        seen, _ = env.reset(seed=1000)
        policy.reset(env.world, np.random.default_rng(0))
        action = policy.act(env.world, seen)  # the footprint is where the robot is
        assert np.abs(action).max() <= 0.15

    def test_the_same_observation_gives_the_same_action(self, tmp_path):
        rng = np.random.default_rng(0)
        path = save(linear_model(maze_specification(), rng.normal(size=(106, 1))), tmp_path / "r")
        seen = rng.normal(size=106).astype(np.float32)
        assert OnnxPolicy(path).decide(seen) == OnnxPolicy(path).decide(seen)

    def test_noise_is_of_the_episode(self, tmp_path):
        spec = maze_specification()
        path = save(finish(noisy(["batch", 2]), spec), tmp_path / "noisy.onnx")
        policy = OnnxPolicy(path)
        env = PushEnv(task="maze", observation=policy.observation)
        seen, _ = env.reset(seed=1000)
        rows = []
        for seed in (0, 0, 1):
            policy.reset(env.world, np.random.default_rng(seed))
            rows.append([float(policy.act(env.world, seen)[0]) for _ in range(4)])
        assert rows[0] == rows[1] != rows[2]
        assert len(set(rows[0])) > 1
        assert policy.decide(seen, np.float32([0.5, 0.25])) == pytest.approx([0.75])

    @pytest.mark.parametrize("shape", [["batch", "any"], ["batch", 2, 1], [3, 2], ["batch", 5000]])
    def test_noise_of_another_shape(self, tmp_path, shape):
        path = save(finish(noisy(shape), maze_specification()), tmp_path / "noisy.onnx")
        with pytest.raises(
            InvalidInputError, match=r"'noise' must be float32 of shape \(batch, N\)"
        ):
            OnnxPolicy(path)

    @pytest.mark.usefixtures("cpu_time")
    def test_it_takes_little_time(self, tmp_path):
        import time

        policy = OnnxPolicy(turning(tmp_path / "turn.onnx"))
        seen = np.zeros(106, np.float32)
        times = []
        for _ in range(50):
            began = time.perf_counter()
            policy.decide(seen)
            times.append(time.perf_counter() - began)
        assert min(times) < 0.005

    def test_names_labels_and_identity(self, tmp_path):
        path = turning(tmp_path / "my turn.onnx")
        spec = parse_policy(f"onnx:{tmp_path / 'my turn'}")  # without the ending
        assert spec.label == "my_turn"
        assert parse_policy(f"mine=onnx:{path}").label == "mine"
        before = spec.identity
        turning(path, 0.5)
        assert spec.identity != before
        assert isinstance(spec.make(), OnnxPolicy)
        assert set(learned_names()) <= set(policy_names())
        assert read_specification(path) == maze_specification()

    @pytest.mark.parametrize("name", learned_names())
    def test_what_ships_is_small_and_says_what_it_is(self, name):
        path = weights_of(name)
        assert path.stat().st_size <= 2 * 2**20
        card = path.with_suffix(".md").read_text(encoding="utf-8")
        assert "## Scores" in card and "Not scored" not in card
        policy = load_policy(name)
        assert policy.specification.tasks and policy.label == name
        seen = np.zeros(policy.observation.shape, policy.observation.dtype)
        assert len(policy.specification.action.steps(policy.decide(seen)))

    @pytest.mark.slow
    def test_bench_compares_it(self, tmp_path):
        path = turning(tmp_path / "turn.onnx", 0.0)
        results = bench("maze-2d-3", [f"onnx:{path}", "straight"], episodes=2, workers=0)
        assert [row.status for row in results.rows] == ["done"] * 4
        assert {row.policy for row in results.rows} == {"turn", "straight"}


class TestMismatch:
    def test_a_job_on_another_task_says_both(self, tmp_path):
        path = turning(tmp_path / "turn.onnx")
        with pytest.raises(InvalidInputError, match=r"cannot run ship_ice .*: made for task maze"):
            bench("ship-ice-2d-10", [f"onnx:{path}"], episodes=1, workers=0)

    def test_preset_robot_and_observation(self, tmp_path):
        policy = OnnxPolicy(turning(tmp_path / "turn.onnx"))
        small = Scenario("maze", "mujoco", "testbed", {"boxes": 3}, 0)
        with pytest.raises(InvalidInputError, match="preset benchmark, the environment has testb"):
            JobSettings().environment(small, policy)
        env = PushEnv(task="maze", observation="state", action="velocity")
        env.reset(seed=0)
        with pytest.raises(InvalidInputError, match="drive 'constant_speed' where the robot"):
            policy.reset(env.world, np.random.default_rng(0))
        with pytest.raises(InvalidInputError, match=r"float32 of shape \(106,\).* uint8 of shape"):
            policy.act(env.world, np.zeros((4, 8, 8), np.uint8))

    def test_numbers_that_are_none(self, tmp_path):
        spec = maze_specification()
        path = save(linear_model(spec, np.full((106, 1), 1e38)), tmp_path / "big.onnx")
        env = PushEnv(task="maze", observation="state")
        seen, _ = env.reset(seed=0)
        with pytest.raises(BadOutputError, match="'big': the network gave values that are not"):
            OnnxPolicy(path).act(env.world, seen)


class TestHostile:
    """One clear error, and nothing has been run."""

    def refused(self, path: Path, message: str) -> None:
        with pytest.raises(InvalidInputError, match=message):
            OnnxPolicy(path)

    def test_no_file_and_names(self, tmp_path):
        self.refused(tmp_path / "no.onnx", "no such file")
        with pytest.raises(InvalidInputError, match="there is no file"):
            parse_policy(f"onnx:{tmp_path / 'no'}")
        with pytest.raises(InvalidInputError, match="the file is missing"):
            load_policy("onnx:")
        with pytest.raises(UnknownNameError):
            load_policy("maze-nothing")

    @pytest.mark.parametrize(
        "data",
        [b"", b"\x00" * 64, b"hello, this is text", b"PK\x03\x04" + b"x" * 90, b"\xff" * 500],
    )
    def test_what_is_no_onnx(self, tmp_path, data):
        path = tmp_path / "x.onnx"
        path.write_bytes(data)
        self.refused(path, "is no policy")

    def test_every_truncation(self, tmp_path):
        whole = turning(tmp_path / "whole.onnx").read_bytes()
        path = tmp_path / "part.onnx"
        for size in [*range(0, len(whole), max(1, len(whole) // 60)), len(whole) - 1]:
            path.write_bytes(whole[:size])
            self.refused(path, "is no policy")

    def test_flipped_bytes_never_crash(self, tmp_path):
        whole = bytearray(turning(tmp_path / "whole.onnx").read_bytes())
        path = tmp_path / "flipped.onnx"
        rng = np.random.default_rng(0)
        for _ in range(60):
            bad = bytearray(whole)
            for at in rng.integers(len(bad), size=3):
                bad[at] = rng.integers(256)
            path.write_bytes(bad)
            try:
                OnnxPolicy(path)
            except (InvalidInputError, UnknownNameError):
                pass

    def test_without_a_specification(self, tmp_path):
        model = linear_model(maze_specification(), np.zeros((106, 1)))
        del model.metadata_props[:]
        self.refused(save(model, tmp_path / "x.onnx"), "no specification")

    def test_weights_in_another_file(self, tmp_path):
        model = linear_model(maze_specification(), np.zeros((106, 1)))
        tensor = model.graph.initializer[0]
        tensor.ClearField("raw_data")
        tensor.data_location = TensorProto.EXTERNAL
        for key, value in (("location", "../../../../etc/passwd"), ("length", "424")):
            entry = tensor.external_data.add()
            entry.key, entry.value = key, value
        self.refused(save(model, tmp_path / "x.onnx"), "another file")
        tensor.data_location = TensorProto.DEFAULT  # the field alone is enough
        self.refused(save(model, tmp_path / "x.onnx"), "another file")

    @pytest.mark.parametrize(
        ("operator", "domain"),
        [("Evil", "my.domain"), ("PyOp", "ai.onnx.contrib"), ("Loop", ""), ("RandomNormal", "")],
    )
    def test_operators_that_are_not_run(self, tmp_path, operator, domain):
        nodes = [helper.make_node(operator, ["seen"], ["action"], domain=domain)]
        self.refused(save(finish(graph(nodes), maze_specification()), tmp_path / "x"), operator)
        opsets = [helper.make_opsetid("", 17), helper.make_opsetid("my.domain", 1)]
        nodes = [helper.make_node("Identity", ["seen"], ["action"])]
        model = finish(graph(nodes), maze_specification(), opsets)
        self.refused(save(model, tmp_path / "y"), "domain 'my.domain'")

    def test_a_graph_in_a_node(self, tmp_path):
        inner = helper.make_graph([], "inner", [], [])
        nodes = [helper.make_node("Identity", ["seen"], ["action"], body=inner)]
        self.refused(save(finish(graph(nodes), maze_specification()), tmp_path / "x"), "a graph")

    def test_functions(self, tmp_path):
        model = linear_model(maze_specification(), np.zeros((106, 1)))
        function = model.functions.add()
        function.name = "f"
        self.refused(save(model, tmp_path / "x.onnx"), "functions")

    def test_a_tensor_of_any_size(self, tmp_path):
        model = linear_model(maze_specification(), np.zeros((106, 1)))
        del model.graph.initializer[0].dims[:]
        model.graph.initializer[0].dims.extend([2**31, 2**31])
        self.refused(save(model, tmp_path / "x.onnx"), "larger than")

    def test_values_that_grow_without_bound(self, tmp_path):
        nodes, last = [], "seen"
        for i in range(40):
            nodes.append(helper.make_node("Concat", [last, last], [f"c{i}"], axis=0))
            last = f"c{i}"
        nodes.append(helper.make_node("ReduceMax", [last], ["action"], keepdims=1))
        self.refused(save(finish(graph(nodes), maze_specification()), tmp_path / "x"), "be run")

    def test_constants_that_grow_without_bound(self, tmp_path):
        nodes, last = [], "one"
        for i in range(40):
            nodes.append(helper.make_node("Concat", [last, last], [f"c{i}"], axis=0))
            last = f"c{i}"
        nodes += [
            helper.make_node("ReduceMax", [last], ["most"], keepdims=1),
            helper.make_node("ReduceMax", ["seen"], ["least"], axes=[1], keepdims=1),
            helper.make_node("Add", ["most", "least"], ["action"]),
        ]
        model = graph(nodes, constants=[constant("one", np.ones((1, 1), np.float32))])
        self.refused(save(finish(model, maze_specification()), tmp_path / "x"), "be run|not take")

    def test_a_network_that_takes_forever(self, tmp_path, monkeypatch):
        monkeypatch.setattr(onnx_policy, "LONGEST_DECISION_S", 0.05)
        side = np.zeros((700, 700), np.float32)
        nodes = [helper.make_node("MatMul", ["side", "side"], ["m0"])]
        nodes += [helper.make_node("MatMul", [f"m{i}", "side"], [f"m{i + 1}"]) for i in range(400)]
        nodes += [
            helper.make_node("ReduceMax", ["m400"], ["most"], keepdims=1),
            helper.make_node("ReduceMax", ["seen"], ["least"], axes=[1], keepdims=1),
            helper.make_node("Add", ["most", "least"], ["action"]),
        ]
        model = finish(graph(nodes, constants=[constant("side", side)]), maze_specification())
        self.refused(save(model, tmp_path / "x.onnx"), "takes more than")

    def test_shapes_and_types(self, tmp_path):
        spec = maze_specification()
        wide = linear_model(maze_specification(), np.zeros((106, 2)))
        self.refused(save(wide, tmp_path / "wide"), r"of shape \(batch, 1\) by its specification")
        double = finish(
            graph([helper.make_node("Identity", ["seen"], ["action"])], kind=TensorProto.DOUBLE),
            spec,
        )
        self.refused(save(double, tmp_path / "double"), "is no policy")
        narrow = linear_model(spec, np.zeros((106, 1)))
        narrow.graph.input[0].type.tensor_type.shape.dim[1].dim_value = 7
        self.refused(save(narrow, tmp_path / "narrow"), "is no policy")
        two = linear_model(spec, np.zeros((106, 1)))
        two.graph.output.append(helper.make_tensor_value_info("sum", TensorProto.FLOAT, None))
        self.refused(save(two, tmp_path / "two"), "one input and one output")
        lost = graph(
            [helper.make_node("ReduceMax", ["seen"], ["action"], axes=[0, 1], keepdims=0)],
            outputs=[helper.make_tensor_value_info("action", TensorProto.FLOAT, [])],
        )
        self.refused(save(finish(lost, spec), tmp_path / "lost"), "by its specification")

    def test_a_network_of_nan(self, tmp_path):
        path = save(linear_model(maze_specification(), np.zeros((106, 1)), np.nan), tmp_path / "x")
        self.refused(path, "not finite")


def test_no_learning_library_is_needed(tmp_path):
    """Neither to load nor to run a network."""
    path = turning(tmp_path / "turn.onnx")
    code = f"""
import sys
for name in ("torch", "stable_baselines3", "onnx", "pymunk", "mujoco", "gymnasium", "matplotlib"):
    sys.modules[name] = None  # importing it raises
import numpy as np
from pushplan.learned import load_policy
print(load_policy("onnx:{path}").decide(np.zeros(106, np.float32))[0])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) == 0.25
