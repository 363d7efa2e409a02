"""Fields of broken ice: what is generated."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
import shapely
import shapely.ops
from conftest import quickest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.core import scenarios as core
from pushplan.scenarios import FloeSizes, generate_ice
from pushplan.scenarios.ice_generator import roughened
from pushplan.world import InvalidInputError, ScenarioError, stream
from pushplan.world.outline import convex_outline

BASIN = (0.0, 0.0, 12.0, 40.0)
FULL_SCALE = {
    "bounds": (0.0, 150.0, 200.0, 1150.0),
    "sizes": FloeSizes(mean_radius=12.5, spread=0.33, least=6.0, greatest=25.0),
}


def ice(concentration, seed=0, **options):
    options.setdefault("bounds", BASIN)
    return generate_ice(stream(seed, "ice"), concentration=concentration, **options)


def shapes(field):
    return np.array([shapely.Polygon(corners) for (corners,) in field.floes], dtype=object)


def unions(field):
    return np.array(
        [shapely.union_all([shapely.Polygon(part) for part in parts]) for parts in field.floes]
    )


def least_gap(found):
    """Least distance between two of some floes [m], by brute force over near pairs."""
    first, second = shapely.STRtree(found).query(found, predicate="dwithin", distance=0.1)
    pairs = first < second
    if not pairs.any():
        return np.inf
    return shapely.distance(found[first[pairs]], found[second[pairs]]).min()


@pytest.mark.parametrize("concentration", [0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9])
@pytest.mark.slow
def test_concentration_is_exact_and_nothing_overlaps(concentration):
    for seed in range(3):
        field = ice(concentration, seed)
        area = shapely.area(shapely.union_all(shapes(field)))
        assert area == pytest.approx(concentration * 480.0, rel=1e-9)
        assert field.concentration == pytest.approx(concentration, rel=1e-9)
        assert least_gap(shapes(field)) > 0.0098  # 3 % of the mean radius
        for k, (corners,) in enumerate(field.floes):
            convex_outline(f"floe {k}", corners)
            assert (corners >= 0.0).all() and (corners <= (12.0, 40.0)).all()


def test_floe_counts_are_those_of_the_benchmark():
    for concentration, count in ((0.1, 140), (0.2, 260), (0.3, 380), (0.4, 480), (0.5, 640)):
        mean = np.mean([len(ice(concentration, seed)) for seed in range(5)])
        assert mean == pytest.approx(count, rel=0.1)


def test_sizes_are_log_normal_within_their_range():
    radii = np.concatenate([ice(0.4, seed).radii for seed in range(6)])
    assert radii.min() >= 0.2 and radii.max() <= 0.6
    assert radii.mean() == pytest.approx(0.33, rel=0.06)
    logs = np.log(radii)
    assert logs.std() == pytest.approx(0.25, abs=0.03)  # 0.28 before the tails are cut off
    skewed = np.mean(((radii - radii.mean()) / radii.std()) ** 3)
    straight = np.mean(((logs - logs.mean()) / logs.std()) ** 3)
    assert abs(straight) < 0.5 * skewed


def test_low_concentrations_have_clumps_and_open_water():
    """Counts in 4 x 4 m squares vary as at random places or more, not as on a lattice."""

    def spread(clumping):
        ratios = []
        for seed in range(8):
            found = ice(0.1, seed, clumping=clumping)
            centres = np.array([corners.mean(axis=0) for (corners,) in found.floes])
            counts = np.histogram2d(*centres.T, bins=(3, 10), range=((0, 12), (0, 40)))[0]
            ratios.append(counts.var() / counts.mean())
        return np.mean(ratios)

    even, clumped = spread(0.0), spread(1.0)
    assert 0.3 < even < 1.2  # a Poisson process has 1, a lattice 0
    assert clumped > 1.8 * even


@pytest.mark.parametrize("concentration", [0.1, 0.5])
def test_rough_floes_are_concave_of_few_parts_and_overlap_nowhere(concentration):
    sizes = FloeSizes(least=0.2, greatest=1.2, exponent=1.8)
    options = {"bounds": (-3.0, 5.0, 3.0, 12.0), "sizes": sizes, "roughness": 0.2}
    for seed in range(2):
        field = ice(concentration, seed, **options)
        found = unions(field)
        assert shapely.area(shapely.union_all(found)) == pytest.approx(42.0 * concentration)
        assert field.concentration == pytest.approx(concentration, rel=1e-9)
        assert least_gap(found) > 0.03 * sizes.typical_radius * (1.0 - 1e-6)
        assert shapely.box(-3.0, 5.0, 3.0, 12.0).contains(shapely.union_all(found))
        assert all(floe.geom_type == "Polygon" for floe in found)
        filled = shapely.area(found) / shapely.area(shapely.convex_hull(found))
        assert np.mean(filled < 0.98) > 0.5 and filled.min() > 0.7
        assert np.mean([len(parts) for parts in field.floes]) < 8.0
        assert max(sum(map(len, parts)) for parts in field.floes) > 30
        assert field.radii.min() > 0.99 * sizes.least and field.radii.max() < 1.01 * sizes.greatest
        assert field == ice(concentration, seed, **options)


def test_rough_floes_lie_within_the_convex_ones_that_they_are_carved_from():
    angles = np.arange(8) * np.pi / 4.0
    octagon = np.stack([2.0 * np.cos(angles), np.sin(angles)], axis=1) + 5.0
    whole = shapely.Polygon(octagon)
    for roughness in (0.05, 0.2, 0.4):
        for parts in roughened(stream(0, "ice"), [octagon] * 10, roughness, 0.3):
            left = shapely.union_all([shapely.Polygon(part) for part in parts])
            assert whole.buffer(1e-9).contains(left)
            assert left.area == pytest.approx((1.0 - roughness) * whole.area, rel=0.02)


def test_sizes_follow_a_power_law():
    sizes = FloeSizes(least=0.2, greatest=2.0, exponent=1.8)
    radii = np.sqrt(sizes.draw(stream(0, "ice"), 3e3) / np.pi)
    assert radii.min() >= 0.2 and radii.max() <= 2.0
    assert radii.mean() == pytest.approx(sizes.typical_radius, rel=0.03)
    above = [np.mean(radii > r) for r in (0.2, 0.4, 0.8)]
    lost = 10.0**-1.8  # what is cut off above, of the number above the least
    for k, share in enumerate(above):
        assert share == pytest.approx((2.0 ** (-1.8 * k) - lost) / (1.0 - lost), abs=0.02)


def test_no_ice_and_little_ice():
    empty = ice(0.0)
    assert len(empty) == 0 and empty.concentration == 0.0 and len(empty.radii) == 0
    one = ice(0.3 / 480.0)
    assert len(one) == 1 and one.areas.sum() == pytest.approx(0.3)
    with pytest.raises(ScenarioError, match=r"less than the smallest floe of 0\.126"):
        ice(1e-4)


@pytest.mark.parametrize("concentration", [0.1, 0.5])
def test_keep_off_stays_free(concentration):
    hull = [[3.0, 0.0], [3.6, 0.0], [3.6, 1.5], [3.3, 2.2], [3.0, 1.5]]
    corner = [[11.0, 39.0], [13.0, 39.0], [13.0, 41.0], [11.0, 41.0]]
    for seed in range(4):
        field = ice(concentration, seed, keep_off=[hull, corner])
        for region in (hull, corner):
            assert shapely.distance(shapes(field), shapely.Polygon(region)).min() > 0.0098
        assert field.concentration == pytest.approx(concentration, rel=1e-9)


def test_what_cannot_be_packed_is_one_error():
    with pytest.raises(ScenarioError, match=r"0\.99 cannot be packed .* 0\.9\d* was reached; ask"):
        ice(0.99)
    with pytest.raises(ScenarioError, match="cannot be packed"):
        ice(0.5, keep_off=[[[-1.0, -1.0], [13.0, -1.0], [13.0, 35.0], [-1.0, 35.0]]])
    with pytest.raises(ScenarioError, match="do not fit on water that is 1 m wide"):
        ice(0.5, bounds=(0.0, 0.0, 1.0, 40.0))
    with pytest.raises(ScenarioError, match="more than 20000 floes"):
        ice(0.5, bounds=(0.0, 0.0, 1e4, 1e4))
    with pytest.raises(ScenarioError, match="cannot add up to"):
        ice(0.5, bounds=(0.0, 0.0, 3.0, 3.0), sizes=FloeSizes(0.98, 0.1, 0.97, 0.99))


@pytest.mark.parametrize(
    "bad",
    [
        *({"concentration": c} for c in (-0.1, 1.1, float("nan"), "0.3", None, True)),
        {"clumping": 2.0},
        {"gap": 0.0},
        {"gap": float("inf")},
        {"bounds": (0.0, 0.0, 12.0)},
        {"bounds": (0.0, 0.0, 12.0, float("nan"))},
        {"bounds": (5.0, 0.0, 5.0, 1.0)},
        {"keep_off": [[[0.0, 0.0], [1.0, 1.0]]]},
        {"keep_off": 3},
        {"sizes": 0.3},
        {"roughness": 0.5},
        {"roughness": -0.1},
    ],
)
def test_bad_requests_are_refused(bad):
    with pytest.raises(InvalidInputError):
        generate_ice(stream(0, "ice"), **{"bounds": BASIN, "concentration": 0.3, **bad})


@pytest.mark.parametrize("sizes", [(0.1, 0.3, 0.2, 0.6), (0.3, 0.3, 0.3, 0.3), (0.3, -1.0, 0.2, 1)])
def test_bad_sizes_are_refused(sizes):
    with pytest.raises(InvalidInputError):
        FloeSizes(*sizes)
    with pytest.raises(InvalidInputError, match=r"least < greatest, got 0\.6, 0\.2 m"):
        FloeSizes(least=0.6, greatest=0.2, exponent=2.0)


def test_the_same_seed_gives_the_same_bytes_in_every_process():
    code = (
        "import hashlib, numpy as np; from pushplan.scenarios import generate_ice;"
        "from pushplan.world import stream;"
        "f = generate_ice(stream(7, 'ice'), bounds=(0, 0, 12, 40), concentration=0.4);"
        "print(hashlib.sha256(np.concatenate([p for p, in f.floes]).tobytes()).hexdigest())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "5", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    here = np.concatenate([floe for (floe,) in ice(0.4, 7).floes]).tobytes()
    assert done.stdout.strip() == hashlib.sha256(here).hexdigest()
    assert ice(0.4, 7) == ice(0.4, 7) != ice(0.4, 8)


def test_full_scale_and_speed():
    field = ice(0.5, **FULL_SCALE)
    assert field.concentration == pytest.approx(0.5, rel=1e-9)
    assert field.radii.min() >= 6.0 and field.radii.max() <= 25.0
    assert 150 < len(field) < 250 and least_gap(shapes(field)) > 0.3
    assert quickest(lambda: ice(0.5)) < 0.2


def half_plane(point, normal):
    """The points of a large square behind a line."""
    along = 100.0 * np.array([-normal[1], normal[0]])
    back = -100.0 * np.asarray(normal)
    return shapely.Polygon(
        [point + along, point - along, point - along + back, point + along + back]
    )


def reference_cell(k, centres, weights, reach, box, block, gap):
    """A cell of the power diagram, drawn in by half a gap, and held off a region."""
    cell = box.intersection(shapely.Point(centres[k]).buffer(reach, cap_style="square"))
    for j in range(len(centres)):
        if j != k:
            away = centres[j] - centres[k]
            far = np.hypot(*away)
            at = (far**2 + weights[k] ** 2 - weights[j] ** 2) / (2.0 * far) - 0.5 * gap
            cell = cell.intersection(half_plane(centres[k] + at * away / far, away / far))
    _, nearest = shapely.ops.nearest_points(shapely.Point(centres[k]), block)
    away = np.array([nearest.x, nearest.y]) - centres[k]
    away /= np.hypot(*away)
    return cell.intersection(half_plane([nearest.x, nearest.y] - gap * away, away))


def test_cells_and_floes_agree_with_shapely():
    rng = np.random.default_rng(3)
    angles = np.arange(8) * np.pi / 4.0
    octagon = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    octagon /= np.sqrt(shapely.Polygon(octagon).area)
    for _ in range(10):
        centres = rng.uniform(0.2, 5.8, (12, 2))
        centres = centres[np.hypot(*(centres - (3.0, 3.0)).T) > 1.0]
        count, gap, reach = len(centres), 0.03, 1.5
        near = np.hypot(*(centres[:, None] - centres).T) + 9.0 * np.eye(count)
        weights = 0.4 * near.min(axis=1)
        block = np.array([[2.6, 2.7], [3.5, 2.7], [3.3, 3.4], [2.6, 3.2]])
        pairs = np.concatenate([np.delete(np.arange(count), k) for k in range(count)])
        offsets = np.arange(count + 1) * (count - 1)
        water = core.IceWater(np.array([0.0, 0.0, 6.0, 6.0]), block, np.array([0, 4]), gap)
        reaches = np.full(count, reach)
        cells, sizes = core.cut_cells(centres, weights, reaches, pairs, offsets, water)
        shapes = np.repeat(octagon[None], count, axis=0), np.full(count, 8)
        areas = np.full(count, 0.8)
        floes, corners = core.fit_floes(*shapes, centres, cells, sizes, areas, 1.8)
        for k in range(count):
            cell = shapely.Polygon(cells[k, : sizes[k]])
            wanted = reference_cell(
                *(k, centres, weights, reach, shapely.box(0.0, 0.0, 6.0, 6.0)),
                *(shapely.Polygon(block), gap),
            )
            assert shapely.symmetric_difference(cell, wanted).area < 1e-9
            floe = shapely.Polygon(floes[k, : corners[k]])
            assert cell.buffer(1e-9).contains(floe)
            most = shapely.Polygon(centres[k] + 1.8 * np.sqrt(0.8) * octagon).intersection(cell)
            limit = min(0.8, most.area)  # short edges are cut off
            assert 0.85 * limit <= floe.area <= limit * (1.0 + 1e-6)


@settings(max_examples=25)
@given(
    concentration=st.floats(0.02, 0.6),
    width=st.floats(4.0, 20.0),
    length=st.floats(4.0, 30.0),
    x=st.floats(-1e3, 1e3),
    clumping=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**31),
)
def test_any_field_is_exact_and_free_of_overlap(concentration, width, length, x, clumping, seed):
    field = ice(concentration, seed, bounds=(x, -x, x + width, length - x), clumping=clumping)
    assert field.concentration == pytest.approx(concentration, rel=1e-6)
    assert least_gap(shapes(field)) > 0.009
