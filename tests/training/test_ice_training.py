"""From rollouts to weights."""

import numpy as np
import pytest

from pushplan.core import interaction as core
from pushplan.interaction.network import IceNetwork
from pushplan.training import ice_data, ice_evaluation
from pushplan.training.ice_data import IcePairs, read_shards, write_shard, write_shards
from pushplan.training.ice_passages import PassageConfig, random_voyage, voyage_passages
from pushplan.world import InvalidInputError


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """A folder with two shards of one voyage each."""
    folder = tmp_path_factory.mktemp("shards")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ice_data, "VOYAGES_PER_SHARD", 1)
        write_shards(folder, split="train", shards=2)
    return folder


class TestPassages:
    @pytest.mark.slow
    def test_same_seed_same_bytes(self):
        config = PassageConfig(passages=4, greatest_concentration=0.15)
        (a, truth_a), (b, truth_b) = (voyage_passages(7, "train", config) for _ in range(2))
        assert a.patches.tobytes() == b.patches.tobytes()
        assert truth_a.after.tobytes() == truth_b.after.tobytes()

    def test_splits_meet_other_ice(self):
        config = PassageConfig(passages=4, greatest_concentration=0.15)
        a, b = (voyage_passages(7, split, config)[0] for split in ("train", "held-out"))
        assert a.patches.tobytes() != b.patches.tobytes()

    def test_the_hull_is_free_of_ice_afterwards(self):
        made, truth = voyage_passages(
            3, "train", PassageConfig(passages=8, greatest_concentration=0.25)
        )
        for passage, frame, after in zip(made.passages, made.frames, truth.after, strict=True):
            hull = np.empty((40, 40), np.float32)
            robot = passage.world.robot
            shape = (robot.vertices, robot.offsets, frame, made.cell)
            core.cover_sweep(passage.path[-1:], *shape, hull)
            assert (after * (hull > 0.99)).sum() < 0.05 * hull.sum()

    def test_voyages_can_be_driven(self):
        made, _ = voyage_passages(
            11, "train", PassageConfig(passages=1, greatest_concentration=0.1)
        )
        world = made.passages[0].world
        start = world.moved(robot_pose=[6.0, 1.0, np.pi / 2])
        for seed in range(5):
            poses = random_voyage(start, np.random.default_rng(seed))
            steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
            bends = np.abs(np.diff(poses[:, 2])) / steps
            assert (bends <= 1.01 / world.robot.turning_radius).all()
            assert (poses[:, 0] > -2.0).all() and (poses[:, 0] < 14.0).all()  # a hull length

    @pytest.mark.parametrize(
        "values", [{"passages": 0}, {"greatest_concentration": 0.9}, {"least_concentration": 0.6}]
    )
    def test_bad_settings(self, values):
        with pytest.raises(InvalidInputError):
            PassageConfig(**values)


class TestShards:
    def test_they_hold_pairs(self, few):
        pairs = read_shards(few, "train")
        assert len(pairs) == 96
        assert pairs.patches.shape == (96, 3, 40, 40) and pairs.patches.max() <= ice_data.LEVELS
        assert pairs.work.max() > 0.0

    def test_an_interrupted_run_goes_on(self, few):
        path = few / "train-00000.npz"
        before = path.stat().st_mtime_ns
        assert write_shard(few, "train", 0) == path
        assert path.stat().st_mtime_ns == before
        assert not [path for path in few.iterdir() if path.suffix != ".npz"]

    def test_broken_and_missing_shards(self, tmp_path):
        with pytest.raises(InvalidInputError, match="no shards"):
            read_shards(tmp_path, "train")
        (tmp_path / "train-00000.npz").write_bytes(b"PK\x03\x04 cut")
        with pytest.raises(InvalidInputError, match="shard of ice passages"):
            read_shards(tmp_path, "train")
        with pytest.raises(InvalidInputError):
            read_shards(tmp_path, "test")


def test_the_table_compares_predictors():
    made = ice_evaluation.held_out(0.2, 1, PassageConfig(passages=12))
    scores = {
        name: ice_evaluation.score(made, predictor)
        for name, predictor in ice_evaluation.predictors().items()
    }
    assert scores["ice contacts"].swath_mse < scores["no motion"].swath_mse
    assert scores["no motion"].work_bias == 0.0
    text = ice_evaluation.table({(0.2, name): score for name, score in scores.items()})
    assert text.count("\n|") == 5


@pytest.mark.learn
@pytest.mark.slow
def test_a_network_learns_and_is_exported(few, tmp_path):
    import torch

    from pushplan.training.ice_network import IceTrainingConfig, export, train

    pairs = read_shards(few, "train")
    pairs = IcePairs(pairs.patches[:64], pairs.after[:64], pairs.work[:64])
    config = IceTrainingConfig(epochs=3, batch=16)
    network, losses = train(pairs, config)
    assert losses[-1] < losses[0]
    assert train(pairs, config)[1] == losses
    patches = pairs.patches[:5].astype(np.float32) / ice_data.LEVELS
    with torch.no_grad():
        after, work = network.eval()(torch.from_numpy(patches))
    export(network, tmp_path / "net.onnx")
    found, effort = IceNetwork(tmp_path / "net.onnx").predict_patches(patches)
    assert found == pytest.approx(after.clamp(0, 1).numpy(), abs=1e-4)
    assert effort == pytest.approx(1000.0 * work.numpy(), rel=1e-3, abs=1e-3)


def test_without_torch_the_error_names_the_extra(monkeypatch):
    import sys

    from pushplan.training.ice_network import train
    from pushplan.world import MissingDependencyError

    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingDependencyError, match="train"):
        train(IcePairs(np.zeros((1, 3, 40, 40)), np.zeros((1, 40, 40)), np.zeros(1)))
