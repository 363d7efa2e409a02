"""Tiny trainings: they run, go on where they were left, and come out as files that work."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from pushplan.cli import main
from pushplan.envs import PushEnv
from pushplan.learned import FeatureObservation, OnnxPolicy
from pushplan.training.policies.config import (
    IMITATING,
    OPTIONS,
    TrainingConfig,
    config_named,
    read_config,
    shipped_configs,
)
from pushplan.training.policies.dataset import (
    episodes,
    read_metadata,
    record,
    to_minari,
)
from pushplan.training.policies.demonstrations import action_chunks
from pushplan.training.policies.environment import TRAINING_SEEDS, TrainingEnv
from pushplan.training.policies.training import train_policy, write_card
from pushplan.training.policies.training_run import CurvePoint, TrainingRun
from pushplan.world import InvalidInputError, SchemaError, UnknownNameError

SMALL = {"kind": "features", "rays": 4, "objects": 1, "range": 6.0}
IMAGE = {
    "kind": "image",
    "channels": ["footprint", "movable", "static", "goal_distance"],
    "window": [12.0, 12.0],
    "pixels": [36, 36],
}
MAP = {
    "kind": "image",
    "channels": ["occupancy", "footprint", "robot_distance", "goal_distance"],
    "window": [10.0, 10.0],
    "pixels": [16, 16],
}
TINY = {
    "ppo": {"rollout": 16, "batch": 16, "epochs": 1, "widths": [8]},
    "sac": {"first": 8, "batch": 8, "every": 4, "updates": 1, "buffer": 64, "widths": [8]},
    "sam": {
        "first": 6,
        "batch": 4,
        "buffer": 16,
        "widths": [4, 8],
        "blocks": 1,
        "every": 2,
        "lookahead": 2,
        "follow": 0.01,
    },
    "bc": {"batch": 16, "widths": [8]},
    "flow": {"batch": 16, "widths": [8, 8], "euler": 2, "waves": 2},
}


def tiny(algorithm: str, **changes: object) -> TrainingConfig:
    """A training of seconds."""
    data: dict[str, object] = {
        "algorithm": algorithm,
        "task": "maze",
        "scenarios": [{"boxes": 1}],
        "observation": SMALL,
        "action": {"mode": "turn_rate", "repeat": 8},
        "steps": 96,
        "chunk": 32,
        "envs": 2,
        "validation": 1,
        "limit": 4,
        "options": TINY[algorithm],
        "suites": ["maze-2d-3"],
    }
    if algorithm == "flow":
        data["action"] = {"mode": "turn_rate", "output": "chunk", "horizon": 8, "repeat": 4}
    if algorithm == "sam":
        data |= {
            "task": "box_delivery",
            "scenarios": [{"boxes": 1}],
            "observation": MAP,
            "action": {"mode": "waypoint", "output": "pixel_values"},
            "steps": 18,
            "chunk": 6,
            "validation": 0,
            "suites": [],
        }
    return TrainingConfig.from_dict({**data, **changes})


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of three short episodes."""
    from pushplan.planners import make_policy

    folder = tmp_path_factory.mktemp("data") / "maze"
    return record(tiny("bc"), make_policy("straight"), "straight", folder, episodes=3, noise=0.05)


def trained(config: TrainingConfig, folder: Path, data: Path, **options: object) -> Path | None:
    if config.algorithm in IMITATING:
        options["data"] = data
    return train_policy(config, folder, device="cpu", **options)


def behaviour(path: Path) -> np.ndarray:
    """What a network puts out for some observations."""
    policy = OnnxPolicy(path)
    rng = np.random.default_rng(0)
    shape, dtype = policy.observation.shape, policy.observation.dtype
    seen = rng.integers(0, 255, (5, *shape)) if dtype == np.uint8 else rng.normal(size=(5, *shape))
    return np.stack([policy.decide(one.astype(dtype)) for one in seen])


