"""Plain facts of an episode."""

from __future__ import annotations

from pushplan.world import Episode


def success(episode: Episode) -> float:
    """1 if the task's goal was reached, else 0."""
    return float(episode.success)


def steps(episode: Episode) -> float:
    """How many actions were sent to the environment."""
    return float(len(episode.actions))


def sim_time_s(episode: Episode) -> float:
    """Simulated time from start to end [s]."""
    return float(episode.times[-1] - episode.times[0])
