"""`Gtsp`: the paper's policy. One tour over straight pushes, planned once and then followed."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control import LegFollower, Legs, clamp_twist
from pushplan.geometry import VisibilityGraph
from pushplan.gtsp import solve_gtsp
from pushplan.motion.keep_out import keep_out
from pushplan.planners.rearrangement.candidates import open_edges
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rearrangement_policy import RearrangementPolicy
from pushplan.world import ClearanceArea, MaxIterations, Receptacle, Twist, World
from pushplan.world.checks import FloatArray


class Gtsp(RearrangementPolicy):
    """Plans once and follows its path, as the policy of the Bench-Push paper does.

    Every object is a cluster; a node is a straight push of it across one open edge of the area, or
    into the receptacle. An arc costs the straight line from the end of one push to the start of the
    next, and that push. Other objects are not looked at, and nothing is looked at afterwards. No
    chance is involved.

    Args:
        config: settings; of the cost, nothing is used.
    """

    def _forget(self) -> None:
        super()._forget()
        self._route_follower: LegFollower | None = None

    def _act(self, world: World) -> Twist:
        if self._route_follower is None:
            self._route_follower = LegFollower(
                world.robot, self._path(world), response=self.config.response
            )
        pose = world.robot_pose
        follower = self._route_follower
        command = follower.command(pose, world.time, self._clock.held)
        while command is None and not follower.arrived:
            follower.skip()
            command = follower.command(pose, world.time, self._clock.held)
        return command or clamp_twist(world.robot, 0.0, 0.0)

    def _path(self, world: World) -> Legs:
        """The whole path: for each object of the tour, behind it and then to the edge."""
        scene = PushScene(world, self.config)
        nodes = [node for k in scene.left for node in _pushes(scene, k)]
        heading = float(world.robot_pose[2])
        if not nodes:
            return Legs(np.zeros((0, 2)), np.zeros(0), np.zeros(1), heading)
        count = len(nodes)
        costs = np.full((count + 1, count + 1), np.inf)
        robot = world.robot_pose[:2]
        costs[:-1, -1] = 0.0
        for m, (_, start, end) in enumerate(nodes):
            length = math.dist(start, end)
            for n, before in enumerate([*(before for _, _, before in nodes), robot]):
                costs[n, m] = math.dist(before, start) + length
        boxes = sorted({k for k, _, _ in nodes})
        clusters = [[n for n in range(count) if nodes[n][0] == k] for k in boxes]
        tour = solve_gtsp(costs, [*clusters, [count]], stop=MaxIterations(300))
        at = list(tour.nodes).index(count)
        points = [robot]
        graph = VisibilityGraph(keep_out(world), clearance=world.robot.inscribed_radius)
        for n in [*tour.nodes[at + 1 :], *tour.nodes[:at]]:
            _, start, end = nodes[int(n)]
            path = graph.shortest_path(points[-1], start)
            points += [*(path.points[1:] if len(path.points) > 1 else [start]), end]
        return Legs.ahead(np.array(points[1:]), heading)


def _pushes(scene: PushScene, k: int) -> list[tuple[int, FloatArray, FloatArray]]:
    """The object, where the robot's middle begins and where it ends, for every straight push."""
    goal = scene.world.goal
    box = scene.poses[k, :2]
    radius = float(scene.movables.radii[k])
    if isinstance(goal, ClearanceArea):
        moves = [
            (box + (float((a - box) @ normal) + radius) * normal) - box
            for a, _, normal, _ in open_edges(goal)
        ]
    else:
        assert isinstance(goal, Receptacle)
        moves = [goal.polygon.mean(axis=0) - box]
    starts = [scene.starts.behind(k, math.atan2(move[1], move[0]), 0.0)[:2] for move in moves]
    return [(k, start, start + move) for start, move in zip(starts, moves, strict=True)]