@pytest.mark.learn
class TestTraining:
    @pytest.mark.parametrize("algorithm", ["ppo", "sac", "sam", "bc", "flow"])
    @pytest.mark.slow
    def test_left_off_and_taken_up_it_ends_the_same(self, algorithm, tmp_path, data):
        config = tiny(algorithm)
        whole = trained(config, tmp_path / "whole", data)
        assert trained(config, tmp_path / "parts", data, until=lambda done: done == 2) is None
        with pytest.raises(InvalidInputError, match="--resume"):
            trained(config, tmp_path / "parts", data)
        parts = trained(config, tmp_path / "parts", data, resume=True)
        assert np.array_equal(behaviour(whole), behaviour(parts))
        drawn = (tmp_path / "whole" / "curve.png").read_bytes()
        assert drawn[:4] == b"\x89PNG"
        rows = [
            [line.split(",") for line in (tmp_path / part / "curve.csv").read_text().splitlines()]
            for part in ("whole", "parts")
        ]
        assert len(rows[0]) == 4
        assert [row[:1] + row[2:] for row in rows[0]] == [row[:1] + row[2:] for row in rows[1]]
        again = trained(config, tmp_path / "parts", data, resume=True)  # nothing is left to do
        assert np.array_equal(behaviour(whole), behaviour(again))

    @pytest.mark.slow
    def test_pushes_to_places_are_cloned(self, tmp_path):
        from pushplan.planners import make_policy

        shipped = config_named("rearrange", "flow").to_dict()
        scenarios = [{**shipped["scenarios"][0], "time_limit": 20.0}]
        sizes = {"scenarios": scenarios, "steps": 64, "chunk": 32, "options": TINY["flow"]}
        config = TrainingConfig.from_dict({**shipped, **sizes})
        teacher, found = make_policy("gtsp-mpc"), tmp_path / "data"
        options = {"noise": 0.05, "afresh": True, "hindsight": 1}
        record(config, teacher, "gtsp-mpc", found, episodes=1, **options)
        policy = OnnxPolicy(trained(config, tmp_path / "run", found))
        env = PushEnv(task="rearrange", variations=scenarios[0], observation=policy.observation)
        seen, _ = env.reset(seed=1)
        policy.reset(env.world, np.random.default_rng(0))
        assert env.action_space.contains(policy.act(env.world, seen).astype(np.float32))

    @pytest.mark.slow
    def test_what_comes_out_runs_without_a_learning_library(self, tmp_path, data):
        path = trained(tiny("bc"), tmp_path / "run", data)
        code = f"""
import sys
for name in ("torch", "stable_baselines3", "onnx", "minari", "tensorboard"):
    sys.modules[name] = None
from pushplan.evaluation import parse_policy, run_episode
from pushplan.evaluation.run.jobs import JobSettings
from pushplan.scenarios import Scenario
policy = parse_policy("onnx:{path}").make()
scenario = Scenario("maze", "pymunk", "benchmark", {{"boxes": 1}}, 3)
episode = run_episode(JobSettings().environment(scenario, policy), policy, scenario)
print(episode.actions.ravel().tolist())
"""
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        actions = json.loads(done.stdout)
        policy = OnnxPolicy(path)
        env = PushEnv(task="maze", variations={"boxes": 1}, observation=policy.observation)
        seen, _ = env.reset(seed=3)
        policy.reset(env.world, np.random.default_rng(0))
        for action in actions:
            decided = policy.act(env.world, seen)
            assert float(decided[0]) == action
            seen, *_ = env.step(decided)

    @pytest.mark.slow
    def test_images_and_the_file_of_the_library(self, tmp_path, monkeypatch):
        from pushplan.learned import load_policy

        config = tiny("ppo", observation=IMAGE, steps=32, validation=0)
        path = train_policy(config, tmp_path / "run", device="cpu")
        exported = OnnxPolicy(path)
        assert exported.observation.shape == (4, 36, 36)
        model = load_policy(f"sb3:{tmp_path / 'run' / 'model.zip'}", trust=True)
        env = TrainingEnv(config)
        seen, _ = env.reset(seed=1)
        assert model.specification.action == exported.specification.action
        assert model.decide(seen) == pytest.approx(exported.decide(seen), abs=1e-4)

    @pytest.mark.slow
    def test_a_process_for_each_environment_learns_the_same(self, tmp_path):
        config = tiny("ppo", steps=32, validation=0)
        one = train_policy(config, tmp_path / "one", device="cpu")
        two = train_policy(config, tmp_path / "two", device="cpu", processes=True)
        assert np.array_equal(behaviour(one), behaviour(two))

    @pytest.mark.slow
    def test_another_training_in_the_folder(self, tmp_path, data):
        trained(tiny("bc", validation=0), tmp_path, data, until=lambda done: done == 1)
        with pytest.raises(InvalidInputError, match="its seed is 0, not 1"):
            trained(tiny("bc", validation=0, seed=1), tmp_path, data, resume=True)
        longer = trained(tiny("bc", validation=0, steps=128), tmp_path, data, resume=True)
        assert longer is not None

    def test_a_data_set_belongs_to_cloning(self, tmp_path, data):
        with pytest.raises(InvalidInputError, match="bc needs a data set"):
            train_policy(tiny("bc"), tmp_path)
        with pytest.raises(InvalidInputError, match="belongs to bc"):
            train_policy(tiny("ppo"), tmp_path, data=data)
        other = tiny("bc", observation={**SMALL, "rays": 5})
        with pytest.raises(InvalidInputError, match=r"the observation is .*rays': 5"):
            train_policy(other, tmp_path / "a", data=data)
        with pytest.raises(InvalidInputError, match=r"sees no GPU|must be auto"):
            train_policy(tiny("ppo"), tmp_path / "b", device="cuda:77" if no_gpu() else "tpu")

    def test_a_checkpoint_that_runs_code_is_refused(self, tmp_path, data):
        import torch

        trained(tiny("bc", validation=0), tmp_path, data, until=lambda done: done == 1)
        torch.save({"chunks": Path("x")}, tmp_path / "checkpoint.pt")
        with pytest.raises(InvalidInputError, match="is no checkpoint"):
            trained(tiny("bc", validation=0), tmp_path, data, resume=True)
        (tmp_path / "checkpoint.pt").write_bytes(b"damaged")
        with pytest.raises(InvalidInputError, match="is no checkpoint"):
            trained(tiny("bc", validation=0), tmp_path, data, resume=True)


