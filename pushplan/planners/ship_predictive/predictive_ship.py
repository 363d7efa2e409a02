"""`PredictiveShip` and `PredictiveShipNetwork`: through ice by predicting what paths do to it."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from pushplan.core import motion as core
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.motion.speed_profile import along_arcs, timed_plan
from pushplan.motion.state_lattice.lattice_search import bare_path, sample_arcs
from pushplan.planners.ship_predictive.beam_search import (
    SPACING,
    BeamNode,
    BeamSearch,
    FloePropagator,
    MapPropagator,
    StatePropagator,
)
from pushplan.planners.ship_predictive.channel_view import STEEPEST, ChannelView, channel_view
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import Plan, PlanResult, PlanStatus, Stop, World
from pushplan.world.checks import FloatArray, expect
from pushplan.world.planning_call import PlanningCall
from pushplan.world.polyline import step_lengths

_ROOM = 4.0  # for turns in a thorough search [turning radii]
_TIGHTEST = 0.999  # fraction of the turn rate that is used where there is no path with less
_PLACES = 9  # on the goal line to which curves may lead
_HEADINGS = 5  # at each of them


@dataclass(frozen=True)
class PredictiveShip:
    """Minimises m₀ l₀ + w Σ mᵢ lᵢ, with the floes pushed along each path that it looks at.

    After Zhong et al. 2025 (arXiv 2409.11326), whose edge costs come from the predicted change of
    the ice, carried along the path; here the prediction is that of a contact model, and the cost is
    what the metrics measure. A table of costs to go over the ice as it lies guides a beam of
    arcs (see `BeamSearch`). Use it where the positions of the floes are known.

    Plans keep the ship's origin half a beam, and the margin of the world, inside the sides of the
    channel, nearer only as far as a turn from where it starts needs the space. A goal line that is
    very far away is approached (`PredictiveConfig.farthest`). Without a stop rule the effort is
    fixed; with one the beam is widened until the rule fires. An iteration is one predicted piece of
    path.

    Args:
        config: parameters.
        interaction: predicts the floes.
    """

    config: PredictiveConfig = field(default_factory=PredictiveConfig)
    interaction: IceInteraction = field(default_factory=IceInteraction)

    def __post_init__(self) -> None:
        expect("config", self.config, PredictiveConfig)
        expect("interaction", self.interaction, IceInteraction)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, or something static is in the water.
        """
        call = PlanningCall(world, stop, rng)
        return plan_call(call, self.config, self.interaction, self._propagator(call))

    def _propagator(self, call: PlanningCall) -> Callable[[ChannelView], StatePropagator[Any]]:
        """Makes what carries the ice along the paths of a call."""
        return FloePropagator


NETWORK_CONFIG = PredictiveConfig(arc=0.4, curvatures=2, width=6, widest=24, sparse=0)
"""Fewer and longer pieces than by default, as the network takes longer to predict one."""


@dataclass(frozen=True)
class PredictiveShipNetwork(PredictiveShip):
    """`PredictiveShip` with a network that predicts occupancy and work from occupancy.

    The ice is carried as a map, which the network changes piece by piece; the pieces of a layer
    of the beam are predicted eight in a call. Use it where only an occupancy map is known, or to
    compare. A network that cannot be read is an `InvalidInputError` of ``plan``.

    Args:
        config: parameters.
        interaction: sweeps the plan that is returned, for its prediction; the search does not
            use it.
        network: predicts; the shipped weights by default.
    """

    config: PredictiveConfig = NETWORK_CONFIG
    network: IceNetwork = field(default_factory=IceNetwork)

    def __post_init__(self) -> None:
        super().__post_init__()
        expect("network", self.network, IceNetwork)

    def _propagator(self, call: PlanningCall) -> Callable[[ChannelView], StatePropagator[Any]]:
        """Makes maps of the ice; what a process loads once does not count against a deadline."""
        self.network.load()
        call.arm()
        return partial(MapPropagator, network=self.network)


