"""What a worker process of a `WorkerVectorEnv` does."""

from __future__ import annotations

import contextlib
import pickle
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import CloudpickleWrapper, read_from_shared_memory

from pushplan.world import PushplanError


class VectorWorkerError(PushplanError):
    """A worker process has ended."""


def work(
    connection: Connection,
    env_fns: Sequence[CloudpickleWrapper],
    mode: AutoresetMode,
    memory: Any,
    count: int,
    share: slice,
) -> None:
    """Answer requests until told to close, or until the other process has ended."""
    try:
        envs = SyncVectorEnv(env_fns, copy=False, autoreset_mode=mode)
        shared = read_from_shared_memory(envs.single_observation_space, memory, count)
        connection.send((True, None))
    except Exception as error:
        connection.send((False, _portable(error)))
        return
    with contextlib.suppress(EOFError, KeyboardInterrupt, BrokenPipeError):
        while True:
            request, argument = connection.recv()
            if request == "close":
                break
            try:
                answer = ForkingPickler.dumps((True, _do(envs, request, argument, shared, share)))
            except Exception as error:
                answer = ForkingPickler.dumps((False, _portable(error)))
            connection.send_bytes(answer)
    envs.close()


def _do(envs: SyncVectorEnv, request: str, argument: Any, shared: Any, share: slice) -> Any:
    """Carry out a request; observations go to their share of what all processes see."""
    if request == "step":
        observations, *rest = envs.step(argument)
        _copy_into(shared, observations, share)
        return rest
    if request == "reset":
        seeds, options, mask = argument
        if mask is not None and not mask.any():
            return {}
        if mask is not None:
            options = {**(options or {}), "reset_mask": mask}
        observations, infos = envs.reset(seed=seeds, options=options)
        _copy_into(shared, observations, share)
        return infos
    if request == "set_attr":
        return envs.set_attr(*argument)
    name, args, kwargs = argument
    return envs.call(name, *args, **kwargs)


def _copy_into(out: Any, values: Any, part: slice) -> None:
    """Copy batched values into a part of a larger batch, of any space."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            _copy_into(out[key], value, part)
    elif isinstance(values, tuple):
        for place, value in zip(out, values, strict=True):
            _copy_into(place, value, part)
    else:
        out[part] = values


def _portable(error: Exception) -> Exception:
    """The error itself where it can be sent, else one with its text."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return VectorWorkerError(f"{type(error).__name__}: {error}")
    return error