def no_gpu() -> bool:
    import torch

    return not torch.cuda.is_available()


class TestEnvironment:
    def test_starts_are_none_that_are_scored(self):
        env = TrainingEnv(tiny("ppo"))
        seeds = []
        for inner in env._envs:
            inner.reset = lambda seed, inner=inner: (
                seeds.append(seed) or PushEnv.reset(inner, seed=seed)
            )
        env.reset(seed=0)
        env.reset()
        env.reset(options={"layout": 7})
        assert min(seeds[:2]) >= TRAINING_SEEDS
        assert seeds[2] == 500_007

    def test_it_passes_the_checker(self):
        from gymnasium.utils.env_checker import check_env

        check_env(TrainingEnv(tiny("ppo")), skip_render_check=True)

    def test_a_decision_stands_for_several_steps(self):
        env = TrainingEnv(tiny("ppo", reward_scale=0.5))
        plain = PushEnv(task="maze", variations={"boxes": 1}, observation=FeatureObservation())
        env.reset(options={"layout": 3})
        plain.reset(seed=500_003)
        _, reward, *_ = env.step(np.array([0.3], np.float32))
        wanted = sum(plain.step([np.float32(0.3)])[1] for _ in range(8))
        assert reward == pytest.approx(0.5 * wanted, abs=1e-6)
        env.reset()
        for _ in range(4):  # training episodes are cut off
            _, _, terminated, truncated, info = env.step(np.array([0.0], np.float32))
        assert truncated and not terminated
        assert info == {"is_success": False, "share": 0.0}

    def test_a_direction_is_where_the_robot_goes(self):
        config = tiny(
            "ppo",
            task="box_delivery",
            action={"mode": "heading", "output": "direction"},
            observation={**SMALL, "range": 5.0},
        )
        env = TrainingEnv(config)
        env.reset(seed=3)
        before = env._env.world.robot_pose
        env.step(np.array([0.0, 0.7], np.float32))  # to the left
        way = env._env.world.robot_pose[:2] - before[:2]
        turned = np.remainder(np.arctan2(way[1], way[0]) - before[2], 2 * np.pi)
        assert np.hypot(*way) > 0.3
        assert turned == pytest.approx(np.pi / 2, abs=0.1)

    def test_a_map_has_to_reach_as_far_as_waypoints(self):
        with pytest.raises(InvalidInputError, match="10 x 10 m"):
            TrainingEnv(tiny("sam", observation={**MAP, "window": [8.0, 8.0]}))


