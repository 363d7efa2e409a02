"""What an approach and a push would come to together, by the interaction model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_simulator import PushSimulator
from pushplan.planners.rearrangement.route import Route, RoutePlanner
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length, path_lengths


@dataclass(frozen=True, eq=False)
class SimulatedPush:
    """A push with the route to it.

    Args:
        cost: of both [m]; inf where the push would not do what it is for.
        route: to its start.
        push: what it is predicted to do after that route.
    """

    cost: float
    route: Route
    push: Push


def simulate_route(planner: RoutePlanner, route: Route) -> tuple[FloatArray, FloatArray] | None:
    """Poses of the robot (N, 3) and of the objects (N, K, 3) on a route; None if it jams."""
    scene, path = planner.scene, planner.poses_along(route)
    poses = scene.poses.copy()
    out = np.empty((len(path), len(poses), 3))
    jammed = sweep_path(path, poses, scene.bodies, scene.settings, out)
    return None if jammed >= 0 else (path, out)


def simulate_push(
    planner: RoutePlanner, simulator: PushSimulator, route: Route, push: Push
) -> SimulatedPush:
    """Drive the route and the push in the interaction model."""
    driven = simulate_route(planner, route)
    if driven is None:
        return SimulatedPush(np.inf, route, push)
    path, objects = driven
    length = path_length(path[:, :2])
    ends = simulator.resimulate(
        push, path[-1], poses=objects[-1].copy(), spent=path_lengths(objects)
    )
    good = [end for end in ends if push.relocates or set(push.delivers) <= set(end.delivers)]
    if not good:
        return SimulatedPush(np.inf, route, push)
    return SimulatedPush(length + good[0].cost, route, good[0])
