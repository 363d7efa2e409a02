"""A search over arcs whose costs depend on what was pushed before: a beam with carried ice."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from pushplan.planners.ship_predictive.cost_to_go import arc_ahead, price_ahead, steer_on
from pushplan.planners.ship_predictive.ice_scene import Scene
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import StopCheck
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import step_lengths

SPACING = 0.05
"""Between the poses of a path, in hull lengths."""
Ice = TypeVar("Ice")


class Carrier(Protocol[Ice]):
    """Keeps the ice along a partial path and says what going on does to it."""

    batch: int
    """How many pieces are predicted between two looks at the stop rule."""

    def start(self) -> Ice:
        """The ice now."""
        ...

    def advance(self, ices: Sequence[Ice], paths: Sequence[FloatArray]) -> list[tuple[Ice, float]]:
        """The ice after each piece (N, 3) of path, and the work on it [kg m]."""
        ...

    def trace(self, node: Partial[Ice], stopped: Callable[[], bool]) -> FloatArray | None:
        """(N, K, 3) poses of the floes in reach at each pose of a path; None if stopped before."""
        ...


@dataclass(slots=True)
class Partial(Generic[Ice]):
    """A path from the start on."""

    pose: FloatArray
    """(3,) where it ends."""
    way: FloatArray
    """(N, 4) last piece: poses, the first being that of the parent, and curvatures to each."""
    length: float
    work: float
    total: float
    """Cost so far plus estimate of the rest [kg m]."""
    ice: Ice
    parent: Partial[Ice] | None
    done: bool = False
    """Whether it has reached the goal."""

    def path(self) -> FloatArray:
        """(N, 4) poses and curvatures from the start on."""
        pieces: list[FloatArray] = []
        at: Partial[Ice] | None = self
        while at is not None:
            pieces.append(at.way if at.parent is None else at.way[1:])
            at = at.parent
        return np.concatenate(pieces[::-1])

    def ices(self) -> list[Ice]:
        """The ice after each piece, from the start on."""
        found: list[Ice] = []
        at: Partial[Ice] | None = self
        while at is not None:
            found.append(at.ice)
            at = at.parent
        return found[::-1]


class Beam(Generic[Ice]):
    """Builds paths piece by piece and keeps the most promising ones.

    Each piece of each path is first judged by the guide; the best are predicted with the ice as
    the path has left it. Costs to go come from the guide. Among paths that end at nearly the same
    place and heading only the cheapest is kept (as Zhong et al. 2025 do at lattice nodes).

    Args:
        scene: what is searched.
        config: parameters.
        carrier: predicts.
        check: an armed stop rule.
        iterations: predictions that the call has made before.
    """

    def __init__(
        self,
        scene: Scene,
        config: PredictiveConfig,
        carrier: Carrier[Ice],
        check: StopCheck,
        iterations: int = 0,
    ) -> None:
        self.scene, self.config, self.carrier, self.check = scene, config, carrier, check
        self.iterations, self.nodes = iterations, 0
        self.best_cost = math.inf
        self.stopped = False

    def root(self) -> Partial[Ice]:
        """The path that has not begun."""
        pose = self.scene.start
        way = np.array([[*pose, 0.0]])
        return Partial(pose, way, 0.0, 0.0, 0.0, self.carrier.start(), None)

    def search(self, root: Partial[Ice], width: int, horizon: float) -> Partial[Ice] | None:
        """The most promising path of a beam.

        Args:
            root: where to begin.
            width: paths kept from piece to piece.
            horizon: how far ahead to look [m].

        Returns:
            None where no piece fits, or the stop rule fired before the horizon.
        """
        layer, finished = [root], None
        for _ in range(max(1, math.ceil(horizon / (self.config.arc * self.scene.length)))):
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
        self, layer: list[Partial[Ice]], width: int
    ) -> list[tuple[float, Partial[Ice], FloatArray]]:
        """Pieces that go on from a layer: those whose estimates are best."""
        found = []
        for node in layer:
            if self.check(self.iterations, self.best_cost):
                self.stopped = True
                return []
            for bend in self.scene.bends:
                way = self._piece(node.pose, float(bend))
                if len(way) < 2:
                    continue
                found.append((self._cost(node.length, node.work, way, None), node, way))
        found.sort(key=lambda item: item[0])
        return found[: math.ceil(self.config.tries * width)]

    def _piece(self, pose: FloatArray, bend: float) -> FloatArray:
        """(N, 4) an arc, cut off at the goal; empty where it leaves the channel."""
        scene = self.scene
        count = max(1, round(self.config.arc / SPACING))
        step = SPACING * scene.length
        way: FloatArray = arc_ahead(pose, bend, step, count, scene.goal, scene.low, scene.high)
        return way

    def _cost(self, length: float, work: float, way: FloatArray, done: float | None) -> float:
        """Cost up to the end of a piece plus what the guide expects of the rest."""
        scene, w = self.scene, self.config.push_weight
        step = SPACING * scene.length
        ahead = step * (len(way) - 1)
        mass = scene.world.robot.mass
        expected, rest = price_ahead(scene.guide, way, step, mass)
        done = expected if done is None else done
        return mass * (length + ahead) + w * (work + done) + rest

    def _predict(
        self, candidates: list[tuple[float, Partial[Ice], FloatArray]]
    ) -> list[Partial[Ice]]:
        """The candidates as paths, with the ice that they leave."""
        found: list[Partial[Ice]] = []
        step = SPACING * self.scene.length
        for i in range(0, len(candidates), self.carrier.batch):
            if self.check(self.iterations, self.best_cost):
                self.stopped = True
                return found
            chosen = candidates[i : i + self.carrier.batch]
            ices = [node.ice for _, node, _ in chosen]
            ahead = self.carrier.advance(ices, [way[:, :3] for _, _, way in chosen])
            self.iterations += len(chosen)
            for (_, node, way), (ice, work) in zip(chosen, ahead, strict=True):
                total = self._cost(node.length, node.work, way, work)
                found.append(
                    Partial(
                        pose=way[-1, :3],
                        way=way,
                        length=node.length + step * (len(way) - 1),
                        work=node.work + work,
                        total=total,
                        ice=ice,
                        parent=node,
                        done=bool(way[-1, 1] >= self.scene.goal),
                    )
                )
        return found

    def _thinned(self, layer: list[Partial[Ice]], width: int) -> list[Partial[Ice]]:
        """The best of a layer, one for each place and heading."""
        layer.sort(key=lambda node: node.total)
        cell = 0.08 * self.scene.length
        kept, seen = [], set()
        for node in layer:
            place = (
                round(node.pose[0] / cell),
                round(node.pose[1] / cell),
                round(node.pose[2] / 0.2),
            )
            if place not in seen:
                seen.add(place)
                kept.append(node)
            if len(kept) == width:
                break
        return kept

    def finish(self, node: Partial[Ice]) -> Partial[Ice] | None:
        """Go on from a path to the goal as the guide says, and predict that too.

        Returns:
            None where that leaves the channel, or the stop rule fired on it.
        """
        scene, w = self.scene, self.config.push_weight
        step = SPACING * scene.length
        turning = 2.0 * math.pi * scene.radius
        most = math.ceil((4.0 * max(scene.goal - node.pose[1], 0.0) + turning) / step)
        mass = scene.world.robot.mass
        if node.pose[1] < scene.goal:
            out = np.empty((most, 4))
            count = steer_on(scene.guide, node.pose, mass, w, scene.bends, step, out)
            if count == 0 or not scene.inside(out[:count]):
                return None
            followed = self.follow(node, np.concatenate([[[*node.pose, 0.0]], out[:count]]))
            if followed is None:
                return None
            node = followed
        node.done = True
        node.total = mass * node.length + w * node.work
        return node

    def follow(self, node: Partial[Ice], way: FloatArray) -> Partial[Ice] | None:
        """A path with a long way (N, 4) at its end, predicted; None if the stop rule fires on it.

        The first pose of the way is that where the path ends.
        """
        each = max(1, round(self.config.arc / SPACING))
        for i in range(0, len(way) - 1, each):
            if self.check(self.iterations, self.best_cost):
                self.stopped = True
                return None
            node = self.extend(node, way[i : i + each + 1])
        return node

    def extend(self, node: Partial[Ice], way: FloatArray) -> Partial[Ice]:
        """A path with one more piece (N, 4) at its end, predicted."""
        ice, work = self.carrier.advance([node.ice], [way[:, :3]])[0]
        self.iterations += 1
        pieces = step_lengths(way)
        return Partial(
            pose=way[-1, :3],
            way=way,
            length=node.length + float(pieces.sum()),
            work=node.work + work,
            total=math.inf,
            ice=ice,
            parent=node,
        )