class TestConfigs:
    def test_all_that_ship_can_be_read(self):
        shipped = shipped_configs()
        for name, path in shipped.items():
            config = read_config(path)
            assert name.startswith(f"{config.task.replace('_', '-')}-{config.algorithm}")
            assert TrainingConfig.from_dict(config.to_dict()) == config
            assert TrainingConfig.from_dict(yaml.safe_load(yaml.safe_dump(config.to_dict())))
        for task in ("maze", "ship-ice", "box-delivery", "area-clearing"):
            assert {f"{task}-ppo", f"{task}-sac"} <= set(shipped)
        assert {"box-delivery-sam", "area-clearing-sam"} <= set(shipped)

    @pytest.mark.parametrize("name", sorted(shipped_configs()))
    def test_each_makes_its_environment(self, name):
        env = TrainingEnv(read_config(shipped_configs()[name]))
        seen, _ = env.reset(seed=0)
        assert env.observation_space.contains(seen)
        assert json.loads(env.specification.to_json())["format"] == "pushplan-policy/1"

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"sceanrios": []}, "did you mean 'scenarios'"),
            ({"algorithm": "dqn"}, "unknown algorithm 'dqn'"),
            ({"scenarios": []}, "at least one"),
            ({"scenarios": [3]}, "must be a mapping"),
            ({"suites": "maze"}, "must be a list"),
            ({"options": {"rate": -1}}, "rate"),
            ({"options": {"rates": 1}}, "did you mean 'rate'"),
            ({"options": {"widths": []}}, "widths"),
            ({"action": {"output": "continuous"}}, "action"),
            ({"action": {"mode": "turn_rate", "output": "pixel_values"}}, "belongs to sam"),
            ({"observation": {"kind": "sound"}}, "unknown observation kind"),
            ({"steps": 0}, "steps"),
            ({"reward_scale": float("nan")}, "reward_scale"),
        ],
    )
    def test_what_is_wrong_is_said(self, changes, message):
        with pytest.raises((InvalidInputError, UnknownNameError), match=message):
            TrainingConfig.from_dict({**tiny("ppo").to_dict(), **changes})

    def test_files(self, tmp_path):
        with pytest.raises(InvalidInputError, match="cannot read configuration"):
            read_config(tmp_path / "no.yaml")
        path = tmp_path / "bad.yaml"
        for text in ("a: [", "[1]", "algorithm: ppo"):
            path.write_text(text)
            with pytest.raises(SchemaError, match=r"bad\.yaml"):
                read_config(path)
        with pytest.raises(UnknownNameError, match="maze-ppo"):
            config_named("maze", "dqn")
        data = {**tiny("ppo").to_dict(), "options": {}}
        path.write_text(yaml.safe_dump(data).replace("options: {}", "options: {rate: 1e-3}"))
        assert read_config(path).options.rate == 1e-3

    def test_empty_options_are_the_defaults(self):
        for algorithm, options in OPTIONS.items():
            assert tiny(algorithm, options={}).options == options()


