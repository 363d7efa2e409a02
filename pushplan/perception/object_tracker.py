"""`ObjectTracker`: outlines seen one after another become objects that last."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pushplan.perception.contour_alignment import Contour
from pushplan.perception.track import Sighting, Track, see_all, sightings_of
from pushplan.world import InvalidInputError, Movables
from pushplan.world.checks import FloatArray, IntArray, array, boolean, frozen, integer, number
from pushplan.world.convex_shapes import areas_and_centres, disjoint
from pushplan.world.outline import (
    ConvexParts,
    areas_and_centroids,
    convex_hull,
    convex_outlines,
    flatten,
    signed_area,
)
from pushplan.world.outline_repair import outline_parts

_SIZE_SPREAD = 0.2  # standard deviation of the relative difference of two sizes
_SAME_SIZE = 0.2  # relative difference of sizes up to which a jump may be of the same object
_REMEMBERED = 1.0  # for how long the identity of an unseen object is known at least [s]
_SOLID = 0.9  # area over that of the hull from which on noise may have made the dents


class NewSighting(NamedTuple):
    """A sighting that belongs to no track yet, since when [s], and how often it was seen."""

    sighting: Sighting
    since: float
    times: int


class ObjectTracker:
    """Gives objects an identity, a shape, a heading and a velocity from outlines with noise.

    Outlines may have noise at every corner, be concave, run either way round and start at any
    corner. A sighting within the gate of an expected place is that object (assignment of
    least cost); its shape is the mean of its sightings, and its pose the least-squares fit of
    that shape, filtered by how far the fit is off. A heading goes on from the one before, so that
    a square that turns by 90 degrees in a second has turned, and starts at 0.

    An object that is not seen moves on for half a second, comes to rest, and stays there until it
    has been unseen for ``keep`` seconds. Empty snapshots and missing ones are alike. An object
    that is seen outside every gate has jumped, or is new, once it was seen there ``confirm`` times
    one after another; until then the sighting is doubted. In the first snapshot, and after nothing
    was seen for ``keep`` seconds, all is believed.

    Args:
        gate: greatest distance from the expected place to a sighting [radii of the object],
            besides three standard deviations of that place.
        keep: how long an object is kept that is not seen [s].
        confirm: how many sightings it takes to believe a jump or a new object.
        acceleration: standard deviation of accelerations of objects, each of which lasts a
            fiftieth of a second [m/s²]; less smooths more.
        turn_acceleration: the same of turning [rad/s²].
        density: of objects, for their masses [kg/m²].
        wheeled: they stand on casters.

    Attributes:
        time: of the newest snapshot [s]; None before the first.
        movables: what the last `update` returned.
        ignored: how many snapshots were not later than the one before.
        flat: how many outlines had no area.

    Raises:
        InvalidInputError: if an argument is out of range.

    Example:
        >>> tracker = ObjectTracker()
        >>> seen = [[(0, 0), (0.1, 0.001), (0.1, 0.1), (0, 0.1)]]
        >>> tracker.update(seen, 0.0).ids.tolist()
        [0]
    """

    def __init__(
        self,
        *,
        gate: float = 1.0,
        keep: float = 5.0,
        confirm: int = 2,
        acceleration: float = 0.5,
        turn_acceleration: float = 3.0,
        density: float = 1.0,
        wheeled: bool = False,
    ) -> None:
        self.gate = number("gate", gate, low=0.0, open_low=True)
        self.keep = number("keep", keep, low=0.0, finite=False)
        self.confirm = integer("confirm", confirm, low=1)
        self._accelerations = (
            number("acceleration", acceleration, low=0.0, open_low=True),
            number("turn_acceleration", turn_acceleration, low=0.0, open_low=True),
        )
        self._density = number("density", density, low=0.0, open_low=True)
        self._wheeled = boolean("wheeled", wheeled)
        self.reset()

    def reset(self) -> None:
        """Forget everything; the next snapshot begins anew, at any time."""
        self.ignored = self.flat = 0
        self.time: float | None = None
        self._seen_at: float | None = None
        """Time of the newest snapshot that was not empty [s]."""
        self._tracks: list[Track] = []
        """Every object whose identity is remembered."""
        self._present: list[Track] = []
        """Those that are believed to be there."""
        self._candidates: list[NewSighting] = []
        self._next = 0
        self.movables = Movables.empty()
        self._shown: dict[int, tuple[int, int]] = {}

    @property
    def unseen_s(self) -> FloatArray:
        """(K,) for how long each object has not been seen [s]."""
        return frozen(np.array([one.time - one.seen_at for one in self._present], dtype=float))

    def update(
        self, polygons: Sequence[ArrayLike], stamp: float, ids: ArrayLike | None = None
    ) -> Movables:
        """Take a snapshot.

        Args:
            polygons: outlines of all that is seen, each (N, 2) corners in order [m], world frame.
                One without area counts as not seen.
            stamp: when it was seen [s]. A snapshot that is not later than the newest changes
                nothing.
            ids: (M,) distinct labels where perception knows them; by default the tracker gives
                its own. All snapshots of an episode have labels, or none has.

        Returns:
            All objects that are believed to be there now, seen or not, the oldest first. An
            outline has its centroid as origin; one with large dents is cut into convex parts.

        Raises:
            InvalidInputError: naming the value that is no number, not finite, of a wrong shape or
                given twice. The tracker is then as before.
        """
        stamp = number("stamp", stamp)
        if isinstance(polygons, str) or not isinstance(polygons, Sequence | np.ndarray):
            raise InvalidInputError(f"polygons must be a list of outlines, got {polygons!r:.60}")
        labels = None
        if ids is not None:
            labels = array("ids", ids, (len(polygons),), dtype=np.int64)
            if len(np.unique(labels)) != len(labels):
                raise InvalidInputError(f"ids must be distinct, got {labels.tolist()}")
        points = [array(f"polygons[{i}]", p, (None, 2)) for i, p in enumerate(polygons)]
        if self.time is not None and stamp <= self.time:
            self.ignored += 1
            return self.movables
        sightings = sightings_of(points, labels)
        self.flat += len(points) - len(sightings)
        remembered = max(self.keep, _REMEMBERED)
        self.time = stamp
        self._tracks = [one for one in self._tracks if stamp - one.seen_at <= remembered]
        for track in self._tracks:
            track.predict(stamp)
        if sightings:
            rest = self._match(sightings)
            if self._seen_at is None or stamp - self._seen_at > remembered:
                self._candidates = []
                for sighting in rest:
                    self._add(sighting)
            else:
                self._doubt(rest)
            self._seen_at = stamp
        # in the order of `movables`; an object that returns is appended
        self._tracks.sort(key=lambda one: one.label not in self._shown)
        self._present = [one for one in self._tracks if stamp - one.seen_at <= self.keep]
        self.movables = self._collected()
        return self.movables

    def _match(self, sightings: list[Sighting]) -> list[Sighting]:
        """Give the sightings within the gates to their tracks; return the others."""
        if not self._tracks:
            return sightings
        tracks = self._tracks
        deviations = [math.sqrt(one.place_variance) for one in tracks]
        gates = self.gate * np.array([one.radius for one in tracks]) + 3.0 * np.array(deviations)
        if sightings[0].label is None:
            pairs = list(
                assign(
                    _plane(np.array([one.centre for one in tracks])),
                    np.sqrt([one.area for one in tracks]),
                    gates,
                    _plane(np.array([one.centre for one in sightings])),
                    np.sqrt([one.area for one in sightings]),
                )
            )
        else:
            known = [one.label for one in tracks]
            labels = [int(one.label) for one in sightings if one.label is not None]
            _, *pairs = np.intersect1d(np.array(known), np.array(labels), return_indices=True)
        near = [
            (k, i)
            for k, i in zip(pairs[0].tolist(), pairs[1].tolist(), strict=True)
            if abs(tracks[k].centre - sightings[i].centre) <= gates[k]
        ]
        see_all([tracks[k] for k, _ in near], [sightings[i].contour for _, i in near])
        taken = {i for _, i in near}
        return [one for i, one in enumerate(sightings) if i not in taken]

    def _doubt(self, sightings: list[Sighting]) -> None:
        """Believe what was seen often enough at a place, and remember the others."""
        assert self.time is not None
        before = self._candidates
        self._candidates = []
        for sighting in sightings:
            lost = self._lost(sighting)
            if sighting.label is not None and lost is None:
                self._add(sighting)
                continue
            reach = self.gate * float(np.abs(sighting.contour - sighting.centre).max())
            near = [
                (away, k)
                for k, one in enumerate(before)
                if one.sighting.label == sighting.label
                and (away := abs(one.sighting.centre - sighting.centre)) <= reach
            ]
            found = NewSighting(sighting, self.time, 1)
            if near:
                old = before.pop(min(near)[1])
                found = NewSighting(sighting, old.since, old.times + 1)
            if found.times < self.confirm:
                self._candidates.append(found)
                continue
            if lost is not None and (sighting.label is not None or lost.seen_at <= found.since):
                lost.jump(sighting.centre)
                see_all([lost], [sighting.contour])
            else:
                self._add(sighting)

    def _lost(self, sighting: Sighting) -> Track | None:
        """The object that is not seen where it was and may be this sighting: the nearest."""
        if sighting.label is not None:
            return next((one for one in self._tracks if one.label == sighting.label), None)
        lost = [
            one
            for one in self._tracks
            if one.seen_at < one.time
            and abs(0.5 * math.log(one.area / sighting.area)) <= _SAME_SIZE
        ]
        return min(lost, key=lambda one: abs(one.centre - sighting.centre), default=None)

    def _add(self, sighting: Sighting) -> None:
        assert self.time is not None
        label = self._next
        if sighting.label is not None:
            label = int(sighting.label)
        self._next = max(self._next, label) + 1
        self._tracks.append(Track(label, sighting, self.time, self._accelerations))

    def _collected(self) -> Movables:
        """The tracks as `Movables`; outlines are made anew where a mean has become better."""
        shown = {one.label: (len(one.shape), one.sightings.bit_length()) for one in self._present}
        better = [one for one in self._present if self._shown.get(one.label) != shown[one.label]]
        gone = [label for label in self._shown if label not in shown]
        movables = self.movables
        self._shown = shown
        if better or gone:
            rings = [_plane(one.shape) for one in better]
            hulls = convex_outlines("outline", [convex_hull(ring) for ring in rings])
            areas, _ = areas_and_centroids(*flatten(hulls))
            shapes = list(map(_parts_of, rings, hulls, areas.tolist()))
            _, centres = areas_and_centres([disjoint(parts) for parts in shapes])
            for one, area, centre in zip(better, areas.tolist(), centres.tolist(), strict=True):
                one.area = area
                one.middle = complex(*centre)
            changed = Movables.from_outlines(
                [
                    tuple(part - centre for part in parts)
                    for parts, centre in zip(shapes, centres, strict=True)
                ],
                np.zeros((len(better), 3)),
                density=self._density,
                wheeled=np.full(len(better), self._wheeled),
                ids=np.array([one.label for one in better], dtype=np.int64),
            )
            movables = movables.updated(changed, np.array(gone, dtype=np.int64))
        return movables.moved_to(*self._states())

    def _states(self) -> tuple[FloatArray, FloatArray]:
        """(K, 3) poses and twists of the centroids."""
        states = [
            (one.centre, one.velocity, one.middle, one.heading, one.turn_rate)
            for one in self._present
        ]
        columns = np.array(states, dtype=complex).reshape(-1, 5).T.copy()
        centres, velocities, middles, headings, rates = columns
        arms = middles * np.exp(1j * headings)
        return (
            np.column_stack([_plane(centres + arms), headings.real]),
            np.column_stack([_plane(velocities + 1j * rates * arms), rates.real]),
        )


def _parts_of(ring: FloatArray, hull: FloatArray, area: float) -> ConvexParts:
    """Convex parts of an outline (N, 2) with noise, given its hull and the area of that [m²]."""
    if signed_area(ring) > _SOLID * area:
        return (hull,)
    try:
        return outline_parts("outline", ring, smooth=True).parts
    except InvalidInputError:  # noise has made it cross itself
        return (hull,)


def _plane(points: Contour) -> FloatArray:
    return np.column_stack([points.real, points.imag])


def assign(
    places: FloatArray,
    sizes: FloatArray,
    gates: FloatArray,
    seen_places: FloatArray,
    seen_sizes: FloatArray,
) -> tuple[IntArray, IntArray]:
    """Pair tracks with sightings: as many as the gates allow, most likely.

    Args:
        places: (K, 2) where the objects are expected [m].
        sizes: (K,) square roots of their areas [m].
        gates: (K,) greatest distance to a sighting [m].
        seen_places: (M, 2) of the sightings [m].
        seen_sizes: (M,) square roots of their areas [m].

    Returns:
        (P,) indices of tracks and (P,) of sightings.
    """
    near = cKDTree(seen_places).query_ball_point(places, gates)
    ks = np.repeat(np.arange(len(places)), [len(some) for some in near])
    js = np.concatenate([np.array(some, dtype=np.int64) for some in near])
    alone = (np.bincount(ks, minlength=len(places))[ks] == 1) & (np.bincount(js)[js] == 1)
    first = ks[alone]
    second = js[alone]
    ks = ks[~alone]
    js = js[~alone]
    away = np.hypot(*(places[ks] - seen_places[js]).T)
    ratio = np.log(seen_sizes[js] / sizes[ks]) / _SIZE_SPREAD
    # of a normal distribution with a third of the gate: a wide gate must not win by its width
    unlikely = 4.5 * (away / gates[ks]) ** 2 + 2.0 * np.log(gates[ks] / gates.min())
    costs = unlikely + np.minimum(0.5 * ratio**2, 2.0)
    # tracks and sightings that no chain of pairs within gates connects do not compete
    count = len(places) + len(seen_places)
    edges = csr_array((np.ones(len(ks)), (ks, len(places) + js)), shape=(count, count))
    _, labels = connected_components(edges, directed=False)
    for group in np.unique(labels[ks]).tolist():
        mine = labels[ks] == group
        tracks, k = np.unique(ks[mine], return_inverse=True)
        seen, j = np.unique(js[mine], return_inverse=True)
        top = costs[mine].max()
        table = np.full((len(tracks), len(seen)), (top + 1.0) * (1 + min(len(tracks), len(seen))))
        table[k, j] = costs[mine]  # the others are dearer than all open pairs together
        chosen = linear_sum_assignment(table)
        kept = table[chosen] <= top
        first = np.append(first, tracks[chosen[0][kept]])
        second = np.append(second, seen[chosen[1][kept]])
    return first, second
