"""Motion primitives of a state lattice: arcs and lines that join lattice states exactly.

A set is defined in units of the lattice step, so one set serves every robot whose turning radius is
the same number of steps. Headings are directions of small whole vectors, so that straight lines
join lattice points too (Pivtoraiko, Knepper and Kelly, "Differentially constrained mobile robot
motion planning in state lattices", 2009).
"""

from __future__ import annotations

import functools
import json
from dataclasses import asdict, dataclass
from importlib import resources

import numpy as np

from pushplan.compiled import kernel
from pushplan.motion.dubins import dubins, sample_pieces
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, frozen, integer, known_keys
from pushplan.world.checks import number as checked_number
from pushplan.world.errors import InvalidInputError, SchemaError

DIRECTIONS: dict[int, tuple[tuple[int, int], ...]] = {
    8: ((1, 0), (1, 1)),
    16: ((1, 0), (2, 1), (1, 1), (1, 2)),
    32: ((1, 0), (4, 1), (2, 1), (4, 3), (1, 1), (3, 4), (1, 2), (1, 4)),
}
"""Headings in the first quarter turn, by their number in the whole turn."""
_MOST_TURN = 1.3
"""Greatest change of heading along one primitive [rad]."""
_SLACK = 0.35
"""How much more than its change of heading a primitive may turn [rad]."""


