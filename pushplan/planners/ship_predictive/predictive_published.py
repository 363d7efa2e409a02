"""The predictive ship planner as published: the reference that ours is measured against."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pushplan.core import search
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.interaction.occupancy import PATCH_CELLS, Patch
from pushplan.motion.speed_profile import timed_plan, turning_radius
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.lattice_config import LatticeConfig
from pushplan.motion.state_lattice.lattice_search import (
    bare_path,
    lay_path,
    open_search,
    path_arcs,
    sample_arcs,
)
from pushplan.motion.time_slicing import Stopped, go_on
from pushplan.planners.ship_predictive.beam_search import SPACING, MapPropagator
from pushplan.planners.ship_predictive.channel_view import ChannelView, channel_view
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import Plan, PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import FloatArray, expect, number
from pushplan.world.planning_call import PlanningCall

LATTICE = LatticeConfig.published()


@dataclass(frozen=True)
class PredictivePublished:
    """A* over a state lattice whose edges cost what a network says they do to the ice.

    After Zhong et al. 2025 (arXiv 2409.11326): an edge costs 1000 times the mean squared change of
    the patch of occupancy around it, plus its length [m for a ship of 2 m]; the predicted map is
    carried at each node, and all edges from a node are predicted in one call. The heuristic is the
    length of the Dubins path to the line. Networks, weights and data of the paper are not public:
    the network is ours, the lattice that of `LatticeConfig.published`. A path is
    there only when the search ends, so that a deadline that comes before ends without a plan.

    Args:
        change_weight: factor on the mean squared change.
        network: predicts.
    """

    change_weight: float = 1000.0
    network: IceNetwork = field(default_factory=IceNetwork)

    def __post_init__(self) -> None:
        number("change_weight", self.change_weight, low=0.0)
        expect("network", self.network, IceNetwork)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; an iteration is an expanded node. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, something static is in the water, or the
                network cannot be read.
        """
        call = PlanningCall(world, stop, rng)
        self.network.load()
        call.arm()
        view = channel_view(world, PredictiveConfig(margin=0.0), IceInteraction())
        if view.closed is not None:
            return call.result(view.closed)
        if view.away <= 0.0:
            plan = timed_path(world, world.robot_pose[None], np.zeros(1))
            return call.result(PlanStatus.SOLVED, plan, call.elapsed)
        expanded = 0
        try:
            search = PublishedSearch(
                view, self.network, self.change_weight, lambda: call.check(expanded, math.inf)
            )
            while not search.arrived:
                if not search.expand():
                    status = view.without_path(call)
                    return call.result(status, None, math.nan, expanded, expanded)
                expanded += 1
        except Stopped:
            return call.result(call.stopped_status, None, math.nan, expanded, expanded)
        return call.result(PlanStatus.SOLVED, search.plan(), call.elapsed, expanded, expanded)


