"""Shortest curves between poses, and the way around what blocks them."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass

import numpy as np

from pushplan.core import motion as core
from pushplan.world.checks import FloatArray

_ARCS = 5  # pieces of a curve at most
_VIAS = 150  # random poses that a way around may lead through
_NEAREST = 12  # of them, by length of the curve, to which each leads on
_JOINED = 30  # nearest nodes with which those near start and end are joined
_ANGLES = (0.35, 0.8, 1.4)  # of arcs from the ends that it may lead along [rad]


@dataclass(frozen=True)
class Turning:
    """Limits on how a body turns.

    Args:
        radius: least turning radius [m].
        reverses: it drives back as well.
        step: distance of the poses along a curve [m].
    """

    radius: float
    reverses: bool
    step: float

    def length(self, start: FloatArray, end: FloatArray) -> float:
        """Length [m] of the shortest curve between poses (3,)."""
        arcs = np.empty((_ARCS, 2))
        return core.shortest_curve(start, end, self.radius, self.reverses, arcs)

    def poses(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """(N, 3) poses along the shortest curve, with both ends.

        Sources: Dubins, American Journal of Mathematics 79 (1957); Reeds and Shepp, Pacific
        Journal of Mathematics 145 (1990).
        """
        arcs = np.empty((_ARCS, 2))
        length = core.shortest_curve(start, end, self.radius, self.reverses, arcs)
        if not math.isfinite(length):
            return np.empty((0, 3))
        pieces = np.ascontiguousarray(arcs[arcs[:, 0] != 0.0])
        room = int(length / self.step) + 4 * _ARCS
        out = np.empty((room, 3))
        count = core.sample_pieces(start, pieces, self.step, out, np.empty(room))
        return np.vstack([start, out[:count]])


def is_clear(checker: core.CollisionChecker, poses: FloatArray) -> bool:
    """True if there are poses (N, 3), and none of them is blocked."""
    return len(poses) > 0 and checker.first_blocked(poses) == len(poses)


def way_around(
    turning: Turning,
    start: FloatArray,
    end: FloatArray,
    checker: core.CollisionChecker,
    bounds: FloatArray,
    most: float = math.inf,
) -> FloatArray | None:
    """(N, 3) poses of a clear way from start to end (3,), with both; None if none is found.

    The shortest curve if that is clear, else a shortest path of such curves through free poses,
    whose curves are checked only where a path would take them (Bohlin and Kavraki, "Path planning
    using lazy PRM", ICRA 2000). The poses are the same in each call.

    Args:
        turning: how the body turns.
        start: (3,).
        end: (3,).
        checker: of the body.
        bounds: (4,) within which the poses are drawn [m].
        most: greatest length [m].
    """
    if turning.length(start, end) > most:
        return None
    direct = turning.poses(start, end)
    if is_clear(checker, direct):
        return direct
    if not (checker.is_free(start) and checker.is_free(end)):
        return None
    return _Roadmap(turning, checker, start, end, bounds).path(most)


@functools.lru_cache(maxsize=16)
def _drawn(turning: Turning, bounds: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses in a workspace, and (N, N) lengths of the shortest curves from each [m]."""
    x0, y0, x1, y1 = bounds
    poses = np.random.default_rng(0).uniform((x0, y0, -math.pi), (x1, y1, math.pi), (_VIAS, 3))
    lengths = np.array([[turning.length(a, b) for b in poses] for a in poses])
    np.fill_diagonal(lengths, math.inf)
    for row in lengths:
        row[np.argsort(row, kind="stable")[_NEAREST:]] = math.inf
    return poses, lengths


def _beside(turning: Turning, pose: FloatArray, ahead: float) -> list[FloatArray]:
    """Poses (3,) on straight ways and arcs from a pose, also the other way if it reverses."""
    found = []
    for sign in (ahead, -ahead) if turning.reverses else (ahead,):
        for angle in _ANGLES:
            for curvature in (0.0, 1.0 / turning.radius, -1.0 / turning.radius):
                out = np.empty(3)
                core.along_arc(pose, sign * angle * turning.radius, curvature, out)
                found.append(out)
    return found


class _Roadmap:
    """Poses joined by curves; the first is the start, the second the end."""

    def __init__(
        self,
        turning: Turning,
        checker: core.CollisionChecker,
        start: FloatArray,
        end: FloatArray,
        bounds: FloatArray,
    ) -> None:
        self._turning = turning
        self._checker = checker
        drawn, lengths = _drawn(turning, tuple(bounds.tolist()))
        free = [i for i, pose in enumerate(drawn) if checker.is_free(pose)]
        beside = [*_beside(turning, start, 1.0), *_beside(turning, end, -1.0)]
        near = [start, end, *(pose for pose in beside if checker.is_free(pose))]
        self._nodes = [*near, *drawn[free]]
        count = len(self._nodes)
        first = len(near)
        self._lengths = np.full((count, count), math.inf)
        self._lengths[first:, first:] = lengths[np.ix_(free, free)]
        places = np.array(self._nodes)[:, :2]
        for i in range(first):
            away = np.hypot(*(places - places[i]).T)
            for j in np.argsort(away, kind="stable")[:_JOINED].tolist():
                self._join(i, j)
                self._join(j, i)
        self._lengths[0, 1] = math.inf  # the direct curve is blocked
        self._known: dict[tuple[int, int], FloatArray] = {}

    def _join(self, i: int, j: int) -> None:
        """Take up the curve from one node to another."""
        if i not in (1, j) and j != 0:
            self._lengths[i, j] = self._turning.length(self._nodes[i], self._nodes[j])

    def path(self, most: float) -> FloatArray | None:
        """The shortest clear path, looked for until the shortest is clear or too long."""
        from scipy.sparse import csr_array  # takes longer than the rest of this room
        from scipy.sparse.csgraph import dijkstra

        rows, columns = np.nonzero(np.isfinite(self._lengths))
        count = len(self._nodes)
        graph = csr_array((self._lengths[rows, columns], (rows, columns)), shape=(count, count))
        numbers = {
            edge: n for n, edge in enumerate(zip(rows.tolist(), columns.tolist(), strict=True))
        }
        while True:
            costs, before = dijkstra(graph, directed=True, indices=[0], return_predecessors=True)
            if not costs[0, 1] <= most or math.isinf(costs[0, 1]):
                return None
            chain = [1]
            while chain[-1] != 0:
                chain.append(int(before[0, chain[-1]]))
            chain.reverse()
            edges = list(itertools.pairwise(chain))
            blocked = [edge for edge in edges if not self._is_clear(edge)]
            if not blocked:
                parts = [self._known[edge] for edge in edges]
                path = np.vstack([parts[0], *(part[1:] for part in parts[1:])])
                path[:, 2] = np.unwrap(path[:, 2])
                return path
            for edge in blocked:
                graph.data[numbers[edge]] = math.inf

    def _is_clear(self, edge: tuple[int, int]) -> bool:
        if edge not in self._known:
            i, j = edge
            poses = self._turning.poses(self._nodes[i], self._nodes[j])
            if not is_clear(self._checker, poses):
                return False
            self._known[edge] = poses
        return True
