"""Broken ice of a stated concentration: random floes that overlap nowhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from pushplan.core import geometry
from pushplan.core import scenarios as core
from pushplan.scenarios.ice_field import MARGIN, FloeSizes, IceField
from pushplan.world import InvalidInputError, ScenarioError
from pushplan.world.checks import FloatArray, IntArray, checked_bounds, number
from pushplan.world.convex_shapes import disjoint
from pushplan.world.outline import ConvexParts, centroid, convex_outlines, flatten, unflatten
from pushplan.world.outline_repair import MOST_CHANGE, outline_parts

MOST_ROUGHNESS = 0.4
"""With more, floes would be stars."""
_EDGE_RADII = 0.06  # length of an edge, in mean radii of the field
_ROUGH_CORNERS = (24, 300)
_LEAST_EDGES = 8  # of a wave: small floes are smoother than large ones
_DECAY = 1.7  # of their amplitudes with the number of periods
_MOST_BAYS = 3
_BAY_DEPTHS = (3.0, 10.0)  # in standard deviations of the waves
_BAY_WIDTHS = (0.12, 0.4)  # [rad]
_DEEPEST = 0.7  # [distance from the middle to the convex outline]
MOST_FLOES = 20_000
"""More than this is refused: a typing error rather than a wish."""
_DRAWS = 200
_CORES = (0.85, 0.7, 0.55, 0.4)
_CORNERS = (5, 10)
_SLENDER = 1.7
_WAVES = 48
_STRETCH = 1.8
_ROUNDS = 12


def generate_ice(
    rng: np.random.Generator,
    *,
    bounds: ArrayLike,
    concentration: float,
    sizes: FloeSizes | None = None,
    keep_off: Sequence[ArrayLike] = (),
    gap: float | None = None,
    clumping: float = 0.6,
    roughness: float = 0.0,
) -> IceField:
    """A random field of floes, convex or with rough outlines.

    Sizes are drawn until their areas add up to what is wanted. Discs of most of those sizes
    are placed at random, more often where a smooth random field is high, until none
    touches another. The power diagram (Laguerre tessellation) of the discs gives each floe a cell
    of its own; a random convex shape grows within it to the floe's area. In open water a floe has
    a shape of its own, in a crowd its edges run along those of its neighbours, as in ice that
    has broken. From floes that are to be rough, a part is carved away in the end. The
    concentration is exact to rounding.

    Args:
        rng: the only source of randomness.
        bounds: x_min, y_min, x_max, y_max of the water [m]; floes stay inside.
        concentration: wanted area of the floes over the area of the bounds.
        sizes: of the floes; those of the 2D benchmark by default.
        keep_off: convex outlines, each (N, 2) [m], that must stay free.
        gap: least distance between floes, and from floes to ``keep_off`` [m]; by default 3 % of
            the mean radius.
        clumping: 0 for floes that are as likely everywhere, 1 for dense patches and open water.
            The denser the ice, the less space there is for it.
        roughness: 0 for convex floes; else the fraction, at most 0.4, of a convex floe that is
            carved away for a rough outline and bays (`pushplan.scenarios.ice_generator`). Real ones
            look like 0.2.

    Raises:
        InvalidInputError: if a value is out of range.
        ScenarioError: if the concentration cannot be reached.
    """
    sizes = FloeSizes() if sizes is None else sizes
    if not isinstance(sizes, FloeSizes):
        raise InvalidInputError(f"ice sizes must be a FloeSizes, got {type(sizes).__name__}")
    box = checked_bounds("ice bounds", bounds)
    concentration = number("ice concentration", concentration, low=0.0, high=1.0)
    clumping = number("ice clumping", clumping, low=0.0, high=1.0)
    roughness = number("ice roughness", roughness, low=0.0, high=MOST_ROUGHNESS)
    gap = 0.03 * sizes.typical_radius if gap is None else gap
    gap = number("ice gap", gap, low=0.0, high=sizes.least, open_low=True)
    blocks = flatten(convex_outlines("keep_off", keep_off))
    water = core.IceWater(box, *blocks, gap)
    wanted = concentration * float(np.prod(box[2:] - box[:2]))
    if wanted == 0.0:
        return IceField((), box)
    _check_possible(wanted, concentration, sizes, box)
    floes = _pack(rng, wanted, sizes, box, water, clumping, roughness)
    reached = sum(geometry.polygon_area(piece) for parts in floes for piece in disjoint(parts))
    return IceField(_shrunk(floes, wanted / reached), box)


def _pack(
    rng: np.random.Generator,
    wanted: float,
    sizes: FloeSizes,
    box: FloatArray,
    water: core.IceWater,
    clumping: float,
    roughness: float,
) -> list[ConvexParts]:
    """Floes of about a total area [m²], from large discs first, then from smaller ones."""
    concentration = wanted / float(np.prod(box[2:] - box[:2]))
    areas = sizes.draw(rng, wanted)
    if abs(areas.sum() - wanted) > 0.01 * wanted:
        raise ScenarioError(
            f"a concentration of {concentration:.4g} is {wanted:.3g} m² of ice, which floes of "
            f"{sizes.least:g} to {sizes.greatest:g} m radius cannot add up to"
        )
    # areas of convex floes over those of what carving, and cutting into parts, leaves of them
    whole = 1.0
    if roughness > 0.0:
        whole /= (1.0 - roughness) * (1.0 - MOST_CHANGE)
    areas *= whole
    least = np.pi * sizes.least**2 * (1.0 + MARGIN) * whole
    greatest = np.pi * sizes.greatest**2 * whole
    density = _density(rng, box, sizes.typical_radius, clumping)
    best = 0.0
    for fraction in _CORES:
        draws = rng.random((len(areas), _DRAWS, 3))
        radii = fraction * np.sqrt(areas / np.pi)
        centres = core.place_discs(radii, draws, density, water)
        if len(centres) < len(areas):
            continue
        shapes = _random_shapes(rng, len(areas))
        floes = _grow(areas, whole * wanted, (least, greatest), *shapes, centres, radii, water)
        reached = sum(geometry.polygon_area(floe) for floe in floes) / whole
        if reached < wanted:
            best = max(best, reached)
        elif roughness > 0.0:
            return roughened(rng, floes, roughness, sizes.typical_radius)
        else:
            return [(floe,) for floe in floes]
    reached_words = ""
    if best:
        reached_words = f": {concentration * best / wanted:.3g} was reached"
    raise ScenarioError(
        f"a concentration of {concentration:.3g} cannot be packed with floes of {sizes.least:g} to "
        f"{sizes.greatest:g} m radius and gaps of {water.gap:g} m{reached_words}; "
        "ask for less ice, smaller gaps or a wider range of sizes"
    )


def _check_possible(wanted: float, concentration: float, sizes: FloeSizes, box: FloatArray) -> None:
    """Refuse what needs no trying."""
    smallest = np.pi * sizes.least**2
    side = float((box[2:] - box[:2]).min())
    if wanted < 0.99 * smallest:
        raise ScenarioError(
            f"a concentration of {concentration:.3g} is {wanted:.3g} m² of ice, less than the "
            f"smallest floe of {smallest:.3g} m²"
        )
    if 2.0 * sizes.greatest > side:
        raise ScenarioError(
            f"floes of up to {sizes.greatest:g} m radius do not fit on water that is {side:g} m "
            "wide"
        )
    if wanted > MOST_FLOES * np.pi * sizes.typical_radius**2:
        raise ScenarioError(
            f"this would be more than {MOST_FLOES} floes: ask for larger floes or less water"
        )


def _density(
    rng: np.random.Generator, box: FloatArray, mean_radius: float, clumping: float
) -> FloatArray:
    """(R, C) chance that each place is taken: the ranks of a smooth Gaussian random field."""
    width, height = (float(side) for side in box[2:] - box[:2])
    step = max(mean_radius, max(width, height) / 1024.0)
    shape = max(2, round(height / step)), max(2, round(width / step))
    y, x = (np.linspace(0.0, side, n) for side, n in zip((height, width), shape, strict=True))
    # a sum of plane waves whose lengths are around a dozen floes
    waves = rng.standard_normal((_WAVES, 2)) / (5.0 * mean_radius)
    phases = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    along_x = np.exp(1j * np.outer(waves[:, 0], x))  # (W, C)
    along_y = np.exp(1j * (np.outer(waves[:, 1], y) + phases[:, None]))  # (W, R)
    field = np.einsum("wr,wc->rc", along_y, along_x).real  # in one fixed order, unlike BLAS
    ranks = np.argsort(np.argsort(field, axis=None, kind="stable"), kind="stable")
    level = ranks.reshape(field.shape) / max(1, field.size - 1)
    return np.ascontiguousarray(1.0 - clumping + clumping * level**3)


def _random_shapes(rng: np.random.Generator, count: int) -> tuple[FloatArray, IntArray]:
    """Convex outlines (K, N, 2) of area 1 about their centroids, and how many corners each has.

    Corners lie on an ellipse at uneven angles, so that they are always in convex position.
    """
    numbers = rng.integers(*_CORNERS, count)
    most = _CORNERS[1] - 1
    jitter = rng.uniform(-0.4, 0.4, (count, most))
    slender = rng.uniform(1.0, _SLENDER, count)
    turns = rng.uniform(0.0, 2.0 * np.pi, (count, 2))
    # surplus corners repeat the last one; they have no part in area and centroid
    place = np.minimum(np.arange(most), numbers[:, None] - 1)
    jitter = np.take_along_axis(jitter, place, axis=1)
    angles = 2.0 * np.pi * (place + jitter) / numbers[:, None] + turns[:, :1]
    points = np.stack([slender[:, None] * np.cos(angles), np.sin(angles)], axis=2)
    c = np.cos(turns[:, 1])
    s = np.sin(turns[:, 1])
    rotation = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
    points = points @ rotation
    after = np.roll(points, -1, axis=1)
    cross = points[..., 0] * after[..., 1] - after[..., 0] * points[..., 1]  # (K, N)
    area = 0.5 * cross.sum(axis=1)
    middle = ((points + after) * cross[..., None]).sum(axis=1) / (6.0 * area[:, None])
    points = (points - middle[:, None]) / np.sqrt(area)[:, None, None]
    return np.ascontiguousarray(points), numbers.astype(np.int64)


def _grow(
    areas: FloatArray,
    wanted: float,
    limits: tuple[float, float],  # least and greatest area of a floe [m²]
    shapes: FloatArray,  # from `_random_shapes`, as the next one
    corner_counts: IntArray,
    centres: FloatArray,
    radii: FloatArray,
    water: core.IceWater,
) -> list[FloatArray]:
    """Floes in their cells, together of at least the wanted area if there is space for it."""
    furthest = np.hypot(shapes[..., 0], shapes[..., 1]).max(axis=1)
    reaches = 1.15 * _STRETCH * furthest * np.sqrt(areas)
    cells = core.cut_cells(centres, radii, reaches, *_neighbours(centres, reaches), water)
    targets = (1.0 + MARGIN) * areas
    least, greatest = limits
    for _ in range(_ROUNDS):
        corners, counts = core.fit_floes(shapes, corner_counts, centres, *cells, targets, _STRETCH)
        grown = [corners[k, :n] for k, n in enumerate(counts.tolist()) if n]
        found = [geometry.polygon_area(floe) for floe in grown]
        floes = [floe for floe, area in zip(grown, found, strict=True) if area >= least]
        reached = sum(area for area in found if area >= least)
        if reached >= wanted:
            break
        # what the crowded ones lack falls to those that have space
        targets = np.minimum(
            targets * min(1.3, (1.0 + MARGIN) * wanted / max(reached, 0.1 * wanted)), greatest
        )
    return floes


def _neighbours(centres: FloatArray, reaches: FloatArray) -> tuple[IntArray, IntArray]:
    """Floes whose squares may meet: their numbers, one floe after the other, and the offsets."""
    found = cKDTree(centres).query_pairs(
        2.0 * np.sqrt(2.0) * float(reaches.max()), output_type="ndarray"
    )
    apart = np.abs(centres[found[:, 0]] - centres[found[:, 1]]).max(axis=1)
    found = found[apart <= reaches[found[:, 0]] + reaches[found[:, 1]]]
    both = np.concatenate([found, found[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    offsets = np.searchsorted(both[:, 0], np.arange(len(centres) + 1))
    return np.ascontiguousarray(both[:, 1]).astype(np.int64), offsets.astype(np.int64)


def _shrunk(floes: list[ConvexParts], fraction: float) -> tuple[ConvexParts, ...]:
    """Floes drawn in about a point inside, so that this fraction of their area is left."""
    vertices, offsets = flatten([np.concatenate(parts) for parts in floes])
    counts = np.diff(offsets)
    middles = np.add.reduceat(vertices, offsets[:-1]) / counts[:, None]
    middles = np.repeat(middles, counts, axis=0)
    smaller = middles + np.sqrt(fraction) * (vertices - middles)
    outlines = iter(unflatten(smaller, flatten([part for parts in floes for part in parts])[1]))
    return tuple(tuple(next(outlines) for _ in parts) for parts in floes)


def roughened(
    rng: np.random.Generator, floes: Sequence[FloatArray], roughness: float, mean_radius: float
) -> list[ConvexParts]:
    """Carve rough outlines out of convex floes; what is left of each lies inside of it.

    The distance of the outline from the middle of a floe falls short of that of the convex one by
    a random function of the angle: waves whose amplitudes fall with their frequency, and up to
    three bays.

    Args:
        rng: the only source of randomness.
        floes: convex outlines, each (N, 2) [m].
        roughness: fraction of the area of each floe that is carved away.
        mean_radius: of the floes of the field [m]; edges are a small part of it.

    Returns:
        The convex parts of each floe.
    """
    return [
        outline_parts("floe", _rough_outline(rng, floe, roughness, mean_radius), smooth=True).parts
        for floe in floes
    ]


def _rough_outline(
    rng: np.random.Generator, floe: FloatArray, roughness: float, mean_radius: float
) -> FloatArray:
    middle = centroid(floe)
    length = np.hypot(*(np.roll(floe, -1, axis=0) - floe).T).sum()
    count = int(np.clip(length / (_EDGE_RADII * mean_radius), *_ROUGH_CORNERS))
    angles = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    reach = _distances(floe - middle, angles)
    depth = _depths(rng, angles)
    # least t for which the area of radii (1 - t depth) reach is 1 - roughness of what it was
    once = (reach**2 * depth).sum()
    twice = (reach**2 * depth**2).sum()
    lost = roughness * (reach**2).sum()
    root = np.sqrt(max(0.0, once**2 - twice * lost))
    share = np.minimum(_DEEPEST, (once - root) / twice * depth)
    radii = reach * (1.0 - share)
    outline: FloatArray = np.stack([np.cos(angles), np.sin(angles)], axis=1) * radii[:, None]
    return middle + outline


def _depths(rng: np.random.Generator, angles: FloatArray) -> FloatArray:
    """Depths (N,) of the outline at some angles, relative to each other; the least is 0."""
    periods = np.arange(2.0, max(3, len(angles) // _LEAST_EDGES))
    amplitudes = rng.standard_normal(len(periods)) * periods**-_DECAY
    phases = rng.uniform(0.0, 2.0 * np.pi, len(periods))
    waves = (amplitudes * np.cos(np.outer(angles, periods) + phases)).sum(axis=1)
    depth: FloatArray = (waves - waves.min()) / waves.std()
    for _ in range(int(rng.integers(_MOST_BAYS + 1))):
        turn = np.angle(np.exp(1j * (angles - rng.uniform(0.0, 2.0 * np.pi))))
        depth += rng.uniform(*_BAY_DEPTHS) * np.exp(-((turn / rng.uniform(*_BAY_WIDTHS)) ** 2))
    return depth


def _distances(outline: FloatArray, angles: FloatArray) -> FloatArray:
    """Distances (N,) from the origin to a convex outline around it, at some angles [m]."""
    edges = np.roll(outline, -1, axis=0) - outline
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    offsets = (normals * outline).sum(axis=1)
    along = np.outer(np.cos(angles), normals[:, 0]) + np.outer(np.sin(angles), normals[:, 1])
    with np.errstate(divide="ignore"):
        reach: FloatArray = np.where(along > 0.0, offsets / along, np.inf)
    return np.asarray(reach.min(axis=1))
