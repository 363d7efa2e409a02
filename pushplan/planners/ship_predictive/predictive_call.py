"""One call of a predictive ship planner."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.motion.speed_profile import along_arcs, timed_plan
from pushplan.motion.state_lattice.lattice_path import bare_path
from pushplan.planners.ship_predictive.beam_node import BeamNode, StatePropagator
from pushplan.planners.ship_predictive.beam_search import BeamSearch
from pushplan.planners.ship_predictive.channel_view import ChannelView, channel_view
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.planners.ship_predictive.turning import in_table, tight_turn, turned_start, way_round
from pushplan.world import Plan, PlanResult, PlanStatus
from pushplan.world.checks import FloatArray
from pushplan.world.planning_call import PlanningCall
from pushplan.world.polyline import step_lengths

_ROOM = 4.0  # for turns in a thorough search [turning radii]
_TIGHTEST = 0.999  # fraction of the turn rate that is used where there is no path with less


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
        if in_table(view.start[2]):
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
