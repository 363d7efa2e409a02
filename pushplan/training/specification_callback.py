"""`specification_callback`: a Stable-Baselines3 training that ends with a file for ``sb3:FILE``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pushplan.imports.on_demand import need
from pushplan.learned.sb3_saving import describe_model, write_beside


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
    callbacks = need("stable_baselines3.common.callbacks")

    class SpecificationWriter(callbacks.BaseCallback):  # type: ignore[name-defined]
        def _on_training_start(self) -> None:
            # what cannot be described is an error before the training, not after it
            write_beside(path, describe_model(self.model, env=env, repeat=repeat))

        def _on_step(self) -> bool:
            return True

        _on_training_end = _on_training_start

    return SpecificationWriter()
