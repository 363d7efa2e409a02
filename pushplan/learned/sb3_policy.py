"""Models of Stable-Baselines3: run, saved, and described inside their zips or beside them.

A zip holds pickles, so it runs only where it is trusted.
"""

from __future__ import annotations

import io
import json
import logging
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan import errors
from pushplan.files.safe_files import read_bytes, read_text
from pushplan.imports.on_demand import need
from pushplan.learned.describing import describe
from pushplan.learned.network_policy import NetworkPolicy
from pushplan.learned.specification import METADATA_KEY, Specification
from pushplan.world import InvalidInputError

TRUST_VARIABLE = "PUSHPLAN_TRUST_PICKLES"
"""Set to 1 in the environment of the process, it says that pickles may be loaded."""
MEMBER = f"{METADATA_KEY}.json"
"""Member of the zip, or ending of the file beside it, that holds the specification."""
_LONGEST_MEMBER_BYTES = 2**20
ALGORITHMS = ("PPO", "SAC", "A2C", "TD3", "DDPG")

log = logging.getLogger(__name__)


class UntrustedError(InvalidInputError):
    """A file with pickles was to be loaded without being trusted."""


class Sb3Policy(NetworkPolicy):
    """Runs a model that Stable-Baselines3 has saved; needs the extra ``learn``.

    The specification is the member ``pushplan.json`` of the zip, as `pushplan train` writes it, or
    a file ``FILE.pushplan.json`` beside it.

    Args:
        path: the ``.zip`` file.
        trust: let its pickles run. Loading a pickle runs whatever its author wrote. By
            default the environment variable ``PUSHPLAN_TRUST_PICKLES=1`` decides.
        label: what errors call it; the file's name by default.

    Raises:
        UntrustedError: if it is not trusted; nothing has been loaded.
        InvalidInputError: if it is no such file, or has no specification.
        MissingDependencyError: without Stable-Baselines3.
    """

    def __init__(
        self, path: str | Path, *, trust: bool | None = None, label: str | None = None
    ) -> None:
        self.path = Path(path)
        label = self.path.stem if label is None else label
        specification, algorithm = _look(self.path)
        if not (trusted() if trust is None else trust):
            raise UntrustedError(
                f"{self.path} is a Stable-Baselines3 file: it holds pickles, and loading them runs "
                "whatever code their author put there. If you trust where it comes from, give "
                f"--trust-pickles (or trust=True, or {TRUST_VARIABLE}=1); better export it to ONNX"
            )
        log.warning("loading pickles from %s: this can run any code", self.path)
        library = need("stable_baselines3")
        try:
            self._model = getattr(library, algorithm).load(self.path, device="cpu")
        except Exception as error:  # whatever unpickling raises
            raise InvalidInputError(
                f"{self.path} cannot be loaded: {errors.describe(error)}"
            ) from error
        super().__init__(self.decide, specification, label)

    def decide(self, seen: NDArray[Any]) -> NDArray[Any]:
        """The output of the network for one observation."""
        return np.asarray(self._model.predict(seen, deterministic=True)[0])


def trusted() -> bool:
    """Return True if the environment variable says that pickles may be loaded."""
    return os.environ.get(TRUST_VARIABLE, "") == "1"


def _look(path: Path) -> tuple[Specification, str]:
    """Specification and algorithm, read as text only."""
    data = read_bytes(path, "policy file")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
            if "data" not in names:
                raise InvalidInputError(f"{path} is no Stable-Baselines3 file: it has no 'data'")
            text = None
            # a member of a few bytes may unpack to gigabytes
            if MEMBER in names and archive.getinfo(MEMBER).file_size < _LONGEST_MEMBER_BYTES:
                text = archive.read(MEMBER).decode()
    except InvalidInputError:
        raise
    except Exception as error:  # a zip file can be broken in many ways
        raise InvalidInputError(f"{path} is no readable zip: {errors.describe(error)}") from error
    if text is None and beside(path).is_file():
        text = read_text(beside(path), "specification")
    if text is None:
        raise InvalidInputError(
            f"{path} does not say what it observes and how it acts: put a specification beside it "
            f"as {beside(path).name}; pushplan.learned.save_sb3 and 'pushplan describe' write one"
        )
    specification = Specification.from_json(text)
    algorithm = str(specification.training.get("algorithm", "")).upper()
    if algorithm not in ALGORITHMS:
        raise InvalidInputError(
            f"{path}: training.algorithm of the specification must be one of "
            f"{', '.join(ALGORITHMS)}, got {algorithm!r}"
        )
    return specification, algorithm


def beside(path: Path) -> Path:
    """Return the path of the specification of a zip that has none inside."""
    return path.with_suffix(f".{MEMBER}")


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
