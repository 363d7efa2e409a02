"""Scores of an episode while it goes on, for films and for people who drive."""

from __future__ import annotations

import numpy as np

from pushplan.metrics import compute, manipulation, navigation
from pushplan.world import Episode, World
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.polyline import path_length, path_lengths


class Scoreboard:
    """Adds up lengths and work from poses as they come in."""

    def __init__(self, start: World) -> None:
        self._start = start
        self._world = start
        self._robot = start.robot_pose[None, :2]
        self._objects = start.movables.poses[None, :, :2]
        self._driven = 0.0
        self._lengths = np.zeros(len(start.movables))
        self._trees: dict[bytes, tuple[float, FloatArray]] = {}
        self.manipulates = start.goal_kind == "objects"

    def advance(self, world: World, robot_poses: FloatArray, object_poses: FloatArray) -> None:
        """Take in what moved since the last call.

        Args:
            world: the scene now.
            robot_poses: (N, 3) poses since then.
            object_poses: (N, K, 3) of all objects of the start.
        """
        robot = np.concatenate([self._robot, robot_poses[:, :2]])
        objects = np.concatenate([self._objects, object_poses[..., :2]])
        self._driven += path_length(robot)
        self._lengths += path_lengths(objects)
        self._robot = robot[-1:]
        self._objects = objects[-1:]
        self._world = world

    def completed(self) -> BoolArray:
        """(K,) which objects of the start are where they belong; those that left the floor are."""
        done = np.ones(len(self._start.movables), dtype=bool)
        here = np.isin(self._start.movables.ids, self._world.movables.ids)
        done[here] = self._world.completed
        return done

    def lines(self) -> list[str]:
        """Text: what has been driven and pushed so far, and the scores of it."""
        work = float(self._start.movables.masses @ self._lengths)
        first = f"{self._world.time:.1f} s   path {self._driven:.2f} m   work {work:.3g} kg m"
        if not self.manipulates:
            score = navigation.effort(self._start.robot.mass, self._driven, work)
            return [first, f"I {score:.2f}"]
        done = self.completed()
        tree, shortest = self._tree(done)
        efficiency = manipulation.efficiency(tree, self._driven, everything=bool(done.all()))
        effort = manipulation.effort(self._start, shortest, self._lengths, self._driven)
        fraction = f"{int(done.sum())} of {len(done)} done"
        return [first, f"{fraction}   E {efficiency:.2f}   I {effort:.2f}"]

    def _tree(self, done: BoolArray) -> tuple[float, FloatArray]:
        key = done.tobytes()
        if key not in self._trees:
            needed = done & ~self._start.completed
            self._trees[key] = (
                manipulation.tree_length(self._start, needed),
                manipulation.shortest_lengths(self._start, needed),
            )
        return self._trees[key]


def closing_lines(episode: Episode) -> list[str]:
    """Text for the end of an episode: how it ended, and its final scores."""
    names = ("S_manip", "E_manip", "I_manip", "E_nav", "I_nav")
    values = compute(episode, names)
    scores = "   ".join(f"{name[0]} {value:.3f}" for name, value in values.items())
    ending = episode.reason
    if episode.success:
        ending = f"success ({episode.reason})"
    return [ending, scores]
