"""`WorkerVectorEnv`: environments in a few worker processes, several in each."""

from __future__ import annotations

import contextlib
import multiprocessing
import pickle
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import (
    CloudpickleWrapper,
    batch_space,
    create_empty_array,
    create_shared_memory,
    iterate,
    read_from_shared_memory,
)
from numpy.typing import NDArray

from pushplan.world import InvalidInputError, PushplanError
from pushplan.world.checks import integer

_PATIENCE_S = 5.0  # for which a worker may take to close its environments


class VectorWorkerError(PushplanError):
    """A worker process has ended."""


class WorkerVectorEnv(VectorEnv[Any, Any, Any]):
    """A Gymnasium vector environment that uses several cores.

    Each worker process steps its share of the environments one after the other, in a
    `gymnasium.vector.SyncVectorEnv`. Observations go through shared memory. A step therefore costs
    one short message to each worker, however many environments it has; with one process for each
    environment, as in `gymnasium.vector.AsyncVectorEnv`, a short step costs less than its message.
    The same seeds give the same episodes for every number of workers.

    Worker processes are spawned: a script needs its ``if __name__ == "__main__":``.

    Args:
        env_fns: make the environments; all have the same spaces.
        workers: processes among which the environments are divided; no more than there are
            environments.
        copy: whether `step` and `reset` return observations of their own, which later steps do not
            change.
        autoreset_mode: as in `gymnasium.vector.SyncVectorEnv`.

    Raises:
        InvalidInputError: if there is no environment, or a number makes no sense.
    """

    def __init__(
        self,
        env_fns: Sequence[Callable[[], Any]],
        *,
        workers: int,
        copy: bool = True,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        super().__init__()
        if not env_fns:
            raise InvalidInputError("env_fns must have at least one environment, got none")
        workers = integer("workers", workers, low=1, high=len(env_fns))
        mode = AutoresetMode(autoreset_mode)
        first = env_fns[0]()
        self.single_observation_space = first.observation_space
        self.single_action_space = first.action_space
        self.metadata = {**first.metadata, "autoreset_mode": mode}
        self.render_mode = first.render_mode
        first.close()
        self.num_envs, self.copy = len(env_fns), copy
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        context: Any = multiprocessing.get_context("spawn")
        memory = create_shared_memory(self.single_observation_space, self.num_envs, context)
        self._observations = read_from_shared_memory(
            self.single_observation_space, memory, self.num_envs
        )
        ends = [n * self.num_envs // workers for n in range(workers + 1)]
        self._shares = [slice(first, end) for first, end in pairwise(ends)]
        self._connections: list[Connection] = []
        self._processes = []
        for share in self._shares:
            ours, theirs = context.Pipe()
            made = [CloudpickleWrapper(env_fn) for env_fn in env_fns[share]]
            process = context.Process(
                target=_work,
                args=(theirs, made, mode, memory, self.num_envs, share),
                daemon=True,
            )
            process.start()
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)
        try:
            self._answers()  # of `__init__`
        except BaseException:
            self.close()
            raise

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin new episodes; see `gymnasium.vector.SyncVectorEnv.reset`.

        Args:
            seed: of the first environment, the others count on from there; or one for each.
            options: for each environment; ``"reset_mask"`` (num_envs,) bool says which.
        """
        count, given = self.num_envs, dict(options or {})
        if seed is None or isinstance(seed, int | np.integer):
            seeds: list[int | None] = [
                None if seed is None else int(seed) + i for i in range(count)
            ]
        else:
            seeds = list(seed)
        mask = given.pop("reset_mask", None)
        for name, values in (("seed", seeds), ("reset_mask", mask)):
            if values is not None and len(values) != count:
                raise InvalidInputError(
                    f"{name} must have one value for each environment, of which there are {count}, "
                    f"got {len(values)}"
                )
        if mask is not None:
            mask = np.asarray(mask)
            if mask.dtype != np.bool_ or not mask.any():
                raise InvalidInputError(
                    f"reset_mask must be of dtype bool with at least one True, got {mask}"
                )
        arguments = [
            (seeds[share], given or None, None if mask is None else mask[share])
            for share in self._shares
        ]
        infos = _merged(self._ask("reset", arguments), self._shares, count)
        return self._seen(), infos

    def step(
        self, actions: Any
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One step of every environment; see `gymnasium.vector.SyncVectorEnv.step`."""
        each = list(iterate(self.action_space, actions))
        answers = self._ask("step", [each[share] for share in self._shares])
        rewards, terminated, truncated, infos = zip(*answers, strict=True)
        return (
            self._seen(),
            np.concatenate(rewards),
            np.concatenate(terminated),
            np.concatenate(truncated),
            _merged(infos, self._shares, self.num_envs),
        )

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What a method of every environment returns, or the value of an attribute."""
        answers = self._ask("call", [(name, args, kwargs)] * len(self._shares))
        return tuple(value for values in answers for value in values)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every environment: one value for all, or a list with one for each."""
        each = values if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise InvalidInputError(
                f"values must be one for each of {self.num_envs} environments, got {len(each)}"
            )
        self._ask("set_attr", [(name, list(each[share])) for share in self._shares])

    def render(self) -> tuple[Any, ...]:
        """The picture of every environment."""
        return self.call("render")

    def close_extras(self, **kwargs: Any) -> None:
        """End the worker processes."""
        for connection in getattr(self, "_connections", ()):
            with contextlib.suppress(OSError):
                connection.send(("close", None))
            connection.close()
        for process in getattr(self, "_processes", ()):
            process.join(_PATIENCE_S)
            if process.is_alive():
                process.kill()
                process.join()

    def _ask(self, request: str, arguments: Sequence[Any]) -> list[Any]:
        """What the workers answer to a request, with an argument for each."""
        if self.closed:
            raise InvalidInputError(f"{request}: this vector environment has been closed")
        # All are pickled before one is sent: after an error no worker has a request.
        messages = [ForkingPickler.dumps((request, argument)) for argument in arguments]
        for connection, message in zip(self._connections, messages, strict=True):
            with contextlib.suppress(OSError):  # it has ended: `_answers` says so
                connection.send_bytes(message)
        return self._answers()

    def _answers(self) -> list[Any]:
        """What the workers answer, in order."""
        values: list[Any] = []
        errors: list[Exception] = []
        for n, connection in enumerate(self._connections):
            try:
                is_well, value = connection.recv()
            except (EOFError, OSError):
                self._processes[n].join(_PATIENCE_S)
                share, code = self._shares[n], self._processes[n].exitcode
                is_well = False
                value = VectorWorkerError(
                    f"the worker process of environments {share.start} to {share.stop - 1} has "
                    f"ended with exit code {code}: close this vector environment, make another"
                )
            except Exception as error:  # what it sent cannot be read here; the next can
                is_well, value = False, error
            (values if is_well else errors).append(value)
        if errors:
            raise errors[0]
        return values

    def _seen(self) -> Any:
        """The observations in shared memory, or a copy of them."""
        if not self.copy:
            return self._observations
        out = create_empty_array(self.single_observation_space, self.num_envs, np.empty)
        _copy_into(out, self._observations, slice(None))
        return out


def _work(
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


def _merged(
    infos: Sequence[Mapping[str, Any]], shares: Sequence[slice], count: int
) -> dict[str, Any]:
    """The information of all shares, as one `SyncVectorEnv` would return it."""
    out: dict[str, Any] = {}
    for key in dict.fromkeys(key for info in infos for key in info):
        values = [info.get(key) for info in infos]
        first = next(value for value in values if value is not None)
        if isinstance(first, Mapping):
            out[key] = _merged([value or {} for value in values], shares, count)
            continue
        shape, empty = (count, *first.shape[1:]), None if first.dtype == object else 0
        out[key] = np.full(shape, empty, dtype=first.dtype)
        for share, value in zip(shares, values, strict=True):
            if value is not None:
                out[key][share] = value
    return out


def _portable(error: Exception) -> Exception:
    """The error itself where it can be sent, else one with its text."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return VectorWorkerError(f"{type(error).__name__}: {error}")
    return error
