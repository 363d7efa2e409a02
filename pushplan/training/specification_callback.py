"""`specification_callback`: a Stable-Baselines3 training that ends with a file for ``sb3:FILE``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pushplan.world.libraries import need


def specification_callback(path: str | Path, *, env: Any = None, repeat: int = 1) -> Any:
    """A callback of Stable-Baselines3 that writes the specification beside a model.

    ``model.learn(steps, callback=specification_callback("model.zip"))`` writes
    ``model.pushplan.json`` when the training begins, and again with its steps when it ends. Save
    the model under the same name, ``model.save("model.zip")``, and ``sb3:model.zip`` is a policy.

    Args:
        path: where the model will be saved, with or without ``.zip``.
        env: an environment like that of the training, where those of the model live in other
            processes (``SubprocVecEnv``); the model's own if None.
        repeat: steps for which a decision stands, where a wrapper repeats actions.

    Returns:
        The callback. As the training begins it raises what `pushplan.learned.save_sb3` raises.

    Raises:
        MissingDependencyError: without Stable-Baselines3.
    """
    need("stable_baselines3")
    from pushplan.training.policies.sb3_parts import SpecificationWriter

    return SpecificationWriter(path, env, repeat)
