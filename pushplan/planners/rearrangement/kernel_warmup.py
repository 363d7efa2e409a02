"""Load the compiled kernels of the manipulation policies before they are needed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.control.recovery import warm_up_recovery
from pushplan.geometry.transforms import arc_step
from pushplan.gtsp import warm_up_solver
from pushplan.planners.pushing import warm_up as warm_up_pushing
from pushplan.planners.rearrangement.approach import approach_tree
from pushplan.planners.rearrangement.controller_kernels import steer_push
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.relocation import relocating_pushes
from pushplan.planners.warm_up_worlds import warm_up_worlds
from pushplan.world import Policy, World

_STEPS = 150
_PERIOD = 0.2  # [s]


@functools.cache
def warm_up_rearrangement() -> None:
    """Solve, push and look for every kind of push; no kernel is for one kind of task alone."""
    warm_up_solver(proof=False)
    warm_up_pushing()
    scene = _small_scene()
    relocating_pushes(scene, 0, approach_tree(scene))
    warm_up_recovery()


@functools.cache
def warm_up_steering() -> None:
    """Steer a push outside rollouts, as `GeometricPusher` does; few episodes come to that."""
    here, scene = np.zeros(3), _small_scene()
    steer_push(here, here, np.eye(2), 0.0, 0.0, scene.controller)


@functools.cache
def drive_in_small_worlds(policy: Callable[[], Policy]) -> None:
    """Let a new policy plan and drive for boxes in each kind of task."""
    for world in warm_up_worlds("rearrangement"):
        driven = policy()
        for _ in range(_STEPS):
            world = _driven(world, driven.act(world, None))


def _small_scene() -> PushScene:
    return PushScene(warm_up_worlds("rearrangement")[0], RearrangementConfig())


def _driven(world: World, twist: Any) -> World:
    """A step later, when nothing is in the robot's way."""
    pose = np.empty(3)
    arc_step(np.array(world.robot_pose), _PERIOD * twist.linear, _PERIOD * twist.angular, pose)
    return world.moved(robot_pose=pose, time=world.time + _PERIOD)