class TestDataset:
    def test_it_holds_what_happened(self, data):
        about = read_metadata(data)
        found = list(episodes(data))
        assert len(found) == about["total_episodes"] == 3
        assert sum(len(one.actions) for one in found) == about["total_steps"]
        assert about["action_mode"] == "turn_rate"
        for one in found:
            assert one.observations.shape == (len(one.actions) + 1, 10 + 8 + 9)
            assert one.terminations[:-1].sum() == 0
            assert one.terminations[-1] or one.truncations[-1]
            assert np.abs(one.actions).max() <= 1.0

    def test_the_same_again(self, data, tmp_path):
        from pushplan.planners import make_policy

        straight = make_policy("straight")
        folder = record(tiny("bc"), straight, "straight", tmp_path / "x", episodes=1, noise=0.05)
        first, again = next(episodes(data)), next(episodes(folder))
        for entry in dataclasses.fields(first):
            assert np.array_equal(getattr(first, entry.name), getattr(again, entry.name))

    def test_a_driver_drives_and_the_policy_is_asked(self, tmp_path):
        from pushplan.planners import make_policy

        class Turning:
            def reset(self, world, rng):
                self.steps = 0

            def act(self, world):
                self.steps += 1
                return np.array([0.01 * self.steps])

        options = {"driver": Turning(), "driver_label": "turning", "noise": 0.2, "hold": 3}
        straight = make_policy("straight")
        folder = record(tiny("bc"), straight, "straight", tmp_path / "x", episodes=1, **options)
        about, found = read_metadata(folder), next(episodes(folder))
        assert (about["driver"], about["hold"]) == ("turning", 3)
        driven = np.flatnonzero(found.executed != found.actions)
        own = np.isin(found.executed.ravel(), np.float32([0.01, 0.02, 0.03]))
        assert len(driven) >= 3 and own[driven].all()

    def test_a_policy_begins_afresh_after_each_disturbance(self, tmp_path):
        begun = []

        class Ahead:
            def reset(self, world, rng):
                begun.append(world.time)

            def act(self, world, seen):
                return np.array([0.02])

        options = {"noise": 0.1, "hold": 3, "afresh": True}
        folder = record(tiny("bc"), Ahead(), "ahead", tmp_path / "x", episodes=1, **options)
        found = list(episodes(folder))
        assert 3 <= len(found) == read_metadata(folder)["total_episodes"] <= len(begun)
        assert begun[0] == 0.0 < begun[1] < begun[2]
        for one in found:
            assert np.array_equal(one.executed, one.actions)
            assert (one.actions == np.float32(0.02)).all()
            ends = one.terminations | one.truncations
            assert ends[-1] and not ends[:-1].any()

    def test_in_hindsight_objects_belong_where_they_came_to_be(self, tmp_path):
        class Chasing:
            actions = ("velocity",)

            def reset(self, world, rng):
                pass

            def act(self, world, seen):
                x, y = (world.movables.poses[0] - world.robot_pose)[:2]
                turn = np.arctan2(y, x) - world.robot_pose[2]
                return np.array([1.0, 0.5 * np.arctan2(np.sin(turn), np.cos(turn))])

        config = tiny(
            "bc",
            task="rearrange",
            scenarios=[{"objects": 1, "shape": "t", "time_limit": 15.0}],
            observation={**SMALL, "places": True},
            action={"mode": "velocity"},
        )
        folder = record(config, Chasing(), "chasing", tmp_path / "x", episodes=1, hindsight=2)
        whole, *others = episodes(folder)
        assert len(others) == 2
        for one in others:
            steps = len(one.actions)
            assert 0 < steps <= len(whole.actions)
            assert np.array_equal(one.actions, whole.actions[:steps])
            place = one.observations[:, -4:]  # in the object's frame, with cosine and sine
            assert place[-1] == pytest.approx([0.0, 0.0, 1.0, 0.0], abs=1e-6)
            assert np.abs(place[-2] - place[-1]).max() > 1e-6
            seen = [10 + 8, 10 + 8 + 1, -6, -5]  # object and robot are where they were
            assert np.array_equal(one.observations[:, seen], whole.observations[: steps + 1, seen])
        assert not read_metadata(folder)["successes"]

    def test_what_a_disturbance_leaves_of_a_chunk(self):
        wanted = np.arange(6, dtype=np.float32)[:, None]
        executed = wanted.copy()
        executed[2] = 9.0
        chunks, counted = action_chunks(wanted, executed, 3)
        assert chunks[:, :, 0].tolist()[:2] == [[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]]
        assert counted.tolist() == [
            [1.0, 1.0, 1.0],
            [1.0, 1.0, 0.0],  # what was wanted at 2, where something else was done
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 1.0],
            [1.0, 1.0, 0.0],  # beyond the end
            [1.0, 0.0, 0.0],
        ]

    def test_scans_of_an_estimate_are_none(self, tmp_path):
        from pushplan.planners import make_policy

        observation = {"kind": "lidar", "beams": 72}
        data = {**tiny("bc").to_dict(), "observation": observation}
        config = TrainingConfig.from_dict({**data, "scenarios": [{"sensing": "lidar"}]})
        with pytest.raises(InvalidInputError, match="without sensing"):
            record(config, make_policy("straight"), "straight", tmp_path / "data", episodes=1)
        assert not (tmp_path / "data").exists()

    @pytest.mark.parametrize("options", [{"noise": 0.05}, {"noise": 0.2, "afresh": True}], ids=str)
    def test_an_export_that_was_ended_goes_on_to_the_same_bytes(self, tmp_path, options):
        from pushplan.planners import make_policy

        def export(folder, limit=10**9, **changes):
            """Record four starts, and end after so many actions."""
            straight = make_policy("straight")
            act = straight.act
            left = [limit]

            def limited(world, observation):
                left[0] -= 1
                if left[0] < 0:
                    raise KeyboardInterrupt
                return act(world, observation)

            straight.act = limited
            given = {"episodes": 4, **options, **changes}
            record(tiny("bc"), straight, "straight", folder, **given)
            return limit - left[0]

        def files(folder):
            found = [path for path in folder.rglob("*") if path.is_file()]
            return {str(path.relative_to(folder)): path.read_bytes() for path in found}

        whole, parts = tmp_path / "whole", tmp_path / "parts"
        actions = export(whole)
        for limit in (0, actions // 2, actions // 3):  # before, amid and after starts
            with pytest.raises(KeyboardInterrupt):
                export(parts, limit)
            kept = json.loads((parts / "metadata.json").read_text())["total_episodes"]
            (parts / "data" / f"episode_{kept:05d}.npz").write_bytes(b"PK torn")
        with pytest.raises(SchemaError, match="of 4 starts are done: run the command that began"):
            read_metadata(parts)
        before = files(parts)
        with pytest.raises(InvalidInputError, match="data set that differs in noise, hold: give"):
            export(parts, noise=0.5, hold=7)
        assert files(parts) == before
        assert export(parts) < actions  # what is there is not made again
        assert files(parts) == files(whole)
        assert export(parts) == 0 and files(parts) == files(whole)

    def test_a_folder_of_the_users_is_left_alone(self, tmp_path, capsys):
        (tmp_path / "notes.txt").write_text("mine")
        words = ["--policy", "straight", "--task", "maze", "--episodes", "1"]
        assert main(["dataset", "export", *words, "--out", str(tmp_path)]) == 2
        assert "is no data set, there is no metadata.json in it" in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]

    def test_an_edited_policy_does_not_go_on(self, tmp_path, capsys):
        file = tmp_path / "mine.py"
        words = ["--policy", f"mine={file}:Mine", "--task", "maze", "--episodes", "1"]
        for turn, code in ((0.0, 0), (0.1, 2)):
            file.write_text(
                "import numpy\nclass Mine:\n    def reset(self, world, rng):\n        pass\n"
                f"    def act(self, world, observation):\n        return numpy.array([{turn}])\n"
            )
            assert main(["dataset", "export", *words, "--out", str(tmp_path / "x")]) == code
        assert "a data set that differs in sources: give" in capsys.readouterr().err

    def test_ctrl_c_says_how_to_go_on(self, tmp_path, capsys, monkeypatch):
        def interrupted(*args, **options):
            raise KeyboardInterrupt

        monkeypatch.setattr("pushplan.training.policies.dataset.record", interrupted)
        words = ["--policy", "straight", "--task", "maze", "--episodes", "1"]
        assert main(["dataset", "export", *words, "--out", str(tmp_path / "x")]) == 130
        assert "the same command goes on with the data set in" in capsys.readouterr().err

    def test_damage_is_said(self, data, tmp_path):
        from pushplan.planners import make_policy

        with pytest.raises(InvalidInputError, match="a data set that differs in policy, starts"):
            record(tiny("bc"), make_policy("random"), "x", data, episodes=1, noise=0.05)
        (tmp_path / "mine").mkdir()
        (tmp_path / "mine" / "notes.txt").touch()
        with pytest.raises(InvalidInputError, match="not empty and is no data set"):
            record(tiny("bc"), None, "x", tmp_path / "mine", episodes=1)
        with pytest.raises(SchemaError, match="data set"):
            read_metadata(tmp_path)
        (tmp_path / "data").mkdir()
        (tmp_path / "metadata.json").write_text((data / "metadata.json").read_text())
        with pytest.raises(SchemaError, match=r"episode_00000\.npz"):
            list(episodes(tmp_path))
        (tmp_path / "data" / "episode_00000.npz").write_bytes(b"PK no")
        with pytest.raises(SchemaError, match=r"episode_00000\.npz"):
            list(episodes(tmp_path))

    @pytest.mark.learn
    def test_minari_reads_it(self, data, tmp_path, monkeypatch):
        monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
        made = to_minari(data, "pushplan/straight-v0")
        assert made.total_episodes == 3
        assert made.total_steps == read_metadata(data)["total_steps"]
        assert np.array_equal(made[0].actions, next(episodes(data)).actions)