@dataclass(frozen=True)
class PrimitiveConfig:
    """What a set of primitives is made from; a set is stored and cached under this.

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

    @property
    def key(self) -> str:
        """Name of the set, as in its file."""
        return f"h{self.headings}_r{self.radius:g}_v{self.variants}_s{self.shifts}"


@dataclass(frozen=True, eq=False)
class PrimitiveSet(ArrayRecord):
    """H headings and P primitives, those of one heading after those of the one before.

    Args:
        config: what it was made from.
        angles: (H,) headings [rad], increasing from 0.
        first: (H + 1,) where the primitives of each heading start.
        ends: (P, 3) steps along x and y, and the heading at the end.
        pieces: (P, 3, 2) length [steps] and curvature [1/steps] of the three arcs.
    """

    config: PrimitiveConfig
    angles: FloatArray
    first: IntArray
    ends: IntArray
    pieces: FloatArray

    @functools.cached_property
    def lengths(self) -> FloatArray:
        """(P,) [steps]."""
        return frozen(np.ascontiguousarray(self.pieces[:, :, 0].sum(axis=1)))

    @functools.cached_property
    def boxes(self) -> FloatArray:
        """(P, 4) least and greatest x and y along each primitive [steps]."""
        boxes = np.empty((len(self), 4))
        poses, bends = np.empty((1000, 3)), np.empty(1000)
        for p in range(len(self)):
            start = np.array([0.0, 0.0, self.angles[self.heading_of(p)]])
            count = sample_pieces(start, self.pieces[p], 0.02 * self.lengths[p], poses, bends)
            path = np.concatenate([np.zeros((1, 2)), poses[:count, :2]])
            boxes[p] = path[:, 0].min(), path[:, 0].max(), path[:, 1].min(), path[:, 1].max()
        return frozen(boxes)

    @functools.cached_property
    def bulge(self) -> int:
        """How far a primitive may pass beyond the box of its two ends at most [steps]."""
        ends = self.ends[:, [0, 0, 1, 1]].astype(np.float64)
        box = np.where([False, True, False, True], np.maximum(ends, 0), np.minimum(ends, 0))
        return int(np.ceil(np.abs(self.boxes - box).max() - 1e-9))

    def __len__(self) -> int:
        return len(self.ends)

    def heading_of(self, primitive: int) -> int:
        """Index of the heading at the start of a primitive."""
        return int(np.searchsorted(self.first, primitive, side="right")) - 1

    def to_json(self) -> dict[str, object]:
        """Plain values, as in the file."""
        return {
            "config": asdict(self.config),
            "first": self.first.tolist(),
            "ends": self.ends.tolist(),
            "pieces": [[[float(f"{v:.17g}") for v in arc] for arc in p] for p in self.pieces],
        }

    @classmethod
    def from_json(cls, data: object) -> PrimitiveSet:
        """The inverse of `to_json`.

        Raises:
            SchemaError: if a key is missing or unknown, or shapes disagree.
        """
        keys = ("config", "first", "ends", "pieces")
        known_keys("primitives", data, keys, keys)
        assert isinstance(data, dict)
        config = PrimitiveConfig(**data["config"])
        first = np.array(data["first"], dtype=np.int64)
        ends = np.array(data["ends"], dtype=np.int64)
        pieces = np.array(data["pieces"], dtype=np.float64)
        if len(first) != config.headings + 1 or ends.shape != (first[-1], 3):
            raise SchemaError("primitives: the numbers of headings and ends do not fit together")
        if pieces.shape != (len(ends), 3, 2):
            raise SchemaError("primitives: every primitive needs three pieces")
        arrays = (frozen(_angles(config.headings)), frozen(first), frozen(ends), frozen(pieces))
        return cls(config, *arrays)


def directions(headings: int) -> IntArray:
    """(H, 2) whole vectors along the headings of a lattice."""
    quarter = np.array(DIRECTIONS[headings], dtype=np.int64)
    turns = [quarter]
    for _ in range(3):
        turns.append(np.column_stack([-turns[-1][:, 1], turns[-1][:, 0]]))
    return np.concatenate(turns)


def _angles(headings: int) -> FloatArray:
    vectors = directions(headings)
    angles = np.arctan2(vectors[:, 1], vectors[:, 0]) % (2.0 * np.pi)
    return angles.astype(np.float64)


@kernel(allocates=True)
def connections(
    heading: float,
    target: float,
    radius: float,
    reach: int,
    least_turn: float,
    out: FloatArray,
) -> int:
    """All ways from the origin to lattice points with a given heading that hardly turn in vain.

    Args:
        heading: at the origin [rad].
        target: at the end [rad].
        radius: turning radius [steps].
        reach: greatest coordinate of an end [steps].
        least_turn: how much a way may turn beyond the change of heading [rad].
        out: (M, 9) receives length, x, y, and the three pieces of each way.

    Returns:
        The number of ways.
    """
    start, end, pieces = np.zeros(3), np.empty(3), np.empty((3, 2))
    start[2], end[2] = heading, target
    change = abs((target - heading + np.pi) % (2.0 * np.pi) - np.pi)
    count = 0
    for x in range(-reach, reach + 1):
        for y in range(-reach, reach + 1):
            ahead = x * np.cos(heading) + y * np.sin(heading)
            if ahead <= 0.0 or x * x + y * y > reach * reach or count == out.shape[0]:
                continue
            end[0], end[1] = x, y
            length = dubins(start, end, radius, pieces)
            turn = 0.0
            for i in range(3):
                turn += abs(pieces[i, 0] * pieces[i, 1])
            if turn > change + least_turn:
                continue
            out[count, 0], out[count, 1], out[count, 2] = length, x, y
            for i in range(3):
                out[count, 3 + 2 * i] = pieces[i, 0]
                out[count, 4 + 2 * i] = pieces[i, 1]
            count += 1
    return count


def ways(heading: float, target: float, config: PrimitiveConfig, slack: float) -> FloatArray:
    """(W, 9) rows of `connections`, shortest first, ties by coordinates."""
    reach = int(np.ceil(1.7 * config.radius)) + 4
    out = np.empty((4 * (reach + 1) ** 2, 9))
    count = connections(heading, target, config.radius, reach, slack, out)
    rows = out[:count]
    order = np.lexsort((rows[:, 2], rows[:, 1], np.round(rows[:, 0], 9)))
    return rows[order]


def _turning(heading: float, target: float, along: IntArray, config: PrimitiveConfig) -> FloatArray:
    """Primitives from a heading to another one: the shortest that no straight step leads to."""
    kept: list[FloatArray] = []
    for row in ways(heading, target, config, _SLACK):
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
    return np.array(kept).reshape(-1, 9)


def _shifting(heading: float, along: IntArray, config: PrimitiveConfig) -> FloatArray:
    """Lane changes: to each side the nearest lanes, each by its shortest way."""
    found: dict[int, FloatArray] = {}
    for row in ways(heading, heading, config, 2.2):
        lane = round(float(along[0] * row[2] - along[1] * row[1]))
        if lane != 0 and lane not in found:
            found[lane] = row
    lanes: list[int] = []
    for side in (1, -1):
        lanes += sorted((lane for lane in found if lane * side > 0), key=abs)[: config.shifts]
    return np.array([found[lane] for lane in lanes]).reshape(-1, 9)


def generate(config: PrimitiveConfig) -> PrimitiveSet:
    """Make a set of primitives; a quarter turn is worked out, the rest is its rotation."""
    vectors, angles = directions(config.headings), _angles(config.headings)
    quarter = config.headings // 4
    blocks: list[tuple[IntArray, FloatArray]] = []
    for h in range(quarter):
        along = vectors[h]
        step = float(np.hypot(*along))
        rows = [np.array([[step, *along, step, 0.0, 0.0, 0.0, 0.0, 0.0]])]
        targets = [np.array([h])]
        for other in range(config.headings):
            change = abs((angles[other] - angles[h] + np.pi) % (2.0 * np.pi) - np.pi)
            if other == h or change > _MOST_TURN:
                continue
            made = _turning(angles[h], angles[other], vectors[[h, other]], config)
            rows.append(made)
            targets.append(np.full(len(made), other))
        made = _shifting(angles[h], along, config)
        rows.append(made)
        targets.append(np.full(len(made), h))
        block = np.concatenate(rows)
        ends = np.column_stack([block[:, 1:3].round(), np.concatenate(targets)]).astype(np.int64)
        blocks.append((ends, block[:, 3:].reshape(-1, 3, 2)))
    all_ends, all_pieces, counts = [], [], [0]
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


@functools.lru_cache(maxsize=32)
def primitives(config: PrimitiveConfig) -> PrimitiveSet:
    """The set for a configuration: from the file that ships with it, else made now."""
    file = resources.files("pushplan.planners.ship_lattice") / "data" / f"{config.key}.json"
    if file.is_file():
        stored = PrimitiveSet.from_json(json.loads(file.read_text(encoding="utf-8")))
        if stored.config == config:
            return stored
    return generate(config)
