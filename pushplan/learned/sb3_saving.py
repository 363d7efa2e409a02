"""Specifications for models of Stable-Baselines3: inside their zips, or beside them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

from pushplan.learned.describing import describe
from pushplan.learned.sb3_policy import ALGORITHMS, MEMBER, beside
from pushplan.learned.specification import Specification
from pushplan.world import InvalidInputError


def save_sb3(model: Any, path: str | Path, *, env: Any = None, repeat: int = 1) -> Path:
    """Save a trained Stable-Baselines3 model so that ``sb3:FILE`` runs it.

    Args:
        model: the model; its environment says what it sees and does (`describe`).
        path: of the ``.zip``; ``NAME.pushplan.json`` is written beside it.
        env: an environment like that of the training, where those of the model live in other
            processes or are gone.
        repeat: as for `describe`.

    Returns:
        The ``.zip``.

    Raises:
        InvalidInputError, UnknownNameError: as `describe`; or if it is a model that cannot be
            loaded again. Nothing has been written.
    """
    specification = describe_model(model, env=env, repeat=repeat)
    write_beside(path, specification)
    model.save(_zip(path))
    return _zip(path)


def describe_model(model: Any, *, env: Any = None, repeat: int = 1) -> Specification:
    """The specification of a Stable-Baselines3 model; arguments and errors as `save_sb3`.

    It names the model's algorithm, one of `ALGORITHMS` of the library itself: that says how its
    file is loaded.
    """
    env = model.get_env() if env is None else env
    if env is None:
        raise InvalidInputError(
            "the model has no environment, give one like that of its training as env"
        )
    for kind in type(model).__mro__:
        if kind.__name__ in ALGORITHMS and kind.__module__.startswith("stable_baselines3."):
            facts = {"algorithm": kind.__name__.lower(), "steps": int(model.num_timesteps)}
            return describe(env, repeat=repeat, training=facts)
    raise InvalidInputError(
        f"a model must be one of {', '.join(ALGORITHMS)} of Stable-Baselines3, got "
        f"{type(model).__module__}.{type(model).__name__}"
    )


def write_beside(path: str | Path, specification: Specification) -> Path:
    """Write a specification where `Sb3Policy` looks for it.

    Args:
        path: of the model, with or without ``.zip``.
        specification: of the network, with ``training["algorithm"]``.

    Returns:
        The file written, ``NAME.pushplan.json``.
    """
    there = beside(_zip(path))
    there.parent.mkdir(parents=True, exist_ok=True)
    there.write_text(_text(specification) + "\n", encoding="utf-8")
    return there


def attach(path: str | Path, specification: Specification) -> None:
    """Put a specification into a Stable-Baselines3 zip, which stays loadable as before."""
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(MEMBER, _text(specification))


def _zip(path: str | Path) -> Path:
    path = Path(path)
    if path.suffix == ".zip":
        return path
    return path.with_name(f"{path.name}.zip")  # as Stable-Baselines3 appends it


def _text(specification: Specification) -> str:
    return json.dumps(json.loads(specification.to_json()), indent=1)
