"""Occupancy of ice after a ship has passed, on a grid: the contract of occupancy predictors.

After Zhong et al., "Autonomous Navigation in Ice-Covered Waters with Learned Predictions on
Ship-Ice Interactions" (2025, arXiv 2409.11326): a patch of 40 x 40 cells about the ship with the
channels occupancy, footprint and swath goes in, the occupancy after passing comes out. Here cells
hold the covered fraction, not a bit, and a forecast also holds the work on the ice.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.core import interaction as core
from pushplan.errors import InvalidInputError
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import Movables, World
from pushplan.world.checked_fields import CheckedFields, PositiveFloat, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, array
from pushplan.world.outline import next_corner
from pushplan.world.protocols import HasAttributes

Patch = NDArray[np.float32]
"""Covered fractions of cells."""
PATCH_CELLS = 40
"""Cells along each side of a patch."""
CELLS_PER_LENGTH = 10
"""Cells along the hull: 0.2 m for the 2 m ship of the benchmark."""
CHANNELS = ("occupancy", "footprint", "swath")

ICE_FRICTION = 1.0
"""Coulomb coefficient between hull and ice in the two-dimensional Ship-Ice."""


@dataclass(frozen=True, eq=False)
class Passage(ArrayRecord, CheckedFields):
    """A path through the objects: a world, and the poses that the robot sweeps through."""

    field_prefix = "passage."

    world: World  # the snapshot; of the robot only the footprint is used
    # robot poses x, y [m], theta [rad], N at least 2
    path: Annotated[FloatArray, Shape(None, 3)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.path) < 2:
            raise InvalidInputError(f"passage.path needs at least 2 poses, got {len(self.path)}")


@dataclass(frozen=True, eq=False)
class PassageBatch(CheckedFields):
    """Passages as a predictor reads them.

    Raises:
        InvalidInputError: if a shape is wrong or a value is not a fraction.
    """

    field_prefix = "batch."

    # (B, 3, 40, 40) covered fraction of each cell: occupancy, footprint at the start, swath. Rows
    # count up ahead (towards the goal), columns to the right.
    patches: Annotated[Patch, Shape("B", len(CHANNELS), PATCH_CELLS, PATCH_CELLS)]
    cell: PositiveFloat  # side of a cell [m]
    density: PositiveFloat = 1.0  # mass over area of the objects [kg/m²]
    # (B, 3) where each patch lies, as in `patch_frame`; None where the patches come from a
    # map and predictors that need none are asked
    frames: Annotated[FloatArray, Shape("B", 3)] | None = None
    # the worlds, for predictors that follow single objects; () where there are none
    passages: tuple[Passage, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        patches = self.patches
        if patches.size and (patches.min() < 0.0 or patches.max() > 1.0):
            raise InvalidInputError("batch.patches must hold fractions of cells, from 0 to 1")
        if self.passages and (len(self.passages) != len(patches) or self.frames is None):
            raise InvalidInputError(
                f"a batch of {len(patches)} patches needs as many passages, and frames; got "
                f"{len(self.passages)} passages"
            )

    def __len__(self) -> int:
        return len(self.patches)


@dataclass(frozen=True, eq=False)
class OccupancyForecast(CheckedFields):
    """Forecast of a predictor for each passage of a batch."""

    field_prefix = "forecast."

    # covered fraction of each cell once the robot has passed
    after: Annotated[Patch, Shape("B", PATCH_CELLS, PATCH_CELLS)]
    # sum of mass times path length over the objects [kg m]
    work: Annotated[FloatArray, Shape("B")]


@runtime_checkable
class OccupancyPredictor(HasAttributes, Protocol):
    """Predicts the occupancy that the robot leaves behind."""

    def predict(self, batch: PassageBatch) -> OccupancyForecast:
        """The occupancy after each passage, and the work on it.

        Raises:
            InvalidInputError: if the batch lacks what this predictor needs.
        """


class NoMotion:
    """The null model: nothing moves. What every predictor has to beat."""

    def predict(self, batch: PassageBatch) -> OccupancyForecast:
        """The occupancy before, and no work."""
        return OccupancyForecast(batch.patches[:, 0], np.zeros(len(batch)))


def cell_size(world: World) -> float:
    """Side of the cells for this robot [m]: a tenth of its length."""
    return float(np.ptp(world.robot.vertices[:, 0])) / CELLS_PER_LENGTH


def ice_density(world: World) -> float:
    """Mass over area of all objects [kg/m²]; 1 where there are none."""
    movables = world.movables
    if len(movables) == 0:
        return 1.0
    if movables.is_compound:
        return float(movables.masses.sum() / movables.contact_areas.sum())
    (x, y) = movables.vertices.T
    following = next_corner(movables.offsets)
    area = 0.5 * float((x * y[following] - x[following] * y).sum())
    return float(movables.masses.sum()) / area


def patch_frame(
    path: FloatArray,  # (N, 3) robot poses
    ahead: float,  # direction in which rows count up [rad]
    cell: float,  # side of a cell [m]
) -> FloatArray:
    """The frame of the patch around a passage, about the middle between its two ends.

    Returns:
        (3,) world position [m] of the outer corner of cell (0, 0), and the heading [rad] in which
        columns count up; rows count up to the left of it. The corner lies on a grid of cells
        about the world's origin, so that patches of one world share their cells.
    """
    right = ahead - 0.5 * math.pi
    c = math.cos(right)
    s = math.sin(right)
    x, y = 0.5 * (path[0, :2] + path[-1, :2]) / cell
    column = round(c * x + s * y) - PATCH_CELLS // 2
    row = round(c * y - s * x) - PATCH_CELLS // 2
    return np.array([cell * (c * column - s * row), cell * (s * column + c * row), right])


def make_batch(passages: Sequence[Passage], *, ahead: float = 0.5 * math.pi) -> PassageBatch:
    """Patches of passages that all have one robot.

    Args:
        passages: at least one.
        ahead: direction in which the rows of the patches count up [rad].

    Raises:
        InvalidInputError: if there are none, or their robots differ.
    """
    if not passages:
        raise InvalidInputError("a batch needs at least one passage")
    first = passages[0].world
    if any(passage.world.robot != first.robot for passage in passages):
        raise InvalidInputError("the passages of a batch must share one robot")
    cell = cell_size(first)
    patches = np.empty((len(passages), len(CHANNELS), PATCH_CELLS, PATCH_CELLS), np.float32)
    frames = np.empty((len(passages), 3))
    for i, passage in enumerate(passages):
        frames[i] = patch_frame(passage.path, ahead, cell)
        movables = passage.world.movables
        robot = passage.world.robot
        _cover(movables, movables.poses, frames[i], cell, patches[i, 0])
        hull = (robot.vertices, robot.offsets, frames[i], cell)
        core.cover_sweep(passage.path[:1], *hull, patches[i, 1])
        core.cover_sweep(passage.path, *hull, patches[i, 2])
    return PassageBatch(patches, cell, ice_density(first), frames, tuple(passages))


def patch_after(batch: PassageBatch, index: int, poses: ArrayLike) -> Patch:
    """(40, 40) occupancy of one passage's window with its objects at other poses (K, 3)."""
    if batch.frames is None or not batch.passages:
        raise InvalidInputError("this batch holds patches only: make it with `make_batch`")
    movables = batch.passages[index].world.movables
    at: FloatArray = array("poses", poses, (len(movables), 3))
    out = np.empty((PATCH_CELLS, PATCH_CELLS), np.float32)
    _cover(movables, at, batch.frames[index], batch.cell, out)
    return out


def _cover(
    objects: Movables, poses: FloatArray, frame: FloatArray, cell: float, out: Patch
) -> None:
    parts = (poses[objects.part_owners], objects.part_vertices, objects.part_offsets)
    core.cover_objects(*parts, frame, cell, out)


@dataclass(frozen=True)
class InteractionOccupancy:
    """Sweeps every passage with an interaction model and draws where the objects end up.

    With `QuasiStatic` it is the analytic predictor; with a simulator's rollout it is the truth.

    Args:
        model: the interaction model.
    """

    model: InteractionModel = field(default_factory=lambda: QuasiStatic(friction=ICE_FRICTION))

    def predict(self, batch: PassageBatch) -> OccupancyForecast:
        """Sweep the passages, one after the other; needs a batch from `make_batch`."""
        if not batch.passages:
            raise InvalidInputError(
                "an interaction model follows single objects: make the batch with `make_batch`"
            )
        after = np.empty_like(batch.patches[:, 0])
        work = np.empty(len(batch))
        for i, passage in enumerate(batch.passages):
            swept = self.model.sweep(passage.world, passage.path)
            after[i] = patch_after(batch, i, swept.object_poses[-1])
            work[i] = swept.work
        return OccupancyForecast(after, work)
