"""The objects that may be pushed, as a structure of arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import (
    ArrayRecord,
    BoolArray,
    FloatArray,
    IntArray,
    array,
    expect,
    frozen,
    number,
)
from pushplan.world.outline import (
    LARGEST_M,
    areas_and_centroids,
    convex_outline,
    convex_outlines,
    flatten,
    grown_outlines,
    transform,
    transform_outlines,
    well_formed,
)

_ONE_EACH = ("poses", "twists", "masses", "wheeled", "contact_radii", "fixed")


@dataclass(frozen=True, eq=False)
class Movables(ArrayRecord, CheckedFields):
    """K convex objects that the robot may push.

    The origin of each body frame is the centroid of its outline, where the pressure on the
    ground is centred; `from_polygons` does that for corners in the world frame.

    Args:
        ids: (K,) distinct labels, kept for as long as the object exists.
        poses: (K, 3) x, y [m] and theta [rad], world frame.
        twists: (K, 3) velocities in the world frame [m/s, m/s, rad/s].
        masses: (K,) masses as the metrics count them [kg], positive.
        wheeled: (K,) True where the object stands on casters and rolls.
        drawn_vertices: (V, 2) convex outlines as drawn, in body frames, flattened [m];
            `convex_outline` says what is taken.
        drawn_offsets: (K + 1,) where each outline starts in ``drawn_vertices``.
        contact_radii: (K,) distances from the drawn outlines at which objects touch others [m]:
            they are rounded by them. `vertices` are grown by them, and everything but masses,
            goals and files reads those.
        fixed: (K,) True where the object is held not to move, as far as one knows; all false if
            None. Planners count it as static (`World.with_fixed_as_static`); in a simulator's own
            world it is the truth.

    Raises:
        InvalidInputError: if shapes disagree, an outline is not convex or off its centroid.
    """

    field_prefix = "movables."

    ids: Annotated[IntArray, Shape("K")]
    poses: Annotated[FloatArray, Shape("K", 3)]
    twists: Annotated[FloatArray, Shape("K", 3)]
    masses: Annotated[FloatArray, Shape("K")]
    wheeled: Annotated[BoolArray, Shape("K")]
    drawn_vertices: Annotated[FloatArray, Shape(None, 2)]
    drawn_offsets: Annotated[IntArray, Shape(None)]
    contact_radii: Annotated[FloatArray, Shape("K")]
    fixed: Annotated[BoolArray, Shape("K")] = field(
        default_factory=lambda: np.zeros(0, dtype=np.bool_)
    )

    def __post_init__(self) -> None:
        ids: IntArray = array("movables.ids", self.ids, (None,), dtype=np.int64)
        if self.fixed is None or np.array_equal(self.fixed, []):
            object.__setattr__(self, "fixed", np.zeros(len(ids), dtype=np.bool_))
        super().__post_init__()
        array("movables.drawn_offsets", self.drawn_offsets, (len(self.ids) + 1,), dtype=np.int64)
        if len(np.unique(self.ids)) != len(self.ids):
            raise InvalidInputError(f"movables.ids must be distinct, got {self.ids.tolist()}")
        if (self.masses <= 0.0).any():
            raise InvalidInputError(f"movables.masses must be positive, got {self.masses.min()}")
        if (self.contact_radii < 0.0).any():
            least = self.contact_radii.min()
            raise InvalidInputError(f"movables.contact_radii must not be negative, got {least}")
        if (self.contact_radii > LARGEST_M).any():
            most = self.contact_radii.max()
            raise InvalidInputError(
                f"movables.contact_radii must be at most {LARGEST_M:g} m, got {most:g}"
            )
        ends = self.drawn_offsets[[0, -1]].tolist()
        if ends != [0, len(self.drawn_vertices)] or (np.diff(self.drawn_offsets) < 0).any():
            raise InvalidInputError(
                "movables.drawn_offsets must rise from 0 to len(drawn_vertices)"
            )
        self._check_outlines()

    def _check_outlines(self) -> None:
        good = well_formed(self.drawn_vertices, self.drawn_offsets)
        if not good.all():
            outlines = [
                convex_outline(f"outline of movable {self.ids[k]}", self.drawn_outline(k))
                for k in range(len(self))
            ]
            vertices, offsets = flatten(outlines)
            object.__setattr__(self, "drawn_vertices", vertices)
            object.__setattr__(self, "drawn_offsets", offsets)
        _, centres = areas_and_centroids(self.drawn_vertices, self.drawn_offsets)
        for k in np.flatnonzero(np.abs(centres).max(axis=1) > 1e-6 * self.radii).tolist():
            raise InvalidInputError(
                f"outline of movable {self.ids[k]} must have its centroid at the body origin, it "
                f"is at ({centres[k, 0]:g}, {centres[k, 1]:g}); Movables.from_polygons shifts it"
            )

    def __len__(self) -> int:
        return len(self.ids)

    @classmethod
    def empty(cls) -> Movables:
        """No objects."""
        return cls.from_outlines([], np.zeros((0, 3)))

    @classmethod
    def from_outlines(
        cls,
        outlines: Sequence[ArrayLike],
        poses: ArrayLike,
        *,
        masses: ArrayLike | None = None,
        density: float = 1.0,
        wheeled: ArrayLike | None = None,
        twists: ArrayLike | None = None,
        ids: ArrayLike | None = None,
        contact_radii: ArrayLike = 0.0,
        fixed: ArrayLike | None = None,
    ) -> Movables:
        """Objects from body-frame outlines whose centroid is the body origin.

        Args:
            outlines: K convex outlines as drawn, each (N, 2) [m].
            poses: (K, 3) x, y [m], theta [rad].
            masses: (K,) [kg]; by default area times ``density``.
            density: [kg/m²].
            wheeled: (K,) flags, by default all false.
            twists: (K, 3), by default zero.
            ids: (K,), by default 0 to K - 1.
            contact_radii: (K,), or one for all [m].
            fixed: (K,) flags, by default all false.
        """
        clean = convex_outlines("outline", outlines)
        vertices, offsets = flatten(clean)
        count = len(clean)
        if masses is None:
            density = number("density", density, low=0.0, open_low=True)
            masses = areas_and_centroids(vertices, offsets)[0] * density
        values: dict[str, Any] = {
            "ids": np.arange(count) if ids is None else ids,
            "poses": poses,
            "twists": np.zeros((count, 3)) if twists is None else twists,
            "masses": masses,
            "wheeled": np.zeros(count, dtype=bool) if wheeled is None else wheeled,
            "contact_radii": contact_radii,
            "fixed": fixed,
        }
        if not np.iterable(contact_radii):
            values["contact_radii"] = [contact_radii] * count
        return cls(drawn_vertices=vertices, drawn_offsets=offsets, **values)

    @classmethod
    def from_polygons(
        cls,
        polygons: Sequence[ArrayLike],
        **options: Any,
    ) -> Movables:
        """Objects from convex polygons in the world frame, as perception reports them.

        Each gets a pose at its centroid with theta = 0.

        Args:
            polygons: K convex polygons, each (N, 2) [m].
            options: further arguments of `from_outlines`, such as ``masses``.
        """
        clean = convex_outlines("polygon", polygons)
        _, centres = areas_and_centroids(*flatten(clean))
        poses = np.column_stack([centres, np.zeros(len(clean))])
        outlines = [c - centre for c, centre in zip(clean, centres, strict=True)]
        return cls.from_outlines(outlines, poses, **options)

    @cached_property
    def _contact_outlines(self) -> tuple[FloatArray, IntArray]:
        if not self.contact_radii.any():
            return self.drawn_vertices, self.drawn_offsets
        grown = grown_outlines(self.drawn_vertices, self.drawn_offsets, self.contact_radii)
        return frozen(grown[0]), frozen(grown[1])

    @property
    def vertices(self) -> FloatArray:
        """(V, 2) outlines as others touch them: grown by the contact radii, not rounded [m]."""
        return self._contact_outlines[0]

    @property
    def offsets(self) -> IntArray:
        """(K + 1,) where each outline starts in `vertices`."""
        return self._contact_outlines[1]

    def drawn_outline(self, k: int) -> FloatArray:
        """(N, 2) corners of object ``k`` as drawn, in its body frame [m]."""
        return self.drawn_vertices[self.drawn_offsets[k] : self.drawn_offsets[k + 1]]

    def outline(self, k: int) -> FloatArray:
        """(N, 2) corners of object ``k`` as others touch it, in its body frame [m]."""
        return self.vertices[self.offsets[k] : self.offsets[k + 1]]

    def outline_world(self, k: int) -> FloatArray:
        """(N, 2) corners of object ``k`` in the world frame [m]."""
        return transform(self.poses[k], self.outline(k))

    @property
    def vertices_world(self) -> FloatArray:
        """(V, 2) `vertices` in the world frame [m]."""
        return transform_outlines(self.poses, self.vertices, self.offsets)

    def moved_to(self, poses: ArrayLike, twists: ArrayLike | None = None) -> Movables:
        """The same objects at other poses (K, 3); at rest unless twists (K, 3) are given.

        Outlines are not checked again, so this is cheap enough for every control step.
        """
        shape = (len(self), 3)
        moved = array("poses", poses, shape)
        velocities = frozen(np.zeros(shape))
        if twists is not None:
            velocities = array("twists", twists, shape)
        return self._unchecked({**self.__dict__, "poses": moved, "twists": velocities})

    def holding_fixed(self, fixed: ArrayLike) -> Movables:
        """The same objects, of which those flagged in (K,) are held not to move."""
        flags = array("movables.fixed", fixed, (len(self),), dtype=np.bool_)
        return self._unchecked({**self.__dict__, "fixed": flags})

    def select(self, keep: ArrayLike) -> Movables:
        """The objects whose index or flag is in ``keep``."""
        chosen = np.asarray(keep)  # an empty list would be one of floats
        index = np.arange(len(self))[chosen if chosen.size else chosen.astype(np.int64)]
        if len(np.unique(index)) != len(index):
            raise InvalidInputError(f"keep must name an object once, got {index.tolist()}")
        return self._gathered(index)

    def updated(self, changes: Movables, removed: ArrayLike = ()) -> Movables:
        """These objects with some of them changed, added or removed, at the cost of a copy.

        Outlines are not checked again. Where all changed objects keep their outlines, the arrays
        of the outlines stay the same ones.

        Args:
            changes: objects by their ``ids``: those that are known here take the place of the old
                ones, all others are added at the end.
            removed: (R,) ids of objects that are gone.

        Raises:
            InvalidInputError: if an id in ``removed`` is unknown, or in ``changes`` too.
        """
        expect("changes", changes, Movables)
        gone = self._index_of(array("removed", removed, (None,), dtype=np.int64))
        if (gone < 0).any() or np.isin(changes.ids, self.ids[gone]).any():
            raise InvalidInputError(
                "removed must name objects that are there and not among the changes, got "
                f"{np.asarray(removed).tolist()}"
            )
        at = self._index_of(changes.ids)
        known = np.flatnonzero(at >= 0)
        if len(gone) == 0 and len(known) == len(at) and self._has_outlines_of(changes, at):
            same = dict(self.__dict__)
            for name in _ONE_EACH:
                same[name] = getattr(self, name).copy()
                same[name][at] = getattr(changes, name)
                frozen(same[name])
            return self._unchecked(same)
        values = {
            name: np.concatenate([getattr(self, name), getattr(changes, name)])
            for name in (*_ONE_EACH, "ids", "drawn_vertices")
        }
        more = self.drawn_offsets[-1] + changes.drawn_offsets[1:]
        values["drawn_offsets"] = np.concatenate([self.drawn_offsets, more], dtype=np.int64)
        index = np.arange(len(self))
        index[at[known]] = len(self) + known
        kept = np.ones(len(self), dtype=np.bool_)
        kept[gone] = False
        new = len(self) + np.flatnonzero(at < 0)
        return self._unchecked(values)._gathered(np.concatenate([index[kept], new]))

    @staticmethod
    def _unchecked(values: Mapping[str, Any]) -> Movables:
        clone = object.__new__(Movables)
        clone.__dict__.update({key: value for key, value in values.items() if key[0] != "_"})
        return clone

    def _gathered(self, index: IntArray) -> Movables:
        """The objects (N,) at an index each, which are distinct."""
        values = {name: frozen(getattr(self, name)[index]) for name in (*_ONE_EACH, "ids")}
        counts = np.diff(self.drawn_offsets)[index]
        offsets = np.zeros(len(index) + 1, dtype=np.int64)
        np.cumsum(counts, out=offsets[1:])
        starts = self.drawn_offsets[index]
        corners = np.arange(offsets[-1]) + np.repeat(starts - offsets[:-1], counts)
        values["drawn_vertices"] = frozen(self.drawn_vertices[corners])
        values["drawn_offsets"] = frozen(offsets)
        return self._unchecked(values)

    def _index_of(self, ids: IntArray) -> IntArray:
        """(N,) where objects with some ids are, -1 where there is none."""
        if not len(self):
            return np.full(len(ids), -1)
        order = self._order
        at = order[np.minimum(np.searchsorted(self.ids, ids, sorter=order), len(self) - 1)]
        return np.where(self.ids[at] == ids, at, -1)

    @cached_property
    def _order(self) -> IntArray:
        return np.argsort(self.ids)

    def _has_outlines_of(self, others: Movables, at: IntArray) -> bool:
        return np.array_equal(self.contact_radii[at], others.contact_radii) and all(
            np.array_equal(self.drawn_outline(k), others.drawn_outline(j))
            for j, k in enumerate(at.tolist())
        )

    @cached_property
    def radii(self) -> FloatArray:
        """(K,) radius [m] of the disc about each origin that holds the object."""
        if len(self) == 0:
            return frozen(np.zeros(0))
        reach = np.hypot(self.vertices[:, 0], self.vertices[:, 1])
        return frozen(np.maximum.reduceat(reach, self.offsets[:-1]))
