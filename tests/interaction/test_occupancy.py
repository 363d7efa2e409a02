"""Occupancy patches and their predictors: geometry, contract, hostile files."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from ice_scenes import channel, straight_path

from pushplan.core import interaction as core
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.interaction.occupancy import (
    InteractionOccupancy,
    NoMotion,
    OccupancyForecast,
    OccupancyPredictor,
    Passage,
    PassageBatch,
    ice_density,
    make_batch,
    patch_after,
)
from pushplan.world import GoalLine, InvalidInputError, Movables, StaticMap, World
from pushplan.world.outline import transform

SQUARE = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
PREDICTORS = {
    "null": NoMotion(),
    "quasi-static": InteractionOccupancy(),
    "ice": InteractionOccupancy(IceInteraction()),
    "network": IceNetwork(),
}
FLOES = [(0.6 * SQUARE, [x, y, 0.3 * x + y]) for x in (-0.8, 0.1, 0.9) for y in (1.7, 2.6, 3.5)]


def batch(scale=1.0):
    floes = [(scale * o, [scale * p[0], scale * p[1], p[2]]) for o, p in FLOES]
    world = channel(floes, scale=scale)
    path = straight_path(0.0, 1.6) * [scale, scale, 1.0]
    return make_batch([Passage(world, path), Passage(world, path[:9])])


class TestCoverage:
    @settings(max_examples=30)
    @given(seed=st.integers(0, 10_000))
    def test_cells_hold_the_covered_area(self, seed):
        rng = np.random.default_rng(seed)
        poses = np.column_stack([rng.uniform(1, 7, (3, 2)), rng.uniform(0, 6, 3)])
        floes = Movables.from_outlines([0.9 * SQUARE] * 3, poses)
        out = np.empty((40, 40), np.float32)
        shapes = (floes.vertices, floes.offsets)
        core.cover_objects(floes.poses, *shapes, np.zeros(3), 0.2, out)
        union = shapely.union_all([shapely.Polygon(floes.outline_world(k)) for k in range(3)])
        assert 0.04 * out.sum() == pytest.approx(union.area, rel=0.04)
        for row, column in rng.integers(0, 40, (20, 2)):
            cell = shapely.box(0.2 * column, 0.2 * row, 0.2 * column + 0.2, 0.2 * row + 0.2)
            assert out[row, column] == pytest.approx(union.intersection(cell).area / 0.04, abs=0.2)

    def test_a_swath_is_what_the_hull_passes_over(self):
        world = channel([])
        theta = np.pi / 2 + 0.6 * np.linspace(0, 1.5, 16)
        path = np.column_stack(
            [4 + np.cumsum(0.1 * np.cos(theta)), 3 + np.cumsum(0.1 * np.sin(theta)), theta]
        )
        out = np.empty((40, 40), np.float32)
        hull = world.robot
        core.cover_sweep(path, hull.vertices, hull.offsets, np.zeros(3), 0.2, out)
        fine = np.linspace(0, len(path) - 1, 300)
        poses = np.column_stack([np.interp(fine, range(len(path)), path[:, i]) for i in range(3)])
        union = shapely.union_all([shapely.Polygon(transform(p, hull.parts[0])) for p in poses])
        assert 0.04 * out.sum() == pytest.approx(union.area, rel=0.03)

    def test_a_batch_shows_ice_footprint_and_swath(self):
        made = batch()
        ice, hull, swath = made.patches[0]
        assert made.patches.shape == (2, 3, 40, 40)
        assert 0.04 * hull.sum() == pytest.approx(0.915, rel=0.05)
        assert swath.sum() > hull.sum()
        assert (swath >= hull).all()
        assert 0.04 * ice.sum() == pytest.approx(9 * 0.36, rel=0.03)

    def test_the_direction_ahead_does_not_matter(self):
        made = batch()
        turned = World(
            made.passages[0].world.robot,
            [0.0, 0.0, 0.0],
            StaticMap.build(bounds=[-1, -6, 39, 6]),
            Movables.from_outlines(
                [o for o, _ in FLOES], [[y, -x, t - np.pi / 2] for _, (x, y, t) in FLOES]
            ),
            GoalLine([9.0, 0.0], [1.0, 0.0]),
        )
        path = straight_path(0.0, 1.6)[:, [1, 0, 2]] - [0, 0, np.pi / 2]
        again = make_batch([Passage(turned, path)], ahead=0.0)
        assert np.abs(again.patches[0] - made.patches[0]).mean() < 2e-3

    def test_size_does_not_matter(self):
        small, large = batch(), batch(38.0)
        assert np.abs(small.patches - large.patches).mean() < 2e-3
        assert large.cell == pytest.approx(38 * small.cell)

    def test_density_is_mass_over_area(self):
        world = channel(FLOES)
        heavy = Movables.from_outlines([o for o, _ in FLOES], [p for _, p in FLOES], density=7.0)
        heavier = World(world.robot, world.robot_pose, world.static, heavy, world.goal)
        assert ice_density(heavier) == pytest.approx(7.0)
        assert ice_density(channel([])) == 1.0


@pytest.mark.parametrize("name", PREDICTORS)
class TestEveryPredictor:
    def test_it_keeps_the_contract(self, name):
        predictor, made = PREDICTORS[name], batch()
        assert isinstance(predictor, OccupancyPredictor)
        found = predictor.predict(made)
        assert found.after.shape == (2, 40, 40)
        assert found.after.min() >= 0.0 and found.after.max() <= 1.0
        assert found.work.shape == (2,) and (found.work >= 0.0).all()

    def test_same_call_same_bytes_one_by_one_or_together(self, name):
        predictor, made = PREDICTORS[name], batch()
        first, second = predictor.predict(made), predictor.predict(made)
        assert first.after.tobytes() == second.after.tobytes()
        alone = predictor.predict(make_batch(made.passages[1:]))
        assert alone.after[0] == pytest.approx(first.after[1], abs=1e-5)
        assert alone.work[0] == pytest.approx(first.work[1], rel=1e-4, abs=1e-6)

    def test_size_and_density_scale_the_work(self, name):
        small, large = PREDICTORS[name].predict(batch()), PREDICTORS[name].predict(batch(38.0))
        assert large.work == pytest.approx(
            38.0**3 * small.work, rel=0.1
        )  # samples on edges fall either way


def test_models_beat_the_null_model_on_rollouts():
    from pushplan.training.ice_passages import PassageConfig, voyage_passages

    config = PassageConfig(passages=24, least_concentration=0.3, greatest_concentration=0.3)
    made, truth = voyage_passages(9, "held-out", config)
    errors = {
        name: float(((p.predict(made).after - truth.after) ** 2).mean())
        for name, p in PREDICTORS.items()
    }
    assert errors["ice"] < errors["network"] < errors["null"]
    assert errors["network"] < 0.6 * errors["null"]
    work = PREDICTORS["network"].predict(made).work
    assert np.corrcoef(work, truth.work)[0, 1] > 0.8


def test_patches_alone_serve_the_network_only():
    patches = np.zeros((3, 3, 40, 40), np.float32)
    made = PassageBatch(patches, 0.2)
    assert len(IceNetwork().predict(made).work) == 3
    assert len(IceNetwork().predict(PassageBatch(patches[:0], 0.2)).work) == 0
    with pytest.raises(InvalidInputError, match="make_batch"):
        InteractionOccupancy().predict(made)
    with pytest.raises(InvalidInputError, match="make_batch"):
        patch_after(made, 0, np.zeros((0, 3)))


class TestHostileInput:
    def test_passages(self):
        world = channel([])
        for path in ([], [[0, 0, 0]], [[0, 0]], [[0, 0, 0], [0, np.nan, 0]], None):
            with pytest.raises(InvalidInputError):
                Passage(world, path)
        with pytest.raises(InvalidInputError):
            Passage("world", straight_path(0, 1))
        with pytest.raises(InvalidInputError):
            make_batch([])
        with pytest.raises(InvalidInputError, match="one robot"):
            make_batch(
                [
                    Passage(world, straight_path(0, 1)),
                    Passage(channel([], scale=2.0), straight_path(0, 1)),
                ]
            )

    @pytest.mark.parametrize("shape", [(3, 40, 40), (1, 2, 40, 40), (1, 3, 39, 40)])
    def test_patches_of_the_wrong_shape(self, shape):
        with pytest.raises(InvalidInputError):
            PassageBatch(np.zeros(shape, np.float32), 0.2)

    @pytest.mark.parametrize("value", [1.5, -0.1, np.nan])
    def test_patches_that_hold_no_shares(self, value):
        with pytest.raises(InvalidInputError):
            PassageBatch(np.full((1, 3, 40, 40), value, np.float32), 0.2)

    @pytest.mark.parametrize("values", [{"cell": 0.0}, {"density": -1.0}])
    def test_sizes(self, values):
        with pytest.raises(InvalidInputError):
            PassageBatch(np.zeros((1, 3, 40, 40), np.float32), **{"cell": 0.2, **values})

    def test_forecasts(self):
        with pytest.raises(InvalidInputError):
            OccupancyForecast(np.zeros((2, 40, 40), np.float32), np.zeros(3))


class TestWeights:
    def test_they_are_small(self):
        assert IceNetwork().path.stat().st_size < 2_000_000

    @pytest.mark.parametrize("kept", [0, 1, 100, 20_000])
    def test_a_truncated_file(self, tmp_path, kept):
        path = tmp_path / "cut.onnx"
        path.write_bytes(IceNetwork().path.read_bytes()[:kept])
        with pytest.raises(InvalidInputError, match=r"cut\.onnx"):
            IceNetwork(path).load()

    def test_other_files(self, tmp_path):
        text = tmp_path / "text.onnx"
        text.write_text("not a network")
        for path in (text, tmp_path / "none.onnx", tmp_path):
            with pytest.raises(InvalidInputError, match=str(path)):
                IceNetwork(path).predict(batch())

    @pytest.mark.parametrize(
        ("name", "shape"), [("patches", ("batch", 3, 32, 32)), ("image", ("batch", 3, 40, 40))]
    )
    def test_another_network(self, tmp_path, name, shape):
        path = tmp_path / "other.onnx"
        path.write_bytes(identity_network(name, shape))
        with pytest.raises(InvalidInputError, match=r"other\.onnx"):
            IceNetwork(path).load()

    def test_threads(self):
        with pytest.raises(InvalidInputError):
            IceNetwork(threads=0)


def field(number: int, value: int | bytes | str) -> bytes:
    """One field of a protocol buffer."""
    if isinstance(value, int):
        return bytes([number << 3]) + varint(value)
    data = value.encode() if isinstance(value, str) else value
    return bytes([number << 3 | 2]) + varint(len(data)) + data


def varint(value: int) -> bytes:
    low, value = value & 0x7F, value >> 7
    return bytes([low | 0x80]) + varint(value) if value else bytes([low])


def identity_network(name: str, shape: tuple[str | int, ...]) -> bytes:
    """A valid ONNX file whose only node copies its input."""

    def door(label: str) -> bytes:
        sizes = b"".join(
            field(1, field(2, d) if isinstance(d, str) else field(1, d)) for d in shape
        )
        return field(1, label) + field(2, field(1, field(1, 1) + field(2, sizes)))

    node = field(1, name) + field(2, "out") + field(4, "Identity")
    graph = field(1, node) + field(2, "g") + field(11, door(name)) + field(12, door("out"))
    return field(1, 8) + field(7, graph) + field(8, field(1, "") + field(2, 17))
