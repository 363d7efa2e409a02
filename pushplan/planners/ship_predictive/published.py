"""The predictive ship planner as published: the reference that ours is measured against."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from pushplan.compiled import kernel
from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.interaction.occupancy import PATCH_CELLS
from pushplan.interaction.occupancy_kernels import Patch
from pushplan.motion.dubins import sample_pieces
from pushplan.motion.speed_profile import timed_plan, turning_radius
from pushplan.motion.state_lattice.pose_lattice import PoseLattice, bound_at, reached
from pushplan.planners.arguments import check_call
from pushplan.planners.ship_lattice.build import LatticeBuilder
from pushplan.planners.ship_lattice.call import bare_path
from pushplan.planners.ship_lattice.paths import lay_path, open_search
from pushplan.planners.ship_lattice.ship_lattice_config import ShipLatticeConfig
from pushplan.planners.ship_predictive.beam import SPACING
from pushplan.planners.ship_predictive.ice_scene import Scene, make_scene
from pushplan.planners.ship_predictive.maps import MapCarrier
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.search.astar import SIZE, AStar, SearchState, expand, offer, take
from pushplan.world import Movables, Plan, PlanResult, PlanStats, PlanStatus, Stop, World
from pushplan.world.checks import FloatArray, IntArray, expect, number


@kernel(allocates=True)
def list_successors(
    lattice: PoseLattice, node: int, nodes: IntArray, costs: FloatArray, edges: IntArray
) -> int:
    """See `astar.expand`."""
    count: int = expand(lattice, node, nodes, costs, edges)
    return count


@dataclass(frozen=True)
class PredictivePublished:
    """A* over a state lattice whose edges cost what a network says they do to the ice.

    After Zhong et al. 2025 (arXiv 2409.11326): an edge costs 1000 times the mean squared change of
    the patch of occupancy around it, plus its length [m for a ship of 2 m]; the predicted map is
    carried at each node, and all edges from a node are predicted in one call. The heuristic is the
    length of the Dubins path to the line. Networks, weights and data of the paper are not public:
    the network is ours, the lattice that of `ShipLatticeConfig.published`. A path is
    there only when the search ends, so that a deadline that comes before ends without a plan.

    Args:
        change_weight: factor on the mean squared change.
        network: predicts.
    """

    warm_up_iterations: ClassVar[int] = 30
    """After which it has used all of its kernels."""

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
        began = time.perf_counter()
        check_call(world, stop, rng)
        self.network.load()
        check = (lambda iterations, cost: False) if stop is None else stop.start()
        scene = make_scene(world, PredictiveConfig(margin=0.0), IceInteraction())
        plan, expanded, first = None, 0, math.nan
        if not scene.inside(scene.start[None]):
            status = PlanStatus.START_BLOCKED
        elif scene.away > scene.high[1]:
            status = PlanStatus.GOAL_UNREACHABLE
        elif scene.away <= 0.0:
            status, first = PlanStatus.SOLVED, time.perf_counter() - began
            plan = _timed(world, world.robot_pose[None], np.zeros(1))
        else:
            search = _Search(scene, self.network, self.change_weight)
            status = PlanStatus.SOLVED
            while not search.arrived:
                if check(expanded, math.inf):
                    cancelled = stop is not None and stop.cancelled
                    status = PlanStatus.CANCELLED if cancelled else PlanStatus.TIMED_OUT
                    break
                if not search.expand():
                    status = PlanStatus.GOAL_UNREACHABLE
                    break
                expanded += 1
            if search.arrived:
                plan, first = search.plan(), time.perf_counter() - began
        stats = PlanStats(
            wall_time_s=time.perf_counter() - began,
            first_solution_s=first,
            iterations=expanded,
            nodes=expanded,
        )
        return PlanResult(status, plan, stats)


class _Search:
    """A* with a map of the ice at every node, driven through `take` and `offer`.

    Args:
        scene: what is searched.
        network: predicts.
        weight: factor on the mean squared change.
    """

    def __init__(self, scene: Scene, network: IceNetwork, weight: float) -> None:
        world, self._config = scene.world, ShipLatticeConfig.published()
        radius = turning_radius(world.robot, self._config.turn_share)
        water = replace(world, movables=Movables.from_outlines([], np.zeros((0, 3))))
        builder = LatticeBuilder(water, self._config, radius=radius, side=_room(world))
        self._scene, self._weight = scene, weight
        self._carrier = MapCarrier(scene, network)
        self._built = builder.build()
        # in half hull lengths, so that lengths count the same against changes for every ship
        self._unit = 0.5 * scene.length
        opened, self._curves = open_search(self._built, builder)
        branching = int(np.diff(self._built.motions.first).max())
        self._star = AStar(self._built.lattice, self._built.size, branching)
        self._successors = (
            np.empty(branching, np.int64),
            np.empty(branching),
            np.empty(branching, np.int64),
        )
        self._maps: dict[int, Patch] = {}
        self._open(opened.state)

    def _open(self, state: SearchState) -> None:
        """Begin at the robot's node, or where the short curves from the robot lead to."""
        nodes = state.heap[: state.counters[SIZE]].copy()
        if not self._curves:
            self._maps[int(nodes[0])] = self._carrier.start()
            self._star.start(int(nodes[0]))
            return
        edges = state.edges[nodes]
        arcs = [self._curves[-2 - edge] for edge in edges.tolist()]
        paths = [self._path(self._scene.start, arc) for arc in arcs]
        self._offer(-1, nodes, state.costs[nodes], edges, paths, self._carrier.start())

    @property
    def arrived(self) -> bool:
        """Whether the cheapest open node lies beyond the line."""
        state = self._star.state
        return bool(state.counters[SIZE] and reached(self._built.lattice, state.heap[0]))

    def expand(self) -> bool:
        """Predict all edges from the most promising node; False where none is open."""
        lattice, motions = self._built.lattice, self._built.motions
        node = int(take(self._star.state))
        if node < 0:
            return False
        nodes, costs, edges = self._successors
        count = int(list_successors(lattice, node, nodes, costs, edges))
        ice = self._maps.pop(node)
        if count:
            start = self._pose(node)
            paths = [self._path(start, motions.pieces[edge]) for edge in edges[:count]]
            self._offer(node, nodes[:count], costs[:count], edges[:count], paths, ice)
        return True

    def _offer(
        self,
        parent: int,
        nodes: IntArray,
        lengths: FloatArray,
        edges: IntArray,
        paths: list[FloatArray],
        ice: Patch,
    ) -> None:
        """Price edges that begin at one node by what they do to its ice; one network call."""
        state, lattice = self._star.state, self._built.lattice
        before = 0.0 if parent < 0 else float(state.costs[parent])
        made = self._carrier.advance([ice] * len(paths), paths)
        for node, length, edge, (after, _) in zip(nodes, lengths, edges, made, strict=True):
            change = float(np.square(after - ice).sum()) / PATCH_CELLS**2
            cost = before + self._weight * change + length / self._unit
            if not state.known[node] or cost < state.costs[node]:
                self._maps[int(node)] = after
                offer(state, node, cost, bound_at(lattice, node) / self._unit, parent, edge)

    def _pose(self, node: int) -> FloatArray:
        """(3,) a node's pose in the frame of the scene."""
        lattice, (row, column, _) = self._built.lattice, self._built.start
        rest, v = divmod(node, lattice.columns)
        h, u = divmod(rest, lattice.rows)
        ahead, left = lattice.step * (u - row), lattice.step * (v - column)
        return np.array([-left, ahead, self._built.motions.angles[h] + 0.5 * math.pi])

    def _path(self, start: FloatArray, pieces: FloatArray) -> FloatArray:
        """(N, 3) poses along the arcs [steps] of an edge from a pose on."""
        step = self._built.lattice.step
        arcs = pieces * np.array([step, 1.0 / step])
        spacing = SPACING * self._scene.length
        turns = float(np.abs(arcs[:, 0] * arcs[:, 1]).sum())
        room = int(arcs[:, 0].sum() / spacing + turns / 0.1) + 8
        poses, bends = np.empty((room + 1, 3)), np.empty(room)
        poses[0] = start
        return poses[: 1 + sample_pieces(start, arcs, spacing, poses[1:], bends)]

    def plan(self) -> Plan:
        """Along the path to the goal; of the floes it predicts nothing but the map."""
        world, config = self._scene.world, self._config
        goal = int(self._star.state.heap[0])
        _, edges = self._star.path(goal)
        parts = [
            self._curves[-2 - e] if e < -1 else self._built.motions.pieces[e]
            for e in edges
            if e != -1
        ]
        step = self._built.lattice.step
        arcs = np.concatenate([*parts, np.zeros((0, 2))]) * np.array([step, 1.0 / step])
        poses, curvatures = lay_path(self._built, arcs, world, config)
        return _timed(world, poses, curvatures)


def _timed(world: World, poses: FloatArray, curvatures: FloatArray) -> Plan:
    return timed_plan(world, bare_path(poses, curvatures), ShipLatticeConfig.published().turn_share)


def _room(world: World) -> float:
    """Distance from the bounds [m] that the ship's origin keeps: half a beam, if it has that."""
    x, y = world.robot_pose[:2]
    x0, y0, x1, y1 = world.static.bounds
    return float(max(min(world.robot.inscribed_radius, x - x0, x1 - x, y - y0, y1 - y), 0.0))
