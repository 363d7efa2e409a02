"""Predictive control over the physics engine itself in place of the quasi-static model.

    pushplan run maze-3d-3 --policy examples/mppi_rollouts.py:over_mujoco
    pushplan run maze-2d-5 --policy examples/mppi_rollouts.py:over_pymunk

Each sample is a rollout of the simulator, so there are few of them here.
"""

from pushplan.envs import RolloutInteraction, make
from pushplan.planners import make_policy
from pushplan.scenarios import suite


def over_mujoco(scenes="maze-3d-3", **settings):
    """The policy with MuJoCo rollouts.

    Args:
        scenes: a suite of the task that it is for: MuJoCo needs the heights of everything.
        settings: fields of `MppiConfig`.
    """
    return _over("mujoco", scenes, settings)


def over_pymunk(scenes="maze-2d-5", **settings):
    """The same with Pymunk."""
    return _over("pymunk", scenes, settings)


def _over(simulator, scenes, settings):
    few = {"samples": 16, "steps": 12, "stride": 0.5, "knots": 4}
    materials = make(suite(scenes).scenarios[0], observation="state").task.materials
    model = RolloutInteraction(simulator, materials)
    return make_policy("mppi", interaction=model, **{**few, **settings})
