"""`PredictiveShip` and `PredictiveShipNetwork`: through ice by looking at what it will do."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.planners.predictive.beam import Beam, Carrier, Partial
from pushplan.planners.predictive.config import PredictiveConfig
from pushplan.planners.predictive.floes import FloeCarrier
from pushplan.planners.predictive.guide import STEEPEST
from pushplan.planners.predictive.maps import MapCarrier
from pushplan.planners.predictive.scene import Scene, make_scene
from pushplan.planners.predictive.turning import turned_start
from pushplan.world import Plan, PlanResult, PlanStats, PlanStatus, Stop, World


@dataclass(frozen=True)
class PredictiveShip:
    """Minimises m₀ l₀ + w Σ mᵢ lᵢ, with the floes pushed along each path that it looks at.

    After Zhong et al. 2025 (arXiv 2409.11326), whose edge costs come from the predicted change of
    the ice, carried along the path; here the prediction is that of a contact model, and the cost is
    what the metrics measure. A table of costs to go over the ice as it lies guides a beam of
    arcs (see `beam.Beam`). Use it where the positions of the floes are known.

    Plans keep the ship's origin half a beam inside the sides of the channel where it does not
    start nearer. Without a stop rule the effort is fixed; with one the beam is widened until
    the rule fires. An iteration is one predicted piece of path.

    Args:
        config: parameters.
        interaction: predicts the floes.
    """

    config: PredictiveConfig = field(default_factory=PredictiveConfig)
    interaction: IceInteraction = field(default_factory=IceInteraction)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, or something static is in the water.
        """
        began = time.perf_counter()
        scene = make_scene(world, self.config, self.interaction)
        return _plan(scene, self.config, FloeCarrier(scene), stop, began)


@dataclass(frozen=True)
class PredictiveShipNetwork:
    """`PredictiveShip` with a network that predicts occupancy and work from occupancy.

    The ice is carried as a map, which the network changes piece by piece, all pieces of a layer
    of the beam in one call. Use it where only an occupancy map is known, or to compare.

    Args:
        config: parameters.
        network: predicts; the shipped weights by default.
        interaction: sweeps the plan that is returned, for its prediction; the search does not
            use it.
    """

    config: PredictiveConfig = field(default_factory=lambda: PredictiveConfig(widest=24, sparse=0))
    network: IceNetwork = field(default_factory=IceNetwork)
    interaction: IceInteraction = field(default_factory=IceInteraction)

    def plan(
        self, world: World, *, stop: Stop | None = None, rng: np.random.Generator | None = None
    ) -> PlanResult:
        """Plan from ``world``; see `pushplan.world.Planner`. There is no chance in it.

        Raises:
            InvalidInputError: if the goal is no line, something static is in the water, or the
                network cannot be read.
        """
        began = time.perf_counter()
        self.network.load()
        scene = make_scene(world, self.config, self.interaction)
        return _plan(scene, self.config, MapCarrier(scene, self.network), stop, began)


def _plan(
    scene: Scene, config: PredictiveConfig, carrier: Carrier[Any], stop: Stop | None, began: float
) -> PlanResult:
    check = (lambda iterations, cost: False) if stop is None else stop.start()
    beam: Beam[Any] = Beam(scene, config, carrier, check)
    if not scene.inside(scene.start[None]):
        return _result(PlanStatus.START_BLOCKED, None, beam, began)
    root = beam.root()
    if scene.goal <= 0.0:
        return _result(PlanStatus.SOLVED, _plan_along(scene, root, carrier), beam, began, began)
    if scene.goal > scene.high[1]:
        return _result(PlanStatus.GOAL_UNREACHABLE, None, beam, began)
    if abs(scene.start[2] - 0.5 * math.pi) > STEEPEST - 0.1:
        turned = turned_start(scene, config)
        if turned is None:
            return _result(PlanStatus.GOAL_UNREACHABLE, None, beam, began)
        root = beam.extend(root, turned)
    best, first = beam.finish(root), math.nan
    width = config.beam_width(len(scene.near))
    while True:
        if best is not None and best.total < beam.best_cost:
            beam.best_cost = best.total
            first = time.perf_counter() if math.isnan(first) else first
        if beam.stopped or (beam.rounds > 0 and (stop is None or width > config.widest)):
            break
        beam.rounds += 1
        node = beam.search(root, width, config.horizon * scene.length)
        found = None if node is None else beam.finish(node)
        if found is not None and found.total < beam.best_cost:
            best = found
        width *= 2
    if best is None and beam.stopped:
        status = PlanStatus.CANCELLED if stop and stop.cancelled else PlanStatus.TIMED_OUT
        return _result(status, None, beam, began)
    if best is None:
        return _result(PlanStatus.GOAL_UNREACHABLE, None, beam, began)
    plan = _plan_along(scene, best, carrier)
    return _result(PlanStatus.SOLVED, plan, beam, began, first)


def _plan_along(scene: Scene, node: Partial[Any], carrier: Carrier[Any]) -> Plan:
    """A plan at full speed along a path, with what it does to the floes."""
    world = scene.world
    robot, way = world.robot, node.path()
    poses = scene.to_world(way[:, :3])
    headings = np.unwrap(poses[:, 2])
    poses[:, 2] = headings + (world.robot_pose[2] - headings[0])  # whole turns
    poses[0] = world.robot_pose
    chords = np.hypot(*np.diff(way[:, :2], axis=0).T)
    half = np.clip(0.5 * np.abs(way[1:, 3]) * chords, 1e-9, 1.0)
    arcs = chords * np.arcsin(half) / half
    traced = carrier.trace(node)
    steps = np.diff(traced[..., :2], axis=0)
    work = float((np.hypot(steps[..., 0], steps[..., 1]) @ scene.crowd.masses).sum())
    objects = np.repeat(world.movables.poses[None], len(way), axis=0)
    objects[:, scene.near] = scene.to_world(traced)
    return Plan(
        times=np.concatenate([[0.0], np.cumsum(arcs / robot.max_speed)]),
        poses=poses,
        speeds=np.full(len(way), robot.max_speed),
        turn_rates=robot.max_speed * np.append(way[1:, 3], 0.0),
        travel_cost=robot.mass * float(arcs.sum()),
        interaction_cost=work,
        object_poses=objects,
    )


def _result(
    status: PlanStatus, plan: Plan | None, beam: Beam[Any], began: float, first: float = math.nan
) -> PlanResult:
    stats = PlanStats(
        wall_time_s=time.perf_counter() - began,
        first_solution_s=first - began,
        iterations=beam.iterations,
        nodes=beam.nodes,
        detail={"cost": beam.best_cost},
    )
    return PlanResult(status, plan, stats)
