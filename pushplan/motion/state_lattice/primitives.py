"""Motion primitives of a state lattice: arcs and lines that join lattice states exactly.

A set is defined in units of the lattice step, so one set serves every robot whose turning radius is
the same number of steps. Headings are directions of small whole vectors, so that straight lines
join lattice points too (Pivtoraiko, Knepper and Kelly, "Differentially constrained mobile robot
motion planning in state lattices", 2009).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pushplan.core import motion as core
from pushplan.errors import InvalidInputError
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.time_slicing import go_on, never
from pushplan.world.checks import (
    ArrayRecord,
    FloatArray,
    IntArray,
    frozen,
    integer,
)
from pushplan.world.checks import number as checked_number

_MOST_TURN = 1.3  # greatest change of heading along one primitive [rad]
_SLACK = 0.35  # greatest turn of a primitive beyond its change of heading [rad]
DIRECTIONS: dict[int, tuple[tuple[int, int], ...]] = {
    8: ((1, 0), (1, 1)),
    16: ((1, 0), (2, 1), (1, 1), (1, 2)),
    32: ((1, 0), (4, 1), (2, 1), (4, 3), (1, 1), (3, 4), (1, 2), (1, 4)),
}
"""Headings in the first quarter turn, by their number in the whole turn."""


@dataclass(frozen=True)
class PrimitiveConfig:
    """The arguments that a set of primitives is made from; a set is kept under this.

    Args:
        headings: 8, 16 or 32 in the whole turn.
        radius: least turning radius in lattice steps.
        variants: primitives from one heading to another one.
        shifts: primitives that change lane and keep the heading, to each side.
    """

    headings: int = 16
    radius: float = 6.0
    variants: int = 2
    shifts: int = 3

    def __post_init__(self) -> None:
        if self.headings not in DIRECTIONS:
            raise InvalidInputError(
                f"headings must be one of {sorted(DIRECTIONS)}, got {self.headings!r}"
            )
        radius = checked_number("radius", self.radius, low=0.5, high=40.0)
        object.__setattr__(self, "radius", radius)
        integer("variants", self.variants, low=1)
        integer("shifts", self.shifts, low=0)


@dataclass(frozen=True, eq=False)
class PrimitiveSet(ArrayRecord):
    """H headings and P primitives, those of one heading after those of the one before."""

    config: PrimitiveConfig  # parameters that it was made from
    angles: FloatArray  # (H,) headings [rad], increasing from 0
    first: IntArray  # (H + 1,) where the primitives of each heading start
    ends: IntArray  # (P, 3) steps along x and y, and the heading at the end
    pieces: FloatArray  # (P, 3, 2) length [steps] and curvature [1/steps] of the three arcs

    @functools.cached_property
    def lengths(self) -> FloatArray:
        """(P,) [steps]."""
        return frozen(np.ascontiguousarray(self.pieces[:, :, 0].sum(axis=1)))

    @functools.cached_property
    def boxes(self) -> FloatArray:
        """(P, 4) least and greatest x and y along each primitive [steps]."""
        headings = np.repeat(self.angles, np.diff(self.first))
        boxes = np.empty((len(self), 4))
        core.primitive_boxes(headings, self.pieces, self.lengths, boxes)
        return frozen(boxes)

    @functools.cached_property
    def bulge(self) -> int:
        """Greatest distance by which a primitive passes beyond the box of its two ends [steps]."""
        ends = self.ends[:, [0, 0, 1, 1]].astype(np.float64)
        box = np.where([False, True, False, True], np.maximum(ends, 0), np.minimum(ends, 0))
        return int(np.ceil(np.abs(self.boxes - box).max() - 1e-9))

    def __len__(self) -> int:
        return len(self.ends)

    def heading_of(self, primitive: int) -> int:
        """Index of the heading at the start of a primitive."""
        return int(np.searchsorted(self.first, primitive, side="right")) - 1


def directions(headings: int) -> IntArray:
    """(H, 2) whole vectors along the headings of a lattice."""
    quarter = np.array(DIRECTIONS[headings], dtype=np.int64)
    turns = [quarter]
    for _ in range(3):
        turns.append(np.column_stack([-turns[-1][:, 1], turns[-1][:, 0]]))
    return np.concatenate(turns)


def lattice_angles(headings: int) -> FloatArray:
    """(H,) headings of a lattice [rad], increasing from 0."""
    vectors = directions(headings)
    angles = np.arctan2(vectors[:, 1], vectors[:, 0]) % (2.0 * np.pi)
    return angles.astype(np.float64)


def connections(heading: float, target: float, config: PrimitiveConfig, slack: float) -> FloatArray:
    """(W, 9) length, end and pieces of paths from the origin, shortest first, ties by ends."""
    reach = int(np.ceil(1.7 * config.radius)) + 4
    out = np.empty((4 * (reach + 1) ** 2, 9))
    count = core.fill_connections(heading, target, config.radius, reach, slack, out)
    rows = out[:count]
    order = np.lexsort((rows[:, 2], rows[:, 1], np.round(rows[:, 0], 9)))
    return rows[order]


@functools.lru_cache(maxsize=2048)
def _turning(heading: int, target: int, config: PrimitiveConfig) -> FloatArray:
    """Primitives from a heading to another one: the shortest that no straight step leads to."""
    angles = lattice_angles(config.headings)
    along = directions(config.headings)[[heading, target]]
    if heading == target or abs(wrap_angle(angles[target] - angles[heading])) > _MOST_TURN:
        return np.zeros((0, 9))
    kept: list[FloatArray] = []
    for row in connections(float(angles[heading]), float(angles[target]), config, _SLACK):
        steps = [np.hypot(*vector) for vector in along]
        composed = any(
            np.array_equal(row[1:3], old[1:3] + vector) and row[0] > old[0] + step - 1e-6
            for old in kept
            for vector, step in zip(along, steps, strict=True)
        )
        if not composed:
            kept.append(row)
        if len(kept) == config.variants:
            break
    return frozen(np.array(kept).reshape(-1, 9))


def _shifting(heading: float, along: IntArray, config: PrimitiveConfig) -> FloatArray:
    """Lane changes: to each side the nearest lanes, each by its shortest path."""
    found: dict[int, FloatArray] = {}
    for row in connections(heading, heading, config, 2.2):
        lane = round(float(along[0] * row[2] - along[1] * row[1]))
        if lane != 0 and lane not in found:
            found[lane] = row
    lanes: list[int] = []
    for side in (1, -1):
        lanes += sorted((lane for lane in found if lane * side > 0), key=abs)[: config.shifts]
    return np.array([found[lane] for lane in lanes]).reshape(-1, 9)


def generate(config: PrimitiveConfig) -> PrimitiveSet:
    """Make a set of primitives; a quarter turn is worked out, the rest is its rotation."""
    vectors = directions(config.headings)
    angles = lattice_angles(config.headings)
    quarter = config.headings // 4
    blocks: list[tuple[IntArray, FloatArray]] = []
    for h in range(quarter):
        along = vectors[h]
        step = float(np.hypot(*along))
        rows = [np.array([[step, *along, step, 0.0, 0.0, 0.0, 0.0, 0.0]])]
        targets = [np.array([h])]
        for other in range(config.headings):
            made = _turning(h, other, config)
            rows.append(made)
            targets.append(np.full(len(made), other))
        made = _shifting(angles[h], along, config)
        rows.append(made)
        targets.append(np.full(len(made), h))
        block = np.concatenate(rows)
        ends = np.column_stack([block[:, 1:3].round(), np.concatenate(targets)]).astype(np.int64)
        blocks.append((ends, block[:, 3:].reshape(-1, 3, 2)))
    all_ends = []
    all_pieces = []
    counts = [0]
    for turn in range(4):
        for ends, pieces in blocks:
            rotated = ends.copy()
            for _ in range(turn):
                rotated[:, 0], rotated[:, 1] = -rotated[:, 1], rotated[:, 0].copy()
            rotated[:, 2] = (rotated[:, 2] + turn * quarter) % config.headings
            all_ends.append(rotated)
            all_pieces.append(pieces)
            counts.append(len(ends))
    arrays = (
        frozen(angles),
        frozen(np.cumsum(counts)),
        frozen(np.concatenate(all_ends)),
        frozen(np.ascontiguousarray(np.concatenate(all_pieces))),
    )
    return PrimitiveSet(config, *arrays)


_SETS: dict[PrimitiveConfig, PrimitiveSet] = {}
"""Those that have been made in this process."""


def primitives(config: PrimitiveConfig, stopped: Callable[[], bool] = never) -> PrimitiveSet:
    """The set for a configuration, made where it is asked for first: in 4 to 60 ms.

    Raises:
        Stopped: if the stop rule fires before it is there; what is done is kept.
    """
    if config not in _SETS:
        for heading in range(config.headings // 4):
            for target in range(config.headings):
                go_on(stopped)
                _turning(heading, target, config)
        _SETS[config] = generate(config)
    return _SETS[config]
