"""Libraries of the extras: one line says what to install where one is missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from pushplan.world.errors import MissingDependencyError

EXTRAS = {
    "PIL": "pictures",
    "argcomplete": "completion",
    "rich": "sim",
    "gymnasium": "sim",
    "mujoco": "sim",
    "pymunk": "sim",
    "casadi": "ships",
    "onnxruntime": "learned",
    "imageio_ffmpeg": "plots",
    "jinja2": "plots",
    "matplotlib": "plots",
    "mcap": "ros",
    "rosbags": "ros",
    "pyarrow": "parquet",
    "distributed": "cluster",
    "h5py": "learn",
    "minari": "learn",
    "onnx": "learn",
    "stable_baselines3": "learn",
    "tensorboard": "learn",
    "torch": "learn",
}
"""Library -> the extra of pushplan that brings it."""


def need(module: str) -> Any:
    """Import a module: a library of an extra, or one of ours that needs such a library.

    Raises:
        MissingDependencyError: if the library is not installed; it names the extra.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        told = missing(error)
        if told is None:
            raise
        raise told from error


def missing(error: BaseException) -> MissingDependencyError | None:
    """What to say of an error that says that a library of an extra is missing; None of others."""
    name = error.name if isinstance(error, ModuleNotFoundError) else None
    library = (name or "").partition(".")[0]
    if library not in EXTRAS:
        return None
    return MissingDependencyError(
        f"this needs {library}: pip install 'pushplan[{EXTRAS[library]}]'"
    )
