"""`ShipLattice`: A* over motion primitives among floes, then made better against the prediction."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, Self

import numpy as np

from pushplan.core import motion as core
from pushplan.core import search
from pushplan.interaction import InteractionModel
from pushplan.interaction.path_sweepers import path_sweeper
from pushplan.motion.coarse_path import reachable
from pushplan.motion.collision import footprint, goal_numbers, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.motion.room_ahead import Room, gets_away
from pushplan.motion.speed_profile import (
    SweptPath,
    check_turns,
    goal_is_outside,
    timed_plan,
    turning_radius,
)
from pushplan.motion.state_lattice.built_lattice import BuiltLattice
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.lattice_config import SPACING, LatticeConfig
from pushplan.motion.state_lattice.lattice_map import FloeCosts
from pushplan.motion.state_lattice.lattice_search import bare_path, lay_path, open_search, path_arcs
from pushplan.motion.time_slicing import Pace, Stopped
from pushplan.planners.ship_lattice.ship_path_improver import (
    NearbyObjects,
    ShipPathImprover,
    ShortcutProblem,
)
from pushplan.world import GoalLine, Plan, PlanResult, PlanStatus, Stop, World
from pushplan.world.checked_fields import (
    Each,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    OneOf,
)
from pushplan.world.checks import FloatArray, expect
from pushplan.world.planning_call import PlanningCall

FLOE_COSTS = ("displacement", "kinetic-energy")


@dataclass(frozen=True)
class ShipLatticeConfig(LatticeConfig):
    """Parameters of `ShipLattice`, beside those of its lattice. R and B as in `LatticeConfig`.

    Args:
        push_weight: w, the cost of a unit of interaction work against a unit of travel work.
        floe_cost: by how far a floe would be pushed ("displacement"), or by the kinetic energy
            that the collision takes ("kinetic-energy", as published).
        collision_weight: α, factor on the kinetic-energy cost.
        exponent: how the cost of a floe is spread over it, see `FloeCosts`.
        side: distance of the robot's origin from the bounds [B]; less where it starts nearer.
        searches: of the lattice, one after the other, as factors on ``push_weight``. The first path
            is there after the first one; the sweeps choose among all.
        shortcuts: random changes of the path of the lattice that are tried, each with a sweep.
        sweep_horizon: how far along a path the sweeps look [R]. 0 for no sweeps: the plan is the
            first path, and predicts nothing.
    """

    push_weight: NonNegativeFloat = 1.5
    floe_cost: Annotated[str, OneOf(FLOE_COSTS)] = "displacement"
    collision_weight: NonNegativeFloat = 1.0
    exponent: Annotated[float, Limits(-0.9, 4.0)] = -0.5
    side: NonNegativeFloat = 0.75
    searches: Annotated[tuple[float, ...], Each(Limits(0.0))] = (1.0, 0.0, 0.5, 2.0, 4.0)
    shortcuts: NonNegativeInt = 60
    sweep_horizon: NonNegativeFloat = 10.0

    @classmethod
    def quick(cls) -> Self:
        """One search and nothing after it."""
        return cls(push_weight=3.0, inflation=1.35, searches=(1.0,), shortcuts=0, sweep_horizon=0.0)

    @classmethod
    def published(cls, **others: Any) -> Self:
        """AUTO-IceNav's lattice as Bench-Push uses it: kinetic-energy cost, nothing after it."""
        return super().published(
            push_weight=1.0,
            floe_cost="kinetic-energy",
            collision_weight=0.5,
            side=0.5,
            exponent=1.0,
            searches=(1.0,),
            shortcuts=0,
            sweep_horizon=0.0,
            **others,
        )


