"""Planning from where the robot will be, and joining the new plan to what it drives until then."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from pushplan.control import Progress, waiting_twist
from pushplan.core import geometry
from pushplan.interaction import InteractionModel
from pushplan.planners.following.replanning import poses_at
from pushplan.world import Plan, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths, path_length

_SPACING = 0.15  # distance between the poses of a stretch without a plan [R]


def world_ahead(
    world: World,
    plan: Plan | None,
    now: float,
    latency: float,
    interaction: InteractionModel,
    *,
    off_plan: bool = False,
) -> tuple[World, Plan | None]:
    """The world after some more time on the present plan, and the plan of that stretch.

    A robot that has no plan, or comes to its end, waits: see `pushplan.control.waiting_twist`.

    Args:
        world: the world now.
        plan: what is driven; None for nothing.
        now: how far on it the robot is, by its times [s].
        latency: how far to look ahead [s].
        interaction: predicts the objects.
        off_plan: the robot has left the plan, and comes back to it within some of its radii.

    Returns:
        The predicted world, and the plan of the stretch; ``world`` itself and None where there is
        no stretch, or the robot would jam on it.
    """
    if latency <= 0.0:
        return world, None
    times, poses, twists = _stretch(world, plan, now, latency, off_plan)
    swept = interaction.sweep(world, np.concatenate([world.robot_pose[None], poses[1:]]))
    if swept.jammed_at >= 0:
        return world, None
    speed, turn = twists[-1]
    theta = float(poses[-1, 2])
    dx, dy = (poses[-1] - poses[-2])[:2].tolist()
    if world.robot.slides and (dx or dy):
        theta = math.atan2(dy, dx)
    ahead = world.moved(
        robot_pose=poses[-1],
        robot_twist=[speed * math.cos(theta), speed * math.sin(theta), turn],
        movable_poses=swept.object_poses[-1],
        time=world.time + latency,
    )
    return ahead, Plan(
        times=times,
        poses=poses,
        speeds=twists[:, 0],
        turn_rates=twists[:, 1],
        travel_cost=world.robot.mass * path_length(poses),
        interaction_cost=swept.work,
        object_poses=swept.object_poses,
    )


def joined(stretch: Plan | None, plan: Plan) -> Plan:
    """One plan of a stretch and the plan that begins at its end."""
    if stretch is None:
        return plan
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(stretch, name)[:-1], getattr(plan, name)])
        for name in ("poses", "speeds", "turn_rates", "object_poses")
        if getattr(stretch, name) is not None and getattr(plan, name) is not None
    }
    begun = len(stretch.times) - 1
    return Plan(
        times=np.concatenate([stretch.times[:-1], stretch.times[-1] + plan.times]),
        **columns,
        travel_cost=stretch.travel_cost + plan.travel_cost,
        interaction_cost=stretch.interaction_cost + plan.interaction_cost,
        subtasks=tuple(
            replace(s, first=s.first + begun, last=s.last + begun) for s in plan.subtasks
        ),
    )


def passed(world: World, plan: Plan, seconds: float) -> int:
    """Index of the last pose of a plan that a robot has passed which began it a while ago.

    Args:
        world: where the robot is now.
        plan: the plan.
        seconds: for how long it may have driven it [s].
    """
    robot = world.robot
    progress = Progress(window=robot.circumscribed_radius + 1.2 * seconds * robot.max_speed)
    return progress.index(progress.update(plan, world.robot_pose))


def _stretch(
    world: World, plan: Plan | None, now: float, latency: float, off_plan: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times from now (N,), poses (N, 3) and twists (N, 2) over the next ``latency`` seconds."""
    if plan is None:
        times = np.zeros(1)
        poses = np.array(world.robot_pose)[None]
        twists = np.array([[world.robot.min_speed, 0.0]])
    else:
        times, poses, twists = _on_plan(plan, now, latency)
        if off_plan:
            off = world.robot_pose - poses[0]
            off[2] = math.remainder(off[2], math.tau)
            size = world.robot.circumscribed_radius
            poses = poses + off * np.exp(-arc_lengths(poses) / size)[:, None]
    left = latency - float(times[-1])
    if left <= 1e-9:
        return times, poses, twists
    robot = world.robot
    last = poses[-1]
    waits = waiting_twist(world.moved(robot_pose=last))
    speed = abs(waits.linear)
    steps = math.ceil(left * speed / (_SPACING * robot.circumscribed_radius)) or 1
    share = np.arange(steps + 1)[:, None] / steps
    parts = left * share[:, 0]
    arc = np.array(
        [geometry.arc_step(last, waits.linear * part, waits.angular * part) for part in parts]
    )
    twists = np.concatenate([twists[:-1], np.tile([waits.linear, waits.angular], (steps + 1, 1))])
    return np.append(times, times[-1] + left * share[1:]), np.concatenate([poses, arc[1:]]), twists


def _on_plan(plan: Plan, now: float, latency: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The part of a plan that is driven in the next ``latency`` seconds."""
    end = min(now + latency, float(plan.times[-1]))
    inner = (plan.times > now + 1e-9) & (plan.times < end - 1e-9)
    times = np.concatenate([[now], plan.times[inner], [end] if end > now else []])
    poses = poses_at(times, plan.times, plan.poses)
    index = np.searchsorted(plan.times, times + 1e-9, side="right") - 1
    return times - now, poses, np.column_stack([plan.speeds[index], plan.turn_rates[index]])
