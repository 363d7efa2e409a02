"""A beam search over arcs whose costs depend on what was pushed before."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from pushplan.core import interaction, planners
from pushplan.interaction.network import IceNetwork
from pushplan.interaction.occupancy import CHANNELS, PATCH_CELLS, Patch, cell_size, ice_density
from pushplan.planners.ship_predictive.channel_view import ChannelView
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import StopCheck
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import step_lengths

SPACING = 0.05
"""Between the poses of a path, in hull lengths."""
_CELL = 0.08
"""Side of a cell in which paths end at the same place [hull lengths]."""
_HEADING_CELL = 0.2
"""Difference of headings up to which they are the same [rad]."""
_TRIES = 2.5
"""Pieces predicted exactly for each path kept; the others are left out by their estimate."""
_TRACED = 10  # poses that are swept between two looks at the stop rule

Ice = TypeVar("Ice")


@dataclass(slots=True)
class BeamNode(Generic[Ice]):
    """A path from the start on."""

    pose: FloatArray
    """(3,) where it ends."""
    arc: FloatArray
    """(N, 4) last piece: poses, the first being that of the parent, and curvatures to each."""
    length: float
    work: float
    total: float
    """Cost so far plus estimate of the rest [kg m]."""
    ice: Ice
    parent: BeamNode[Ice] | None
    done: bool = False
    """True once the node has reached the goal."""

    def chain(self) -> list[BeamNode[Ice]]:
        """The nodes from the start on."""
        found: list[BeamNode[Ice]] = []
        at: BeamNode[Ice] | None = self
        while at is not None:
            found.append(at)
            at = at.parent
        return found[::-1]

    def path(self) -> FloatArray:
        """(N, 4) poses and curvatures from the start on."""
        first, *others = self.chain()
        return np.concatenate([first.arc, *(node.arc[1:] for node in others)])


class StatePropagator(Protocol[Ice]):
    """Keeps the ice along a path and says what going on does to it."""

    batch: int
    """Number of pieces that are predicted between two looks at the stop rule."""

    def start(self) -> Ice:
        """The ice now."""
        ...

    def advance(self, ices: Sequence[Ice], paths: Sequence[FloatArray]) -> list[tuple[Ice, float]]:
        """The ice after each piece (N, 3) of path, and the work on it [kg m]."""
        ...

    def trace(self, node: BeamNode[Ice], stopped: Callable[[], bool]) -> FloatArray | None:
        """(N, K, 3) poses of the floes in reach at each pose of a path; None if stopped before."""
        ...


@dataclass(eq=False)
class BeamSearch(Generic[Ice]):
    """Builds paths piece by piece and keeps the most promising ones.

    Each piece of each path is first judged by the costs to go; the best are predicted with the ice
    as the path has left it. Among paths that end at nearly the same place and heading only the
    cheapest is kept (as Zhong et al. 2025 do at lattice nodes).
    """

    view: ChannelView
    config: PredictiveConfig
    propagator: StatePropagator[Ice]
    check: StopCheck  # the armed stop rule
    iterations: int = 0  # predictions so far, of earlier searches of the call too
    nodes: int = 0
    best_cost: float = math.inf
    stopped: bool = False

    def root(self) -> BeamNode[Ice]:
        """The path that has not begun."""
        pose = self.view.start
        arc = np.array([[*pose, 0.0]])
        return BeamNode(pose, arc, 0.0, 0.0, 0.0, self.propagator.start(), None)

    def search(self, root: BeamNode[Ice], width: int, horizon: float) -> BeamNode[Ice] | None:
        """The most promising path of a beam that looks ``horizon`` [m] ahead.

        Returns:
            None where no piece fits, or the stop rule fired before the horizon.
        """
        layer = [root]
        finished = None
        for _ in range(max(1, math.ceil(horizon / (self.config.arc * self.view.length)))):
            children = self._predict(self._candidates(layer, width))
            if self.stopped:
                return finished
            ended = [child for child in children if child.done]
            for child in ended:
                if finished is None or child.total < finished.total:
                    finished = child
            layer = self._thinned([c for c in children if not c.done], width)
            self.nodes += len(layer)
            if not layer or (finished is not None and finished.total <= layer[0].total):
                break
        if finished is not None and (not layer or finished.total <= layer[0].total):
            return finished
        return layer[0] if layer else None

    def _candidates(
        self, layer: list[BeamNode[Ice]], width: int
    ) -> list[tuple[float, BeamNode[Ice], FloatArray]]:
        """Pieces that go on from a layer: those whose estimates are best."""
        found = []
        for node in layer:
            if self.check(self.iterations, self.best_cost):
                self.stopped = True
                return []
            for curvature in self.view.curvatures:
                arc = self._arc(node.pose, float(curvature))
                if len(arc) < 2:
                    continue
                found.append((self._cost(node.length, node.work, arc, None), node, arc))
        found.sort(key=lambda item: item[0])
        return found[: math.ceil(_TRIES * width)]

    def _arc(self, pose: FloatArray, curvature: float) -> FloatArray:
        """(N, 4) an arc, cut off at the goal; empty where it leaves the channel."""
        view = self.view
        count = max(1, round(self.config.arc / SPACING))
        step = SPACING * view.length
        arc = np.empty((count + 1, 4))
        arc = arc[: planners.arc_ahead(*view.channel, pose, curvature, step, arc)]
        return arc[:0] if view.askew and not view.inside(arc) else arc

    def _cost(self, length: float, work: float, arc: FloatArray, done: float | None) -> float:
        """Cost up to the end of a piece plus what the costs to go expect of the rest."""
        view = self.view
        w = self.config.push_weight
        step = SPACING * view.length
        ahead = step * (len(arc) - 1)
        mass = view.world.robot.mass
        expected, rest = view.costs.cost_ahead(arc, step)
        done = expected if done is None else done
        return mass * (length + ahead) + w * (work + done) + rest

    def _predict(
        self, candidates: list[tuple[float, BeamNode[Ice], FloatArray]]
    ) -> list[BeamNode[Ice]]:
        """The candidates as paths, with the ice that they leave."""
        found: list[BeamNode[Ice]] = []
        step = SPACING * self.view.length
        for i in range(0, len(candidates), self.propagator.batch):
            if self.check(self.iterations, self.best_cost):
                self.stopped = True
                return found
            chosen = candidates[i : i + self.propagator.batch]
            ices = [node.ice for _, node, _ in chosen]
            ahead = self.propagator.advance(ices, [arc[:, :3] for _, _, arc in chosen])
            self.iterations += len(chosen)
            for (_, node, arc), (ice, work) in zip(chosen, ahead, strict=True):
                total = self._cost(node.length, node.work, arc, work)
                found.append(
                    BeamNode(
                        pose=arc[-1, :3],
                        arc=arc,
                        length=node.length + step * (len(arc) - 1),
                        work=node.work + work,
                        total=total,
                        ice=ice,
                        parent=node,
                        done=bool(arc[-1, 1] >= self.view.channel.goal),
                    )
                )
        return found

    def _thinned(self, layer: list[BeamNode[Ice]], width: int) -> list[BeamNode[Ice]]:
        """The best of a layer, one for each place and heading."""
        layer.sort(key=lambda node: node.total)
        cell = _CELL * self.view.length
        kept = []
        seen = set()
        for node in layer:
            place = (
                round(node.pose[0] / cell),
                round(node.pose[1] / cell),
                round(node.pose[2] / _HEADING_CELL),
            )
            if place not in seen:
                seen.add(place)
                kept.append(node)
            if len(kept) == width:
                break
        return kept

    def finish(self, node: BeamNode[Ice]) -> BeamNode[Ice] | None:
        """Go on from a path to the goal as the costs to go say, and predict that too.

        Returns:
            None where that leaves the channel, or the stop rule fired on it.
        """
        view = self.view
        w = self.config.push_weight
        step = SPACING * view.length
        turning = 2.0 * math.pi * view.radius
        most = math.ceil((4.0 * max(view.channel.goal - node.pose[1], 0.0) + turning) / step)
        mass = view.world.robot.mass
        if node.pose[1] < view.channel.goal:
            out = np.empty((most, 4))
            count = view.costs.steer_on(node.pose, view.curvatures, step, out)
            if count == 0 or not view.inside(out[:count]):
                return None
            followed = self.follow(node, np.concatenate([[[*node.pose, 0.0]], out[:count]]))
            if followed is None:
                return None
            node = followed
        node.done = True
        node.total = mass * node.length + w * node.work
        return node

    def follow(self, node: BeamNode[Ice], path: FloatArray) -> BeamNode[Ice] | None:
        """A path with another (N, 4) at its end, predicted; None if the stop rule fires on it.

        The first pose of the other one is that where the path ends.
        """
        each = max(1, round(self.config.arc / SPACING))
        for i in range(0, len(path) - 1, each):
            if self.check(self.iterations, self.best_cost):
                self.stopped = True
                return None
            node = self.extend(node, path[i : i + each + 1])
        return node

    def extend(self, node: BeamNode[Ice], arc: FloatArray) -> BeamNode[Ice]:
        """A path with one more piece (N, 4) at its end, predicted."""
        ice, work = self.propagator.advance([node.ice], [arc[:, :3]])[0]
        self.iterations += 1
        pieces = step_lengths(arc)
        return BeamNode(
            pose=arc[-1, :3],
            arc=arc,
            length=node.length + float(pieces.sum()),
            work=node.work + work,
            total=math.inf,
            ice=ice,
            parent=node,
        )


class FloePropagator:
    """The ice as poses (N, K, 3) of the floes in reach, at each pose of the last piece of path."""

    batch = 1

    def __init__(self, view: ChannelView) -> None:
        self._floes = view.floes
        self._contacts = interaction.IceContacts(view.bodies, *view.settings)

    def start(self) -> FloatArray:
        """The floes now."""
        return self._floes[None]

    def advance(
        self, ices: Sequence[FloatArray], paths: Sequence[FloatArray]
    ) -> list[tuple[FloatArray, float]]:
        """The floes along each piece of path, and the work on them [kg m]."""
        return [self.sweep(ice[-1], path) for ice, path in zip(ices, paths, strict=True)]

    def sweep(
        self,
        floes: FloatArray,  # (K, 3) where they are before
        path: FloatArray,  # (N, 3) poses of the ship
    ) -> tuple[FloatArray, float]:
        """(N, K, 3) poses of the floes at each pose (N, 3) of a path, and the work [kg m]."""
        poses = floes.copy()
        out = np.empty((len(path), *poses.shape))
        return out, self._contacts.sweep(np.ascontiguousarray(path), poses, out)

    def trace(self, node: BeamNode[FloatArray], stopped: Callable[[], bool]) -> FloatArray:
        """(N, K, 3) poses of the floes at each pose of a path: they are known."""
        first, *others = node.chain()
        return np.concatenate([first.ice, *(later.ice[1:] for later in others)])


class MapPropagator:
    """The ice as a map (H, W) of covered fractions; each piece of path changes a patch of it."""

    batch = 8

    def __init__(self, view: ChannelView, network: IceNetwork) -> None:
        self._view = view
        self._network = network
        self._cell = cell_size(view.world)
        self._scale = ice_density(view.world) * self._cell**3
        half = PATCH_CELLS // 2
        channel = view.channel
        reach = half * self._cell
        low = np.array([channel.low[0] - reach, -view.length - reach])
        high = np.array([channel.high[0] + reach, max(channel.goal, 0.0) + view.length + reach])
        self._corner = self._cell * np.floor(low / self._cell)
        columns, rows = np.ceil((high - self._corner) / self._cell).astype(int)
        self._start = np.zeros((max(rows, PATCH_CELLS), max(columns, PATCH_CELLS)), np.float32)
        objects = view.objects
        floes = view.floes[objects.part_owners]
        frame = np.array([*self._corner, 0.0])
        interaction.cover_objects(
            floes, objects.part_vertices, objects.part_offsets, frame, self._cell, self._start
        )

    def start(self) -> Patch:
        """The map now."""
        return self._start

    def advance(
        self, ices: Sequence[Patch], paths: Sequence[FloatArray]
    ) -> list[tuple[Patch, float]]:
        """The maps after each piece of path, and the work on the ice [kg m]; one network call."""
        robot = self._view.world.robot
        patches = np.empty((len(ices), len(CHANNELS), PATCH_CELLS, PATCH_CELLS), np.float32)
        places = [self._place(path) for path in paths]
        for i, (ice, path, (row, column)) in enumerate(zip(ices, paths, places, strict=True)):
            patches[i, 0] = ice[row : row + PATCH_CELLS, column : column + PATCH_CELLS]
            corner = self._corner + self._cell * np.array([column, row])
            frame = np.array([*corner, 0.0])
            poses = np.ascontiguousarray(path)
            hull = (robot.vertices, robot.offsets, frame, self._cell)
            interaction.cover_sweep(poses[:1], *hull, patches[i, 1])
            interaction.cover_sweep(poses, *hull, patches[i, 2])
        after, work = self._network.predict_patches(patches)
        found = []
        for i, (ice, (row, column)) in enumerate(zip(ices, places, strict=True)):
            changed = ice.copy()
            changed[row : row + PATCH_CELLS, column : column + PATCH_CELLS] = after[i]
            found.append((changed, float(work[i]) * self._scale))
        return found

    def trace(self, node: BeamNode[Patch], stopped: Callable[[], bool]) -> FloatArray | None:
        """(N, K, 3) poses of the floes at each pose of a path, by the contact model."""
        floes = FloePropagator(self._view)
        path = node.path()[:, :3]
        out = self._view.floes[None]
        parts = [out]
        for i in range(0, len(path) - 1, _TRACED):
            if stopped():
                return None
            out = floes.sweep(out[-1], path[i : i + _TRACED + 1])[0]
            parts.append(out[1:])
        return np.concatenate(parts)

    def _place(self, path: FloatArray) -> tuple[int, int]:
        """First row and column of the patch about the middle between a piece's two ends."""
        middle = 0.5 * (path[0, :2] + path[-1, :2])
        column, row = (middle - self._corner) / self._cell
        rows, columns = self._start.shape
        half = PATCH_CELLS // 2
        return (
            min(max(math.floor(row + 0.5) - half, 0), rows - PATCH_CELLS),
            min(max(math.floor(column + 0.5) - half, 0), columns - PATCH_CELLS),
        )
