"""Efficiency and effort of navigation: the Bench-Push paper, equations 1 and 2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from pushplan.geometry import VisibilityGraph
from pushplan.metrics.lengths import interaction_work, robot_path_length
from pushplan.world import Episode, GoalDisc
from pushplan.world.checks import choice

Clearance = Literal["robot", "point"]


@dataclass(frozen=True)
class NavigationScores:
    """Scores of a robot that drives to its goal among things that it may push.

    Args:
        success: the goal was reached.
        efficiency: E_nav in [0, 1]: shortest length over driven length, 0 without success.
        effort: I_nav in [0, 1]: the robot's own work over all work; 1 if nothing was pushed.
        path_length_m: l_0, length of the robot's path [m].
        interaction_work_kg_m: sum of object mass times object path length [kg m].
        shortest_length_m: l_0*, shortest path around static things [m].
    """

    success: bool
    efficiency: float
    effort: float
    path_length_m: float
    interaction_work_kg_m: float
    shortest_length_m: float


def navigation_scores(
    episode: Episode, *, to_goal_point: bool = False, clearance: Clearance = "robot"
) -> NavigationScores:
    """Score one episode that has a goal for the robot itself.

    A robot that never moved has E_nav = 1 if it succeeded (it started where it had to be) and
    0 otherwise, and I_nav = 1 if no object moved.

    Args:
        episode: the recorded run.
        to_goal_point: measure l_0* to the goal's centre instead of to the nearest state that
            counts as the goal, as the reference implementation does; E_nav can then pass 1.
            A goal line has no centre and is measured to the line either way.
        clearance: ``"robot"`` keeps the robot's inscribed disc clear of static things, which no
            path of the robot can undercut; ``"point"`` treats the robot as a point.

    Raises:
        InvalidInputError: if the goal is one for the objects.
    """
    length = robot_path_length(episode)
    work = interaction_work(episode)
    shortest = shortest_length(episode, to_goal_point=to_goal_point, clearance=clearance)
    return NavigationScores(
        success=episode.success,
        efficiency=efficiency(episode.success, shortest, length),
        effort=effort(episode.world.robot.mass, length, work),
        path_length_m=length,
        interaction_work_kg_m=work,
        shortest_length_m=shortest,
    )


def shortest_length(
    episode: Episode, *, to_goal_point: bool = False, clearance: Clearance = "robot"
) -> float:
    """l_0*: shortest path [m] from the start that avoids only static things, inf if none."""
    choice("clearance", clearance, ("robot", "point"))
    world = episode.world
    goal = world.navigation_goal
    radius = 0.0
    if clearance == "robot":
        radius = world.robot.inscribed_radius
    graph = VisibilityGraph(world.static, clearance=radius, exact=True)
    start = episode.robot_poses[0, :2]
    if to_goal_point and isinstance(goal, GoalDisc):
        return float(graph.shortest_path(start, goal.center).length)
    return float(graph.to_goal(start, goal).length)


def efficiency(success: bool, shortest_m: float, driven_m: float) -> float:
    """E_nav, equation 1: ``1[success] l_0* / l_0``.

    NaN if the robot succeeded although no path exists among the static things it was told of.
    """
    if not success:
        return 0.0
    if math.isinf(shortest_m):
        return math.nan
    return shortest_m / driven_m if driven_m > 0.0 else 1.0


def effort(robot_mass_kg: float, driven_m: float, work_kg_m: float) -> float:
    """I_nav, equation 2: ``m_0 l_0 / (m_0 l_0 + sum_i m_i l_i)``."""
    own = robot_mass_kg * driven_m
    return own / (own + work_kg_m) if work_kg_m > 0.0 else 1.0


def e_nav(episode: Episode) -> float:
    """E_nav with the default conventions."""
    if not episode.success:
        return 0.0  # saves the search for the shortest path
    return navigation_scores(episode).efficiency


def e_nav_to_goal_point(episode: Episode) -> float:
    """E_nav with l_0* measured to the goal's centre, to be set beside the paper's tables."""
    if not episode.success:
        return 0.0  # as in `e_nav`
    return navigation_scores(episode, to_goal_point=True).efficiency


def i_nav(episode: Episode) -> float:
    """I_nav of an episode; without the shortest path, which takes longest."""
    length = robot_path_length(episode)
    work = interaction_work(episode)
    return effort(episode.world.robot.mass, length, work)
