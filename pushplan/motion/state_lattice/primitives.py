"""Motion primitives of a state lattice: arcs and lines that join lattice states exactly.

A set is defined in units of the lattice step, so one set serves every robot whose turning radius is
the same number of steps. Headings are directions of small whole vectors, so that straight lines
join lattice points too (Pivtoraiko, Knepper and Kelly, "Differentially constrained mobile robot
motion planning in state lattices", 2009).
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from pushplan.core import motion as core
from pushplan.geometry.angles import wrap_angle
from pushplan.motion.state_lattice.primitive_set import (
    PrimitiveConfig,
    PrimitiveSet,
    directions,
    lattice_angles,
)
from pushplan.motion.time_slicing import go_on, never
from pushplan.world.checks import FloatArray, IntArray, frozen

_MOST_TURN = 1.3  # greatest change of heading along one primitive [rad]
_SLACK = 0.35  # greatest turn of a primitive beyond its change of heading [rad]


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
