"""The objects that may be pushed, as a structure of arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError, short
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
from pushplan.world.convex_shapes import areas_and_centres, disjoint, hull_of, rings_of, shapes_of
from pushplan.world.outline import (
    LARGEST_M,
    ConvexParts,
    areas_and_centroids,
    convex_outline,
    enclosing_outline,
    flatten,
    grown_outlines,
    transform,
    transform_outlines,
    unflatten,
    well_formed,
)

_OF_SHAPES = ("_contact_parts", "_contact_hulls", "_areas_and_centres", "_few_corners")
"""Caches that do not depend on poses."""
_ONE_EACH = ("poses", "twists", "masses", "wheeled", "contact_radii", "fixed", "gyration_radii")


@dataclass(frozen=True, eq=False)
class Movables(ArrayRecord, CheckedFields):
    """K objects that the robot may push, each a union of convex parts.

    The origin of each body frame is the centroid of the object, where the pressure on the
    ground is centred; `from_polygons` does that for corners in the world frame.

    Args:
        ids: (K,) distinct labels, kept for as long as the object exists.
        poses: (K, 3) x, y [m] and theta [rad], world frame.
        twists: (K, 3) velocities in the world frame [m/s, m/s, rad/s].
        masses: (K,) masses as the metrics count them [kg], positive.
        wheeled: (K,) True where the object stands on casters and rolls.
        drawn_vertices: (V, 2) outlines of P convex parts as drawn, in body frames, flattened [m];
            `convex_outline` says what is taken.
        drawn_offsets: (P + 1,) where each part starts in ``drawn_vertices``.
        contact_radii: (K,) distances from the drawn outlines at which objects touch others [m]:
            they are rounded by them. `vertices` are grown by them, and everything but masses,
            goals and files reads those.
        fixed: (K,) True where the object is held not to move, as far as one knows; all false if
            None. Planners count it as static (`World.with_fixed_as_static`); in a simulator's own
            world it is the truth.
        first_parts: (K + 1,) number of the first part of each object, then P; by default every
            object has one part.
        gyration_radii: (K,) radius of the limit surface of each object [m], whose square is moment
            of inertia over mass; where it is 0, which is the default, it follows from the area.
            Where it is given, the origin is the centre of pressure, wherever that is.

    Raises:
        InvalidInputError: if shapes disagree, a part is not convex or an object off its centroid.
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
    first_parts: Annotated[IntArray, Shape(None)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    gyration_radii: Annotated[FloatArray, Shape("K")] = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        ids: IntArray = array("movables.ids", self.ids, (None,), dtype=np.int64)
        defaults = {
            "fixed": np.zeros(len(ids), dtype=np.bool_),
            "first_parts": np.arange(len(ids) + 1),
            "gyration_radii": np.zeros(len(ids)),
        }
        for name, default in defaults.items():
            given = getattr(self, name)
            if given is None or np.array_equal(given, []):
                object.__setattr__(self, name, default)
        super().__post_init__()
        _check_starts("movables.first_parts", self.first_parts, len(self.ids))
        parts = int(self.first_parts[-1])
        if (np.diff(self.first_parts) < 1).any():
            raise InvalidInputError("movables.first_parts must give every object a part")
        _check_starts("movables.drawn_offsets", self.drawn_offsets, parts)
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
        given = self.gyration_radii[self.gyration_radii != 0.0]
        if not ((given > 1.0 / LARGEST_M) & (given <= LARGEST_M)).all():
            raise InvalidInputError(
                f"movables.gyration_radii must be 0, or more and at most {LARGEST_M:g} m, "
                f"got {self.gyration_radii.tolist()!s:.80}"
            )
        if self.drawn_offsets[-1] != len(self.drawn_vertices):
            raise InvalidInputError(
                "movables.drawn_offsets must rise from 0 to len(drawn_vertices)"
            )
        self._check_outlines()

    def _check_outlines(self) -> None:
        good = well_formed(self.drawn_vertices, self.drawn_offsets)
        if not good.all():
            outlines = [
                convex_outline(f"outline of movable {self.ids[k]}", part)
                for k in range(len(self))
                for part in self.drawn_parts(k)
            ]
            vertices, offsets = flatten(outlines)
            object.__setattr__(self, "drawn_vertices", vertices)
            object.__setattr__(self, "drawn_offsets", offsets)
        centres = self._areas_and_centres[1]
        off = np.abs(centres).max(axis=1, initial=0.0) > 1e-6 * self.radii
        for k in np.flatnonzero(off & (self.gyration_radii == 0.0)).tolist():
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
        gyration_radii: ArrayLike | None = None,
    ) -> Movables:
        """Objects from body-frame outlines whose centroid is the body origin.

        Args:
            outlines: K outlines as drawn: (N, 2) corners [m], a polygon of Shapely or a list of
                either, whose union is the object. What is not convex is cut into convex parts,
                and repaired if need be; see `pushplan.world.outline_repair`.
            poses: (K, 3) x, y [m], theta [rad].
            masses: (K,) [kg]; by default area times ``density``.
            density: [kg/m²].
            wheeled: (K,) flags, by default all false.
            twists: (K, 3), by default zero.
            ids: (K,), by default 0 to K - 1.
            contact_radii: (K,), or one for all [m].
            fixed: (K,) flags, by default all false.
            gyration_radii: (K,) radii of the limit surfaces [m], by default those of the outlines.
        """
        shapes = shapes_of("outline", outlines)
        count = len(shapes)
        vertices, offsets = flatten([part for parts in shapes for part in parts])
        if masses is None:
            density = number("density", density, low=0.0, open_low=True)
            masses = areas_and_centres([disjoint(parts) for parts in shapes])[0] * density
        values: dict[str, Any] = {
            "ids": np.arange(count) if ids is None else ids,
            "poses": poses,
            "twists": np.zeros((count, 3)) if twists is None else twists,
            "masses": masses,
            "wheeled": np.zeros(count, dtype=bool) if wheeled is None else wheeled,
            "contact_radii": contact_radii,
            "fixed": fixed,
            "first_parts": np.cumsum([0, *map(len, shapes)]),
            "gyration_radii": gyration_radii,
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
        """Objects from polygons in the world frame, as perception reports them.

        Each gets a pose at its centroid with theta = 0.

        Args:
            polygons: K shapes as `from_outlines` takes them [m].
            options: further arguments of `from_outlines`, such as ``masses``.
        """
        shapes = shapes_of("polygon", polygons)
        centres = areas_and_centres([disjoint(parts) for parts in shapes])[1]
        poses = np.column_stack([centres, np.zeros(len(shapes))])
        outlines = [
            [part - centre for part in parts] for parts, centre in zip(shapes, centres, strict=True)
        ]
        return cls.from_outlines(outlines, poses, **options)

    @property
    def is_compound(self) -> bool:
        """True if some object has more than one part."""
        return len(self.first_parts) != len(self.drawn_offsets)

    @cached_property
    def part_owners(self) -> IntArray:
        """(P,) object to which each part belongs."""
        owners: IntArray = np.repeat(np.arange(len(self)), np.diff(self.first_parts))
        return frozen(owners)

    @cached_property
    def _contact_parts(self) -> tuple[FloatArray, IntArray]:
        if not self.contact_radii.any():
            return self.drawn_vertices, self.drawn_offsets
        radii = self.contact_radii[self.part_owners]
        grown = grown_outlines(self.drawn_vertices, self.drawn_offsets, radii)
        return frozen(grown[0]), frozen(grown[1])

    @cached_property
    def _contact_hulls(self) -> tuple[FloatArray, IntArray]:
        if not self.is_compound:
            return self._contact_parts
        return flatten([hull_of(self.parts(k)) for k in range(len(self))])

    @property
    def part_vertices(self) -> FloatArray:
        """(W, 2) parts as others touch them: grown by the contact radii, not rounded [m]."""
        return self._contact_parts[0]

    @property
    def part_offsets(self) -> IntArray:
        """(P + 1,) where each part starts in `part_vertices`."""
        return self._contact_parts[1]

    @property
    def vertices(self) -> FloatArray:
        """(V, 2) convex hulls of the objects as others touch them [m]."""
        return self._contact_hulls[0]

    @property
    def offsets(self) -> IntArray:
        """(K + 1,) where each hull starts in `vertices`."""
        return self._contact_hulls[1]

    def drawn_parts(self, k: int) -> ConvexParts:
        """Convex parts of object ``k`` as drawn, each (N, 2) in its body frame [m]."""
        first, last = self.first_parts[k : k + 2].tolist()
        return unflatten(self.drawn_vertices, self.drawn_offsets[first : last + 1])

    def parts(self, k: int) -> ConvexParts:
        """Convex parts of object ``k`` as others touch it, each (N, 2) in its body frame [m]."""
        first, last = self.first_parts[k : k + 2].tolist()
        return unflatten(self.part_vertices, self.part_offsets[first : last + 1])

    def rings(self, k: int) -> tuple[FloatArray, ...]:
        """Closed outlines of object ``k`` as others touch it, holes too, each (N, 2) [m]."""
        return rings_of(self.parts(k))

    def parts_world(self, k: int) -> ConvexParts:
        """The `parts` of object ``k`` in the world frame [m]."""
        return tuple(transform(self.poses[k], part) for part in self.parts(k))

    def within(
        self,
        contains_each: Callable[[FloatArray, IntArray], BoolArray],
        poses: FloatArray | None = None,
    ) -> BoolArray:
        """(K,) True for objects all of whose parts, as drawn, are within an area.

        Args:
            contains_each: takes flattened outlines in the world frame, and says it of each.
            poses: (K, 3) of the objects; where they are if None.
        """
        at = (self.poses if poses is None else poses)[self.part_owners]
        corners = transform_outlines(at, self.drawn_vertices, self.drawn_offsets)
        inside = contains_each(corners, self.drawn_offsets)
        if not self.is_compound:
            return inside
        every: BoolArray = np.logical_and.reduceat(inside, self.first_parts[:-1])
        return every

    def outline(self, k: int) -> FloatArray:
        """(N, 2) convex hull of object ``k`` as others touch it, in its body frame [m]."""
        return self.vertices[self.offsets[k] : self.offsets[k + 1]]

    def outline_world(self, k: int) -> FloatArray:
        """(N, 2) convex hull of object ``k`` in the world frame [m]."""
        return transform(self.poses[k], self.outline(k))

    @property
    def vertices_world(self) -> FloatArray:
        """(V, 2) `vertices` in the world frame [m]."""
        return transform_outlines(self.poses, self.vertices, self.offsets)

    @property
    def every_part_world(self) -> ConvexParts:
        """The P parts of all objects in the world frame, each (N, 2) [m]."""
        return unflatten(self.part_vertices_world, self.part_offsets)

    @property
    def part_vertices_world(self) -> FloatArray:
        """(W, 2) `part_vertices` in the world frame [m]."""
        return transform_outlines(
            self.poses[self.part_owners], self.part_vertices, self.part_offsets
        )

    def pieces(self, k: int) -> ConvexParts:
        """Convex pieces that make up object ``k`` as drawn and do not overlap, each (N, 2) [m].

        Sums over its area are sums over them.
        """
        return disjoint(self.drawn_parts(k))

    def contact_pieces(self, k: int) -> ConvexParts:
        """The `pieces` of object ``k`` as others touch it."""
        return disjoint(self.parts(k))

    @cached_property
    def _areas_and_centres(self) -> tuple[FloatArray, FloatArray]:
        if not self.is_compound:
            return areas_and_centroids(self.drawn_vertices, self.drawn_offsets)
        return areas_and_centres([self.pieces(k) for k in range(len(self))])

    @property
    def areas(self) -> FloatArray:
        """(K,) areas of the objects as drawn [m²]."""
        return self._areas_and_centres[0]

    @property
    def contact_areas(self) -> FloatArray:
        """(K,) areas of the objects as others touch them [m²]."""
        if not self.is_compound:
            return areas_and_centroids(self.part_vertices, self.part_offsets)[0]
        return areas_and_centres([self.contact_pieces(k) for k in range(len(self))])[0]

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

    @cached_property
    def _few_corners(self) -> tuple[FloatArray, IntArray]:
        return flatten(
            [*map(enclosing_outline, unflatten(self.drawn_vertices, self.drawn_offsets))]
        )

    def with_few_corners(self) -> Movables:
        """The objects with each part as `pushplan.world.outline.enclosing_outline` makes it."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        values["drawn_vertices"], values["drawn_offsets"] = map(frozen, self._few_corners)
        return self._unchecked(values)

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
        for name in ("drawn_offsets", "first_parts"):
            more = getattr(self, name)[-1] + getattr(changes, name)[1:]
            values[name] = np.concatenate([getattr(self, name), more], dtype=np.int64)
        index = np.arange(len(self))
        index[at[known]] = len(self) + known
        kept = np.ones(len(self), dtype=np.bool_)
        kept[gone] = False
        new = len(self) + np.flatnonzero(at < 0)
        return self._unchecked(values)._gathered(np.concatenate([index[kept], new]))

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take pickles of before objects had parts too."""
        count = len(state["ids"])
        state.setdefault("first_parts", np.arange(count + 1))
        state.setdefault("gyration_radii", np.zeros(count))
        super().__setstate__(state)

    @staticmethod
    def _unchecked(values: Mapping[str, Any]) -> Movables:
        clone = object.__new__(Movables)
        kept = {key: value for key, value in values.items() if key[0] != "_" or key in _OF_SHAPES}
        clone.__dict__.update(kept)
        return clone

    def _gathered(self, index: IntArray) -> Movables:
        """The objects (N,) at an index each, which are distinct."""
        values = {name: frozen(getattr(self, name)[index]) for name in (*_ONE_EACH, "ids")}
        parts, values["first_parts"] = _rows_of(self.first_parts, index)
        corners, values["drawn_offsets"] = _rows_of(self.drawn_offsets, parts)
        values["drawn_vertices"] = frozen(self.drawn_vertices[corners])
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
            len(self.drawn_parts(k)) == len(others.drawn_parts(j))
            and all(map(np.array_equal, self.drawn_parts(k), others.drawn_parts(j)))
            for j, k in enumerate(at.tolist())
        )

    @cached_property
    def radii(self) -> FloatArray:
        """(K,) radius [m] of the disc about each origin that holds the object."""
        if len(self) == 0:
            return frozen(np.zeros(0))
        reach = np.hypot(self.vertices[:, 0], self.vertices[:, 1])
        return frozen(np.maximum.reduceat(reach, self.offsets[:-1]))


def _rows_of(starts: IntArray, index: IntArray) -> tuple[IntArray, IntArray]:
    """The rows of some of a list of groups, and where each of these then starts.

    Args:
        starts: (G + 1,) row at which each group starts.
        index: (N,) the groups.
    """
    counts = np.diff(starts)[index]
    offsets = np.zeros(len(index) + 1, dtype=np.int64)
    np.cumsum(counts, out=offsets[1:])
    rows = np.arange(offsets[-1]) + np.repeat(starts[index] - offsets[:-1], counts)
    return rows, frozen(offsets)


def _check_starts(name: str, starts: IntArray, count: int) -> None:
    array(name, starts, (count + 1,), dtype=np.int64)
    if starts[0] != 0 or (np.diff(starts) < 0).any():
        raise InvalidInputError(f"{name} must rise from 0, got {short(starts.tolist())}")
