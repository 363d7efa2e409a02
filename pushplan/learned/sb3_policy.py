"""`Sb3Policy`: a Stable-Baselines3 zip. It holds pickles, so it runs only where it is trusted."""

from __future__ import annotations

import io
import logging
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.errors import describe
from pushplan.files.safe_files import read_bytes, read_text
from pushplan.imports.on_demand import need
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
            raise InvalidInputError(f"{self.path} cannot be loaded: {describe(error)}") from error
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
        raise InvalidInputError(f"{path} is no readable zip: {describe(error)}") from error
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