def sam_learner(folder: Path, **changes: object):
    """A learner whose model can be trained by hand."""
    from stable_baselines3.common.logger import configure

    from pushplan.training.policies.sb3_training import Sb3Learner

    learner = Sb3Learner(tiny("sam", **changes), "cpu", False, folder)
    learner.model.set_logger(configure(str(folder), []))
    return learner


def remember(model, seen: np.ndarray, action: int, reward: float) -> None:
    """A decision after which the task is over, in both environments."""
    both = np.stack([seen, seen])
    model.replay_buffer.add(
        both, both, np.full(2, action), np.full(2, reward), np.ones(2), [{}, {}]
    )


@pytest.mark.learn
class TestSamLearner:
    def test_a_target_that_follows_is_the_average_and_the_policy(self, tmp_path):
        import torch

        options = {"batch": 4, "buffer": 8, "widths": [4, 8], "blocks": 1, "follow": 0.25}
        learner = sam_learner(tmp_path, options=options)
        policy = learner.policy
        assert policy.acting is policy.q_net_target
        before = [p.clone() for p in policy.q_net_target.parameters()]
        remember(learner.model, np.zeros((4, 16, 16), np.uint8), 3, 1.0)
        learner.model.train(1, 4)
        now = zip(before, policy.q_net_target.parameters(), policy.q_net.parameters(), strict=True)
        for old, slow, fast in now:
            assert torch.allclose(slow, 0.75 * old + 0.25 * fast, atol=1e-6)

    def test_a_map_that_is_shrunk_has_a_value_for_each_pixel(self, tmp_path):
        import torch

        from pushplan.training.policies.networks import SpatialActionNetwork

        network = SpatialActionNetwork(4, (4, 8), 1, shrink=2)
        assert network(torch.zeros(3, 4, 32, 48)).shape == (3, 32, 48)
        with pytest.raises(InvalidInputError, match="divisible by 8"):
            sam_learner(tmp_path, options={"shrink": 2}, observation={**MAP, "pixels": [20, 20]})

    def test_rewards_are_added_up_to_the_end_of_a_chunk(self, tmp_path):
        learner = sam_learner(tmp_path, limit=50)
        learner.learn(range(6), 1)
        buffer = learner.buffer
        last = buffer.pos - 1
        assert not buffer.dones[last].any()
        learner.learn(range(6, 12), 2)  # begins with other episodes
        assert buffer.timeouts[last].all()
        buffer.rewards[:] = 1.0
        drawn = buffer._get_samples(np.full(8, last))
        assert drawn.rewards.unique().tolist() == [1.0]
        assert drawn.discounts.unique().tolist() == [np.float32(0.85)]
        drawn = buffer._get_samples(np.full(8, last - 1))
        assert drawn.rewards.unique().tolist() == [np.float32(1.85)]

    def test_random_pixels_are_at_objects(self, tmp_path):
        from pushplan.observation.channels import MOVABLE

        model = sam_learner(tmp_path, options={**TINY["sam"], "at_objects": 1.0}).model
        seen = np.zeros((2, 4, 16, 16), np.uint8)
        seen[:, 0, 9, 1] = MOVABLE
        model._last_obs = seen
        pixels = [model._sample_action(model.learning_starts, n_envs=2)[0] for _ in range(50)]
        rows, cols = np.divmod(np.concatenate(pixels), 16)
        assert set(rows.tolist()) == set(range(7, 12))
        assert set(cols.tolist()) == set(range(4))

    @pytest.mark.slow
    def test_it_starts_with_the_weights_of_an_exported_network(self, tmp_path, data):
        import torch

        first = trained(tiny("sam"), tmp_path / "first", data)
        never = {"explore": 0.0, "explore_end": 0.0}
        options = {**TINY["sam"], "start": str(first.with_suffix("")), **never}
        config = tiny("sam", seed=1, options=options)
        learner = sam_learner(tmp_path / "by hand", seed=1, options=options)
        learner.policy.begin_with(options["start"])
        networks = (learner.policy.q_net, learner.policy.q_net_target)
        seen = np.random.default_rng(0).integers(0, 255, (4, 16, 16)).astype(np.uint8)
        with torch.no_grad():
            values = networks[0](torch.from_numpy(seen[None]))[0].numpy()
        np.testing.assert_allclose(values, OnnxPolicy(first).decide(seen), atol=1e-5)
        assert all(map(torch.equal, *(network.parameters() for network in networks)))
        model = learner.model  # it acts by them before it has learned
        model.num_timesteps = 1
        model._last_obs = np.stack([seen, seen])
        for _ in range(20):
            pixels, _ = model._sample_action(model.learning_starts, n_envs=2)
            assert pixels.tolist() == [int(values.argmax())] * 2
        assert trained(config, tmp_path / "second", data, until=lambda done: done == 1) is None
        first.unlink()  # a training that is resumed needs it no more
        assert trained(config, tmp_path / "second", data, resume=True) is not None
        card = write_card(tmp_path / "second", [], tmp_path / "card.md").read_text()
        assert "- Begins with the weights of `policy`.\n" in card

    @pytest.mark.parametrize(
        ("start", "said"),
        [
            ("maze-ppo", r"first\.weight is missing there and \(4, 4, 5, 5\) here"),
            ("box-delivery-sam", "does not fit"),
            ("area-clearing-sam", r"does not fit .* blocks\.\d.first.weight"),
            ("box-delivery-sum", "there is no file box-delivery-sum"),
            (__file__, "cannot be read"),
        ],
    )
    @pytest.mark.slow
    def test_weights_of_another_network_are_refused(self, start, said, tmp_path, data):
        options = {**TINY["sam"], "start": start}
        if start == "area-clearing-sam":  # the same but for the number of blocks
            options |= {"widths": [16, 32], "blocks": 1}
        with pytest.raises(InvalidInputError, match=said):
            trained(tiny("sam", options=options), tmp_path / "run", data)
        assert trained(tiny("sam"), tmp_path / "run", data) is not None  # the folder is free

    @pytest.mark.slow
    def test_weights_that_are_no_numbers_are_refused(self, tmp_path, data):
        import onnx

        first = trained(tiny("sam"), tmp_path / "first", data)
        model = onnx.load(str(first))
        weights = np.full(tuple(model.graph.initializer[0].dims), np.nan, np.float32)
        name = model.graph.initializer[0].name
        model.graph.initializer[0].CopyFrom(onnx.numpy_helper.from_array(weights, name))
        onnx.save(model, str(tmp_path / "bad.onnx"))
        options = {**TINY["sam"], "start": str(tmp_path / "bad.onnx")}
        with pytest.raises(InvalidInputError, match="not finite"):
            trained(tiny("sam", options=options), tmp_path / "run", data)

    @pytest.mark.slow
    def test_it_learns_which_pixel_pays(self, tmp_path):
        options = {"rate": 0.01, "batch": 16, "buffer": 256, "widths": [8, 8], "blocks": 1}
        options |= {"discount": 0.0, "target_every": 20}
        learner = sam_learner(tmp_path, options=options)
        rng = np.random.default_rng(0)
        for _ in range(128):  # the pixel that is lit pays
            seen = np.zeros((4, 16, 16), np.uint8)
            lit = int(rng.integers(256))
            seen[0].flat[lit] = 255
            action = lit if rng.random() < 0.5 else int(rng.integers(256))
            remember(learner.model, seen, action, float(action == lit))
        learner.model.train(150, 16)
        near = 0
        for lit in range(0, 256, 16):
            seen = np.zeros((4, 16, 16), np.uint8)
            seen[0].flat[lit + 5] = 255
            row, col = divmod(int(learner.decide(seen)), 16)
            near += abs(row - lit // 16) <= 1 and abs(col - 5) <= 1
        assert near >= 12


@pytest.mark.learn
class TestCard:
    def test_it_says_what_is_known(self, tmp_path, data):
        trained(tiny("bc"), tmp_path, data, command="pushplan train bc ...")
        scores = {
            "suite": "maze-2d-3",
            "episodes": 100,
            "success": 0.93,
            "success_low": 0.86,
            "success_high": 0.97,
            "scores": {"E_nav": (0.8, 0.78, 0.82), "I_nav": (0.9,)},
            "failures": {"wall": 7},
        }
        text = write_card(tmp_path, [scores], tmp_path / "MODEL_CARD.md").read_text()
        for part in (
            "| maze-2d-3 | 100 | 0.930 [0.860, 0.970] | 0.800 [0.780, 0.820] | 0.900 |",
            "wall 7 of 100 episodes",
            "3 episodes of `straight`",
            "pushplan train bc ...",
        ):
            assert part in text
        with pytest.raises(SchemaError, match="no finished training"):
            write_card(tmp_path / "nowhere", [], tmp_path / "x.md")

    def test_the_best_is_the_one_with_the_greatest_share(self, tmp_path):
        run = TrainingRun(tmp_path, tiny("ppo"))
        point = CurvePoint(1_000_001, 1.0, 0, 0.0, 0.0, 5.0, 0.0, 0.5, 0.0)
        for i, share in enumerate((0.5, 0.9, 0.2)):
            run.save({"weights": {"i": i}}, dataclasses.replace(point, valid_share=share))
        assert run.best_weights() == {"i": 1}
        assert run.load()["chunks"] == 3
        again = TrainingRun(tmp_path, tiny("ppo"), resume=True)
        assert [one.steps for one in again.curve] == [1_000_001] * 3


class TestCommands:
    @pytest.mark.learn
    @pytest.mark.slow
    def test_from_nothing_to_a_card(self, tmp_path, capsys):
        config = tiny("bc", validation=0, steps=32)
        path = tmp_path / "tiny.yaml"
        path.write_text(yaml.safe_dump(config.to_dict()))
        out, found = tmp_path / "run", tmp_path / "data"
        call = ["--task", "maze", "--config", str(path), "--episodes", "2", "--out", str(found)]
        assert main(["dataset", "export", "--policy", "straight", *call]) == 0
        assert "2 episodes" in capsys.readouterr().out
        call = ["--config", str(path), "--data", str(found), "--out", str(out), "--workers", "0"]
        assert main(["train", "bc", *call, "--episodes", "1", "--device", "cpu"]) == 0
        assert "wrote" in capsys.readouterr().out
        assert "| maze-2d-3 | 1 |" in (out / "MODEL_CARD.md").read_text()
        assert main(["run", "maze-2d-3", "--policy", f"onnx:{out / 'policy'}"]) == 0

    def test_bad_usage(self, tmp_path, capsys):
        out = str(tmp_path / "x")
        for call, message in (
            (["ppo"], "either --task NAME or --config"),
            (["sam", "--task", "maze"], "unknown training configuration 'maze-sam'"),
            (["ppo", "--config", "no.yaml"], "cannot read configuration no.yaml"),
            (["ppo", "--config", "no.yaml", "--variant", "image"], "--variant belongs to --task"),
            (["bc", "--task", "maze"], "bc needs a data set"),
            (["flow", "--task", "maze"], "flow needs a data set"),
        ):
            assert main(["train", *call, "--out", out]) != 0
            assert message in capsys.readouterr().err
