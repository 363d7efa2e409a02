"""Plain facts of an episode; lengths are those of paths, not displacements, from every pose."""

from __future__ import annotations

from pushplan.world import Episode
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length, path_lengths


def success(episode: Episode) -> float:
    """1 if the task's goal was reached, else 0."""
    return float(episode.success)


def steps(episode: Episode) -> float:
    """Count the actions that were sent to the environment."""
    return float(len(episode.actions))


def sim_time_s(episode: Episode) -> float:
    """Simulated time from start to end [s]."""
    return float(episode.times[-1] - episode.times[0])


def object_path_lengths(episode: Episode) -> FloatArray:
    """(K,) path length l_i [m] of each object's centre over the episode."""
    return path_lengths(episode.object_poses)


def interaction_work(episode: Episode) -> float:
    """Sum of object mass times object path length [kg m]; friction and gravity cancel."""
    return float(episode.world.movables.masses @ object_path_lengths(episode))


def robot_path_length(episode: Episode) -> float:
    """Path length l_0 [m] of the robot's origin over the episode."""
    return path_length(episode.robot_poses)