class PublishedSearch:
    """A* with a map of the ice at every node, driven through `take` and `offer`."""

    def __init__(
        self,
        view: ChannelView,
        network: IceNetwork,
        weight: float,  # factor on the mean squared change
        stopped: Callable[[], bool],  # ends this with `Stopped`
    ) -> None:
        world = view.world
        radius = turning_radius(world.robot, LATTICE.turn_fraction)
        side = _clearance(world)
        builder = LatticeBuilder(world, LATTICE, radius=radius, side=side, stopped=stopped)
        self._view = view
        self._weight = weight
        self._stopped = stopped
        self._propagator = MapPropagator(view, network)
        self._built = builder.build()
        # in half hull lengths, so that lengths count the same against changes for every ship
        self._unit = 0.5 * view.length
        opened, self._curves = open_search(self._built, builder)
        branching = int(np.diff(self._built.motions.first).max())
        self._tree = search.SearchTree(self._built.size)
        self._successors = (
            np.empty(branching, np.int64),
            np.empty(branching),
            np.empty(branching, np.int64),
        )
        self._maps: dict[int, Patch] = {}
        self._open(opened.tree)

    def _open(self, opened: search.SearchTree) -> None:
        """Begin at the robot's node, or where the short curves from the robot lead to."""
        nodes = opened.open_nodes.tolist()
        if not nodes:  # no place of the lattice is free
            return
        if not self._curves:
            self._maps[nodes[0]] = self._propagator.start()
            self._tree.offer(nodes[0], 0.0, 0.0, -1, -1)
            return
        edges = [opened.edge(node) for node in nodes]
        lengths = [opened.cost(node) for node in nodes]
        paths = [self._path(self._view.start, self._curves[-2 - edge]) for edge in edges]
        self._offer(-1, nodes, lengths, edges, paths, self._propagator.start())

    @property
    def arrived(self) -> bool:
        """True if the cheapest open node lies beyond the line."""
        tree = self._tree
        return tree.open_count > 0 and self._built.graph.is_goal(tree.next())

    def expand(self) -> bool:
        """Predict all edges from the most promising node; False where none is open.

        Raises:
            Stopped: if the stop rule fires.
        """
        go_on(self._stopped)
        motions = self._built.motions
        if not self._tree.open_count:
            return False
        node = self._tree.take()
        count = self._built.graph.successors(node, *self._successors)
        ice = self._maps.pop(node)
        if count:
            start = self._pose(node)
            nodes, costs, edges = (part[:count].tolist() for part in self._successors)
            paths = [self._path(start, motions.pieces[edge]) for edge in edges]
            self._offer(node, nodes, costs, edges, paths, ice)
        return True

    def _offer(
        self,
        parent: int,
        nodes: list[int],
        lengths: list[float],
        edges: list[int],
        paths: list[FloatArray],
        ice: Patch,
    ) -> None:
        """Open the ends of edges from a node; what they do to its ice takes one network call."""
        tree = self._tree
        before = 0.0 if parent < 0 else tree.cost(parent)
        made: list[tuple[Patch, float]] = []
        for first in range(0, len(paths), self._propagator.batch):
            go_on(self._stopped)
            few = paths[first : first + self._propagator.batch]
            made += self._propagator.advance([ice] * len(few), few)
        for node, length, edge, (after, _) in zip(nodes, lengths, edges, made, strict=True):
            change = float(np.square(after - ice).sum()) / PATCH_CELLS**2
            cost = before + self._weight * change + length / self._unit
            if not tree.known(node) or cost < tree.cost(node):
                self._maps[node] = after
                bound = self._built.graph.estimate(node) / self._unit
                tree.offer(node, cost, bound, parent, edge)

    def _pose(self, node: int) -> FloatArray:
        """(3,) a node's pose in the frame of the channel."""
        lattice = self._built.lattice
        (row, column, _) = self._built.start
        h, u, v = self._built.graph.place_of(node)
        ahead = lattice.step * (u - row)
        left = lattice.step * (v - column)
        return np.array([-left, ahead, self._built.motions.angles[h] + 0.5 * math.pi])

    def _path(self, start: FloatArray, pieces: FloatArray) -> FloatArray:
        """(N, 3) poses along the arcs [steps] of an edge from a pose on."""
        step = self._built.lattice.step
        arcs = pieces * np.array([step, 1.0 / step])
        return sample_arcs(start, arcs, SPACING * self._view.length)[0]

    def plan(self) -> Plan:
        """Along the path to the goal; of the floes it predicts nothing but the map."""
        world = self._view.world
        arcs = path_arcs(self._built, self._tree, self._curves, self._tree.next())
        return timed_path(world, *lay_path(self._built, arcs, world, LATTICE))


def timed_path(world: World, poses: FloatArray, curvatures: FloatArray) -> Plan:
    """A plan at full speed about which nothing is predicted."""
    return timed_plan(world, bare_path(poses, curvatures), LATTICE.turn_fraction)


def _clearance(world: World) -> float:
    """Distance from the bounds [m] that the ship's origin keeps: half a beam and the margin.

    It is less where the ship is nearer.
    """
    x, y = world.robot_pose[:2]
    x0, y0, x1, y1 = world.static.bounds
    wanted = world.robot.inscribed_radius + world.margin
    return float(max(min(wanted, x - x0, x1 - x, y - y0, y1 - y), 0.0))