def plan_call(
    call: PlanningCall,
    config: PredictiveConfig,
    interaction: IceInteraction,
    make_propagator: Callable[[ChannelView], StatePropagator[Any]],
) -> PlanResult:
    """Plan with the usual turn rate, or with all of it where there is no path otherwise.

    Where neither has led to the goal, both are searched again, thoroughly.
    """
    iterations = nodes = 0
    fractions = dict.fromkeys((config.turn_fraction, max(config.turn_fraction, _TIGHTEST)))
    for thorough, fraction in itertools.product((False, True), fractions):
        settings = replace(config, turn_fraction=fraction)
        view = channel_view(call.world, settings, interaction, _ROOM if thorough else 0.0)
        propagator = make_propagator(view)
        beam: BeamSearch[Any] = BeamSearch(view, config, propagator, call.check, iterations)
        search = PredictiveCall(beam, call.has_rule or thorough, thorough)
        status = search.run()
        iterations = beam.iterations
        nodes = nodes + beam.nodes
        if status is not None or beam.stopped:
            break
    return call.result(
        status or view.without_path(call),
        search.plan(),
        search.first - call.began,
        iterations,
        nodes,
        cost=beam.best_cost,
        tight=float(fraction > config.turn_fraction),
    )


@dataclass(eq=False)
class PredictiveCall:
    """Beams of growing width, and the best path of all."""

    beam: BeamSearch[Any]
    widening: bool  # True to go on with wider beams
    thorough: bool  # True to begin with a curve that leads to the goal through whatever is there
    first: float = math.nan  # when there was a plan, on the clock of `time.perf_counter`
    _best: BeamNode[Any] | None = None
    _objects: FloatArray | None = None

    def run(self) -> PlanStatus | None:
        """Search until done or stopped; None where no path was found."""
        beam = self.beam
        view = self.beam.view
        if view.closed is not None:
            return view.closed
        if view.channel.goal <= 0.0:
            self._consider(beam.root())
            return PlanStatus.SOLVED
        turn = tight_turn(view)
        root: BeamNode[Any] | None = None
        if abs(view.start[2] - 0.5 * math.pi) <= STEEPEST - 0.1:  # the costs to go hold here
            root = beam.root()
        elif turn is not None:
            root = beam.follow(beam.root(), turned_start(turn))
        if root is not None:
            self._consider(beam.finish(root))
        if self._best is None and turn is not None and not beam.stopped:
            self._follow(turn)  # out of where the costs to go hold
        if self.thorough and (way := way_round(view)) is not None:
            self._follow(way)
        if root is not None:
            self._widen(root)
        if self._best is None:
            return None
        if view.channel.goal < view.away:
            return PlanStatus.APPROXIMATE
        return PlanStatus.SOLVED

    def _follow(self, way: FloatArray) -> None:
        """Consider a (N, 4) way from the ship, and on to the goal."""
        ahead = self.beam.follow(self.beam.root(), way)
        if ahead is not None:
            self._consider(self.beam.finish(ahead))

    def _widen(self, root: BeamNode[Any]) -> None:
        beam = self.beam
        config = self.beam.config
        width = config.beam_width(len(beam.view.near))
        if self.widening:
            width = max(2, width // 4)
        while not beam.stopped:
            node = beam.search(root, width, config.horizon * beam.view.length)
            if node is not None:
                self._consider(beam.finish(node))
            width *= 2
            if not self.widening or width > config.widest:
                return

    def _consider(self, node: BeamNode[Any] | None) -> None:
        """Take up a path that is cheaper than the best, if there is time to say what it does."""
        beam = self.beam
        if node is None or not node.total < beam.best_cost:
            return
        objects = beam.propagator.trace(node, lambda: beam.check(beam.iterations, beam.best_cost))
        if objects is None and self._best is not None:
            return
        self._best = node
        self._objects = objects
        beam.best_cost = node.total
        if math.isnan(self.first):
            self.first = time.perf_counter()

    def plan(self) -> Plan | None:
        """The best path, as fast as the robot can, with what it does to the floes."""
        if self._best is None:
            return None
        view = self.beam.view
        path = self._best.path()
        world = view.world
        poses = view.to_world(path[:, :3])
        headings = np.unwrap(poses[:, 2])
        poses[:, 2] = headings + (world.robot_pose[2] - headings[0])  # whole turns
        poses[0] = world.robot_pose
        work = self._best.work
        objects = None
        if self._objects is not None:
            work = float((step_lengths(self._objects) @ view.objects.masses).sum())
            objects = np.repeat(world.movables.poses[None], len(path), axis=0)
            objects[:, view.near] = view.to_world(self._objects)
        chords = step_lengths(path)
        swept = bare_path(poses, path[:, 3].copy())
        return replace(
            timed_plan(world, swept, self.beam.config.turn_fraction, chords),
            travel_cost=world.robot.mass * float(along_arcs(chords, path[1:, 3]).sum()),
            interaction_cost=work,
            object_poses=objects,
        )


def tight_turn(view: ChannelView) -> FloatArray | None:
    """The tightest arc to the direction straight ahead, or to the goal line if that comes first.

    Returns:
        (N, 4) poses and curvatures, the first being the ship's; to the nearer side if it fits
        else to the other one; None where there is none.
    """
    off = view.start[2] - 0.5 * math.pi
    step = SPACING * view.length
    near = -math.copysign(1.0, off)
    for side in (near, -near):
        turn = abs(off) if side == near else 2.0 * math.pi - abs(off)
        count = max(1, math.ceil(turn * view.radius / step))
        along = np.linspace(0.0, turn * view.radius, count + 1)
        curvature = side / view.radius
        middle = view.start[2] + 0.5 * curvature * along
        chord = along * np.sinc(0.5 * curvature * along / np.pi)
        x = chord * np.cos(middle)
        y = chord * np.sin(middle)
        # headings near those of the table of costs to go
        heading = view.start[2] + curvature * along + (side != near) * near * 2.0 * math.pi
        arc = np.column_stack([x, y, heading, np.full(count + 1, curvature)])
        arrived = np.flatnonzero(y >= view.channel.goal)
        if len(arrived):
            arc = arc[: arrived[0] + 1]
        if view.inside(arc):
            return arc
    return None


def way_round(view: ChannelView) -> FloatArray | None:
    """The shortest curve of Dubins that leads to some place of the goal line and fits.

    Returns:
        (N, 4) poses and curvatures, the first being the ship's; None where none of them fits.
    """
    goal = view.channel.goal
    curves = []
    for x in np.linspace(view.channel.low[0], view.channel.high[0], _PLACES):
        for heading in np.linspace(0.5 * math.pi - STEEPEST, 0.5 * math.pi + STEEPEST, _HEADINGS):
            arcs = np.empty((5, 2))
            end = np.array([x, goal, heading])
            length = core.shortest_curve(view.start, end, view.radius, False, arcs)
            curves.append((length, arcs))
    for _, arcs in sorted(curves, key=lambda curve: curve[0]):
        poses, curvatures = sample_arcs(view.start, arcs, SPACING * view.length)
        count = int(np.argmax(np.append(poses[:, 1], goal) >= goal)) + 1
        if view.inside(poses[:count]):
            return np.column_stack([poses, curvatures])[:count]
    return None


def turned_start(arc: FloatArray) -> FloatArray:
    """The first part of a tight turn, up to a heading for which the costs to go hold."""
    known = np.flatnonzero(np.abs(arc[:, 2] - 0.5 * math.pi) <= STEEPEST - 0.3)
    return arc[: known[0] + 1] if len(known) else arc
