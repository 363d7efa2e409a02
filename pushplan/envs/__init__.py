"""Environments: tasks and simulators behind one `PushEnv`.

Importing this package registers the Gymnasium ids and loads no engine; the
rest comes on first use. Since release 1.0 Gymnasium no longer looks for environments in installed
packages, so either import this package first, or let Gymnasium do it::

    gymnasium.make("pushplan.envs:pushplan/Maze-v0")
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names, need

if TYPE_CHECKING:
    from pushplan.envs.making import make, make_vector
    from pushplan.envs.push_env import EpisodeOverError, PushEnv
    from pushplan.envs.rollout import RolloutInteraction
    from pushplan.envs.simulators.base import Trace
    from pushplan.envs.vector_env import VectorWorkerError, WorkerVectorEnv

__all__ = [
    "EpisodeOverError",
    "PushEnv",
    "RolloutInteraction",
    "Trace",
    "VectorWorkerError",
    "WorkerVectorEnv",
    "make",
    "make_vector",
    "register_all",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "making": "make make_vector",
        "push_env": "EpisodeOverError PushEnv",
        "rollout": "RolloutInteraction",
        "simulators.base": "Trace",
        "vector_env": "VectorWorkerError WorkerVectorEnv",
    },
)


def register_all() -> None:
    """Tell Gymnasium about every task; does nothing where it knows already."""
    registration = need("gymnasium.envs.registration")
    from pushplan.envs.registry import GYM_IDS

    for gym_id, task in GYM_IDS.items():
        if gym_id not in registration.registry:
            registration.register(
                id=gym_id, entry_point="pushplan.envs.making:make_env", kwargs={"task": task}
            )


if find_spec("gymnasium") is not None:
    register_all()
