"""`IceNetwork`: the U-Net behind the contract of occupancy predictors, on ONNX Runtime."""

from __future__ import annotations

import functools
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.imports.on_demand import need
from pushplan.interaction.occupancy import (
    CELLS_PER_LENGTH,
    CHANNELS,
    PATCH_CELLS,
    OccupancyForecast,
    PassageBatch,
    Patch,
)
from pushplan.world.checks import FloatArray, integer

SHIPPED = "ice_network.onnx"
_GREATEST_BATCH = 256


class IceNetwork:
    """Occupancy after passing, predicted by a small U-Net for all ice concentrations at once.

    Trained on the two-dimensional Ship-Ice simulator with the hull of its benchmark preset; patches
    scale with the hull's length, so a ship of that shape may have any size. See the model card
    beside the weights. PyTorch is not needed.

    Args:
        path: an ``.onnx`` file; the weights that are shipped if None.
        threads: of ONNX Runtime.

    Raises:
        InvalidInputError: if the file cannot be read or is another kind of network.
        MissingDependencyError: without onnxruntime.
    """

    def __init__(self, path: str | Path | None = None, *, threads: int = 1) -> None:
        self.path = Path(str(resources.files("pushplan.interaction") / "weights" / SHIPPED))
        if path is not None:
            if not isinstance(path, (str, Path)):
                raise InvalidInputError(f"path must be that of a file, got {path!r}")
            self.path = Path(path)
        self.threads = integer("threads", threads, low=1)

    def __repr__(self) -> str:
        return f"IceNetwork({self.path.name!r}, threads={self.threads})"

    def load(self) -> None:
        """Read the weights now; otherwise the first prediction does."""
        self._session()

    def _session(self) -> Any:
        try:
            changed = self.path.stat().st_mtime_ns
        except OSError:
            changed = 0  # the message of what reads it says more
        return _session(self.path, self.threads, changed)

    def predict(self, batch: PassageBatch) -> OccupancyForecast:
        """See `OccupancyPredictor.predict`; only the patches of the batch are used."""
        after, effort = self.predict_patches(batch.patches)
        return OccupancyForecast(after, effort * batch.density * batch.cell**3)

    def predict_patches(self, patches: Patch) -> tuple[Patch, FloatArray]:
        """The bare network, without checks of values.

        Args:
            patches: (B, 3, 40, 40) float32, as in `PassageBatch`.

        Returns:
            (B, 40, 40) occupancy after; (B,) work on ice of unit density [cells³].

        Raises:
            InvalidInputError: if the network does not give numbers.
        """
        session = self._session()
        parts = [
            session.run(["after", "work"], {"patches": patches[i : i + _GREATEST_BATCH]})
            for i in range(0, len(patches), _GREATEST_BATCH)
        ]
        if not parts:
            return np.empty((0, PATCH_CELLS, PATCH_CELLS), np.float32), np.empty(0)
        after: Patch = np.concatenate([part[0] for part in parts])
        work = np.concatenate([part[1] for part in parts]).astype(np.float64)
        if not (np.isfinite(work).all() and np.isfinite(after).all()):
            raise InvalidInputError(f"{self.path} gives values that are not finite: train it again")
        return after, work * float(CELLS_PER_LENGTH**3)


@functools.lru_cache(maxsize=4)
def _session(path: Path, threads: int, changed: int) -> Any:
    """An ONNX Runtime session, checked; one for each state of a file in a process."""
    onnxruntime = need("onnxruntime")
    if not path.is_file():
        raise InvalidInputError(f"there is no network in {path}")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    try:
        session = onnxruntime.InferenceSession(
            str(path), options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # its errors share no root of their own
        reason = " ".join(str(error).split())[:200]
        raise InvalidInputError(f"{path} is not a readable ONNX network: {reason}") from error
    _check_doors(path, session)
    return session


def _check_doors(path: Path, session: Any) -> None:
    """The network takes what we have and gives what we want."""
    wanted = {
        "patches": [len(CHANNELS), PATCH_CELLS, PATCH_CELLS],
        "after": [PATCH_CELLS, PATCH_CELLS],
        "work": [],
    }
    doors = {d.name: d for d in [*session.get_inputs(), *session.get_outputs()]}
    if set(doors) != set(wanted):
        raise InvalidInputError(
            f"{path} must have the input patches and the outputs after and work, "
            f"it has {', '.join(sorted(doors))}"
        )
    for name, shape in wanted.items():
        found = list(doors[name].shape or [])
        if found[1:] != shape or isinstance(found[0], int) or doors[name].type != "tensor(float)":
            raise InvalidInputError(
                f"{path}: {name} must be float32 of shape (batch, {', '.join(map(str, shape))}), "
                f"it is {doors[name].type} of shape {tuple(found)}"
            )