_SPREAD = 0.6  # typical sideways displacement of a shortcut [R]
_MOST_TURN = 2.5  # greatest turn of one of its curves [rad]
_BATCH = 100  # nodes expanded between two looks at the stop rule
_END_FRACTION = 0.15  # fraction of the shortcuts that move the end
_SOFT = 0.05  # keeps the cost of a cell finite at the edge of a floe where the exponent is negative
_DISPLACEMENT = 2.7
"""Distance by which a floe that the hull runs over is pushed, in half beams plus floe radii."""


@dataclass(frozen=True)
class ShipLattice:
    """State lattice for a vehicle of bounded turn rate in a field of things that it may push.

    After de Schaetzen et al., "Real-time navigation for autonomous surface vehicles in ice-covered
    waters" (2023), and AUTO-IceNav (arXiv 2411.17155). Use it to reach a goal line through
    many small objects; a goal disc and walls are understood too. The robot's origin stays within
    the bounds. One iteration is a batch of expanded nodes or one shortcut.

    Args:
        config: parameters.
        interaction: predicts what a path does to the objects; by default `IceInteraction` in open
            water, and `QuasiStatic` where there are walls.
    """

    config: ShipLatticeConfig = field(default_factory=ShipLatticeConfig)
    interaction: InteractionModel | None = None

    def __post_init__(self) -> None:
        expect("config", self.config, ShipLatticeConfig)
        if self.interaction is not None:
            expect("interaction", self.interaction, InteractionModel)  # type: ignore[type-abstract]

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`.

        Raises:
            InvalidInputError: if the world's goal is not one for the robot.
        """
        call = PlanningCall(world, stop, rng)
        search = ShipLatticeCall(call, self.config, self.interaction)
        status = search.run() or call.stopped_status
        return call.result(
            status,
            search.plan() if status.has_plan else None,
            search.first_solution_s,
            search.iterations,
            search.expanded,
            lattice_cost=search.lattice_cost,
            shortcuts=float(search.shortcuts),
        )

    def prepare(self, world: World) -> None:
        """Make what depends on the ship alone, which the first call would do otherwise.

        That is the motion primitives and what the hull covers along them, 20 to 60 ms; it is kept
        for all planners of this process. `PlanFollower` does it at the
        start of an episode.
        """
        radius = turning_radius(world.robot, self.config.turn_fraction)
        LatticeBuilder(world, self.config, radius=radius, side=0.0).build()


def published() -> ShipLattice:
    """The lattice of AUTO-IceNav as Bench-Push uses it, see `ShipLatticeConfig.published`."""
    return ShipLattice(ShipLatticeConfig.published())


def quick() -> ShipLattice:
    """One search and nothing after it, see `ShipLatticeConfig.quick`."""
    return ShipLattice(ShipLatticeConfig.quick())


class ShipLatticeCall:
    """Lattice, search and improvement of one planning call."""

    def __init__(
        self,
        call: PlanningCall,  # its world, clock, stop rule and source of chance
        config: ShipLatticeConfig,
        interaction: InteractionModel | None,
    ) -> None:
        self.call = call
        self.config = config
        self.interaction = interaction
        self.world = world = call.world
        check_turns(world.robot)
        self.goal = world.place_goal
        self.size = world.robot.circumscribed_radius
        self.iterations = self.expanded = self.shortcuts = 0
        self.lattice_cost = math.inf
        self.first_solution_s = float("nan")
        self.built: BuiltLattice | None = None
        self.near: NearbyObjects | None = None
        self.improver: ShipPathImprover | None = None
        self._pace = Pace()
        self.cost = math.inf
        self.poses: FloatArray = np.zeros((0, 3))
        self.curvatures: FloatArray = np.zeros(0)

    def run(self) -> PlanStatus | None:
        """Plan until done or stopped; None where there is no plan by then."""
        with suppress(Stopped):
            return self._run()
        return None

    def _run(self) -> PlanStatus | None:
        world = self.world
        shape = footprint(world.robot)
        walls = obstacles(keep_out(world))
        if not core.CollisionChecker(shape, walls).is_free(world.robot_pose):
            return PlanStatus.START_BLOCKED
        if goal_is_outside(world):
            return PlanStatus.GOAL_UNREACHABLE
        if self.goal.distance(*(float(v) for v in world.robot_pose[:2])) <= 0.0:
            self.poses = world.robot_pose[None].copy()
            self.curvatures = np.zeros(1)
            self.first_solution_s = self.call.elapsed
            return PlanStatus.SOLVED
        for fraction, side in self._limits():
            if self.stopped():
                return None
            radius = turning_radius(world.robot, fraction)
            builder = LatticeBuilder(
                world,
                self.config,
                radius=radius,
                side=side,
                floe_costs=partial(floe_costs, self.config),
                stopped=self.stopped,
            )
            self._set_side(side)
            found = self._search(builder, self.config.searches[0])
            if found is None:
                return None
            if found:
                if self.config.sweep_horizon > 0.0:
                    with suppress(Stopped):
                        self._improve(builder)
                assert self.built is not None
                if not self.built.arrives:
                    return PlanStatus.APPROXIMATE
                return PlanStatus.SOLVED
        if self.stopped():
            return None
        room = Room(shape, walls, goal_numbers(self.goal, 0.0), 0.0)
        if not gets_away(room, world.robot_pose, self.size, world.robot.turning_radius):
            return PlanStatus.START_BLOCKED
        # the lattice is coarse: where it leads nowhere there may be a path nevertheless
        if reachable(world, self.stopped) or self.stopped():
            return None
        return PlanStatus.GOAL_UNREACHABLE

    def _limits(self) -> list[tuple[float, float]]:
        """Fractions of the turn rate and distances from the bounds [m] to try in turn."""
        fraction = self.config.turn_fraction
        side = self.config.side * 2.0 * self.world.robot.inscribed_radius
        nearer = [(fraction, part * side) for part in (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)]
        return [*nearer, (1.0, 0.0)]

    def stopped(self) -> bool:
        """Return True if the stop rule fires now."""
        return self.call.check(self.iterations, self.cost)

    def _search(self, builder: LatticeBuilder, factor: float) -> bool | None:
        """Search the lattice; return True if a path was found, None if stopped before."""
        built = builder.build(factor)
        star, curves = open_search(built, builder)
        result = search.SearchStatus.PAUSED
        while not self.stopped():
            for first, last in self._pace.pieces(_BATCH, self.stopped):
                result = star.run(last - first)
                if result != search.SearchStatus.PAUSED:
                    break
            self.iterations += 1
            if result != search.SearchStatus.PAUSED:
                break
        else:
            return None
        self.expanded += star.tree.expanded
        if result != search.SearchStatus.FOUND:
            return None if builder.clipped else False  # there may be a path elsewhere
        arcs = path_arcs(built, star.tree, curves, star.goal)
        poses, curvatures = lay_path(built, arcs, self.world, self.config)
        if not self._free(poses):
            return False
        if self.built is None:
            self.built = built
            self.lattice_cost = star.cost
            self.first_solution_s = self.call.elapsed
            self.poses = poses
            self.curvatures = curvatures
            self.cost = self.world.robot.mass * star.cost
        else:
            self._consider(poses, curvatures)
        return True

    def _set_side(self, side: float) -> None:
        """Keep the robot's origin so far [m] inside all bounds but those ahead, if it can."""
        world = self.world
        low = world.static.bounds[:2] + side
        high = world.static.bounds[2:] - side
        if isinstance(self.goal, GoalLine):
            high = np.where(self.goal.normal > 0.7, world.static.bounds[2:], high)
            low = np.where(self.goal.normal < -0.7, world.static.bounds[:2], low)
        start = world.robot_pose[:2]
        low = np.minimum(low, start)
        high = np.maximum(high, start)
        bounds = np.concatenate([low - 1e-6 * self.size, high + 1e-6 * self.size])
        walls = obstacles(keep_out(world), bounds=bounds)
        self._checker = core.CollisionChecker(footprint(world.robot), walls)

    def _free(self, poses: FloatArray) -> bool:
        """Return True if a path is clear of walls, and its origin of all bounds but those ahead."""
        return self._checker.first_blocked(poses) == len(poses)

    def _improve(self, builder: LatticeBuilder) -> None:
        """Sweep the path, look at others, and change the best at random."""
        config = self.config
        world = self.world
        assert self.built is not None
        point, normal = self.built.finish(world)
        ahead = config.sweep_horizon * self.size
        self.near = NearbyObjects.around(world, normal, ahead)
        problem = ShortcutProblem(
            radius=builder.radius,
            spacing=SPACING * self.size,
            spread=_SPREAD * self.size,
            most_turn=_MOST_TURN,
            end_fraction=_END_FRACTION,
            goal=np.concatenate([point, normal]),
        )
        self.improver = ShipPathImprover(
            path_sweeper(self.near.world, self.interaction),
            np.ascontiguousarray(self.near.world.movables.poses),
            robot_mass=world.robot.mass,
            weight=config.push_weight,
            problem=problem,
            ahead=ahead,
            stopped=self.stopped,
            free=self._free,
        )
        self._consider(self.poses, self.curvatures)
        for factor in config.searches[1:]:
            if self.stopped():
                return
            self._search(builder, factor)
        if self.improver.best is None or not isinstance(self.goal, GoalLine):
            return
        # a path that touches nothing is not shortened: it would be until it grazes a floe
        while self.shortcuts < config.shortcuts and self.improver.best.works[-1] > 0.0:
            if self.stopped():
                return
            self.improver.shortcut(self.call.rng)
            self.shortcuts += 1
            self.iterations += 1
            self.cost = self.improver.best.cost

    def _consider(self, poses: FloatArray, curvatures: FloatArray) -> None:
        assert self.improver is not None
        if self.improver.consider(poses, curvatures) and self.improver.best is not None:
            self.cost = self.improver.best.cost

    def plan(self) -> Plan:
        """The best path as a plan, with the prediction of what it does as far as there is one."""
        best = None if self.improver is None else self.improver.best
        if best is None or self.near is None:
            path = bare_path(self.poses, self.curvatures)
        else:
            missing = len(best.poses) - len(best.objects)
            objects = self.near.everything(self.world, best.objects, missing)
            works = np.concatenate([best.works, np.repeat(best.works[-1:], missing)])
            path = SweptPath(best.poses, best.curvatures, objects, best.lengths, works)
        return timed_plan(self.world, path, self.config.turn_fraction)


def floe_costs(
    config: ShipLatticeConfig,  # says what a floe costs
    world: World,
    cell: float,  # side of a cell of the map [m]
) -> FloeCosts:
    """Costs of all floes of a world."""
    floes = world.movables
    robot = world.robot
    half = max(robot.inscribed_radius, 0.1 * robot.circumscribed_radius)
    areas = floes.contact_areas
    radii = np.sqrt(areas / np.pi)
    if config.floe_cost == "kinetic-energy":
        ship = robot.mass
        masses = floes.masses
        energy = ship * masses * (masses + 2.0 * ship) / (2.0 * (ship + masses) ** 2)
        # the published map gives this to the middle of a floe and less to its edge:
        # the mean of 1 - d²/(r + 1/2)² over a disc of r cells
        cells = radii / cell
        mean = 1.0 - 0.5 * (cells / (cells + 0.5)) ** 2
        middle = config.collision_weight * energy / (0.5 * ship) * cell / half
        soft = float(np.mean((1.0 + 0.5 / np.maximum(cells, 0.1)) ** 2 - 1.0))
        return FloeCosts(middle * mean * areas / cell**2, areas, config.exponent, soft)
    pushed = _DISPLACEMENT * (half + radii)
    weight = config.push_weight / robot.mass
    return FloeCosts(weight * floes.masses * pushed, areas, config.exponent, _SOFT)
