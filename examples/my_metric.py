"""A metric of one's own: a function of an episode."""

from __future__ import annotations

from pushplan.world import Episode
from pushplan.world.polyline import path_length


def mean_speed(episode: Episode) -> float:
    """How fast the robot was on average [m/s]."""
    return path_length(episode.robot_poses) / float(episode.times[-1] - episode.times[0])
