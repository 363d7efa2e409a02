"""`WorkerVectorEnv`: environments in a few worker processes, several in each."""

from __future__ import annotations

import contextlib
import multiprocessing
import pickle
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from itertools import pairwise
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import (
    CloudpickleWrapper,
    batch_space,
    concatenate,
    create_shared_memory,
    iterate,
    read_from_shared_memory,
)
from numpy.typing import ArrayLike, NDArray

from pushplan.world import InvalidInputError, PushplanError, UnknownNameError
from pushplan.world.checks import integer

_Batch = tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]
"""Observations, rewards, terminated, truncated and information of some environments."""
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

    `step` waits for the slowest worker. `async_reset`, `recv` and `send`, named as in EnvPool (Weng
    et al. 2022), do not: the environments of one worker are a batch of its own, and take their next
    actions while the others are still busy.

    Worker processes are spawned: a script needs its ``if __name__ == "__main__":``.

    Args:
        env_fns: make the environments; all have the same spaces.
        workers: processes among which the environments are divided; no more than there are
            environments.
        copy: whether `step` and `reset` return observations of their own, which later steps do not
            change.
        autoreset_mode: as in `gymnasium.vector.SyncVectorEnv`.

    Attributes:
        workers: how many there are, and so how many batches `recv` has after `async_reset`.

    Raises:
        InvalidInputError: if there is no environment, or a number makes no sense.
        UnknownNameError: if the mode is unknown; the message lists the valid ones.
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
        self.workers = workers = integer("workers", workers, low=1, high=len(env_fns))
        modes = [known.value for known in AutoresetMode]
        if not isinstance(autoreset_mode, AutoresetMode) and autoreset_mode not in modes:
            raise UnknownNameError("autoreset_mode", autoreset_mode, modes)
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
        self._action_spaces = [
            batch_space(self.single_action_space, share.stop - share.start)
            for share in self._shares
        ]
        self._pending: list[int] = []  # workers that owe a batch, the one asked first at the front
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
            self._answers(range(workers))  # of `__init__`
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
        answers = self._ask("reset", self._reset_arguments(seed, options))
        observations, *_, infos = self._joined(answers)
        return observations, infos

    def _reset_arguments(
        self, seed: int | Sequence[int | None] | None, options: Mapping[str, Any] | None
    ) -> list[Any]:
        """What each worker needs to reset its environments."""
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
        return [
            (seeds[share], given or None, None if mask is None else mask[share])
            for share in self._shares
        ]

    def step(self, actions: Any) -> _Batch:
        """One step of every environment; see `gymnasium.vector.SyncVectorEnv.step`."""
        each = list(iterate(self.action_space, actions))
        return self._joined(self._ask("step", [each[share] for share in self._shares]))

    def _joined(self, answers: Sequence[Any]) -> _Batch:
        """The answers of all workers as `step` returns them."""
        *arrays, infos = zip(*answers, strict=True)
        rewards, terminated, truncated = map(np.concatenate, arrays)
        merged = _merged(infos, self._shares, self.num_envs)
        return self._seen(), rewards, terminated, truncated, merged

    def async_reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        """Begin new episodes as `reset` does, without waiting; `recv` returns the observations.

        Args:
            seed: as in `reset`.
            options: likewise.
        """
        self._check_idle("async_reset")
        arguments = self._reset_arguments(seed, options)
        self._request("reset", dict(enumerate(arguments)))
        self._pending = list(range(self.workers))

    def recv(
        self,
    ) -> _Batch:
        """What `step` returns, for the environments of the first worker that is ready.

        Which worker that is depends on the machine, an episode of an environment does not.

        Returns:
            As `step`; ``info["env_id"]`` (n,) int says which environments these are. After
            `async_reset` rewards are 0. With ``copy=False`` the observations are valid until the
            next `send` to the same environments.

        Raises:
            InvalidInputError: if no worker has been asked for anything.
        """
        self._check_open("recv")
        if not self._pending:
            raise InvalidInputError(
                "recv: no environment has been asked for anything: call async_reset() or send()"
            )
        ready = wait([self._connections[n] for n in self._pending])
        n = next(n for n in self._pending if self._connections[n] in ready)
        self._pending.remove(n)
        ((rewards, terminated, truncated, infos),) = self._answers([n])
        share = self._shares[n]
        infos = {**infos, "env_id": np.arange(share.start, share.stop)}
        return self._seen(share), rewards, terminated, truncated, infos

    def send(self, actions: Any, env_id: ArrayLike) -> None:
        """Step the environments of one worker, without waiting; `recv` returns what comes of it.

        Args:
            actions: one for each of them.
            env_id: (n,) which they are, as `recv` said.

        Raises:
            InvalidInputError: if these are not the environments of one worker, or those are still
                busy.
        """
        self._check_open("send")
        shares = [range(share.start, share.stop) for share in self._shares]
        wanted = np.asarray(env_id).tolist()
        n = next((n for n, share in enumerate(shares) if list(share) == wanted), None)
        if n is None:
            raise InvalidInputError(
                "env_id must name the environments of one worker, as info['env_id'] of recv does "
                f"({', '.join(f'{share[0]} to {share[-1]}' for share in shares)}), got {wanted}"
            )
        if n in self._pending:
            raise InvalidInputError(f"send: environments {wanted} are still busy: call recv()")
        each = list(iterate(self._action_spaces[n], actions))
        if len(each) != len(wanted):
            raise InvalidInputError(
                f"actions must be one for each of {len(wanted)} environments, got {len(each)}"
            )
        self._request("step", {n: each})
        self._pending.append(n)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What a method of every environment returns, or the value of an attribute."""
        answers = self._ask("call", [(name, args, kwargs)] * self.workers)
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
        self._check_idle(request)
        self._request(request, dict(enumerate(arguments)))
        return self._answers(range(self.workers))

    def _check_open(self, name: str) -> None:
        if self.closed:
            raise InvalidInputError(f"{name}: this vector environment has been closed")

    def _check_idle(self, name: str) -> None:
        self._check_open(name)
        if self._pending:
            raise InvalidInputError(
                f"{name}: environments of {len(self._pending)} workers are still busy: call recv() "
                f"{len(self._pending)} times first"
            )

    def _request(self, request: str, arguments: Mapping[int, Any]) -> None:
        """Send a request to some workers, with an argument for each."""
        # All are pickled before one is sent: after an error no worker has a request.
        messages = {n: ForkingPickler.dumps((request, each)) for n, each in arguments.items()}
        for n, message in messages.items():
            with contextlib.suppress(OSError):  # it has ended: `_answers` says so
                self._connections[n].send_bytes(message)

    def _answers(self, workers: Iterable[int]) -> list[Any]:
        """What some workers answer, in order."""
        values: list[Any] = []
        errors: list[Exception] = []
        for n in workers:
            try:
                is_well, value = self._connections[n].recv()
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

    def _seen(self, share: slice = slice(None)) -> Any:
        """The observations of a share in shared memory, or a copy of them."""
        seen = _part(self._observations, share)
        return deepcopy(seen) if self.copy else seen


def _part(values: Any, part: slice) -> Any:
    """A part of a batch, of any space, in the same memory."""
    if isinstance(values, Mapping):
        return {key: _part(value, part) for key, value in values.items()}
    if isinstance(values, tuple):
        return tuple(_part(value, part) for value in values)
    return values[part]


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
        everything = read_from_shared_memory(envs.single_observation_space, memory, count)
        shared = _part(everything, share)
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
                answer = ForkingPickler.dumps((True, _do(envs, request, argument, shared)))
            except Exception as error:
                answer = ForkingPickler.dumps((False, _portable(error)))
            connection.send_bytes(answer)
    envs.close()


def _do(envs: SyncVectorEnv, request: str, argument: Any, shared: Any) -> Any:
    """Carry out a request; observations go to their share of what all processes see."""
    if request == "set_attr":
        return envs.set_attr(*argument)
    if request == "call":
        name, args, kwargs = argument
        return envs.call(name, *args, **kwargs)
    if request == "step":
        observations, *answer = envs.step(argument)
    else:
        seeds, options, mask = argument
        still = np.zeros(envs.num_envs, dtype=np.bool_)
        answer = [np.zeros(envs.num_envs), still, still.copy(), {}]
        if mask is not None and not mask.any():
            return answer
        if mask is not None:
            options = {**(options or {}), "reset_mask": mask}
        observations, answer[-1] = envs.reset(seed=seeds, options=options)
    each = list(iterate(envs.observation_space, observations))
    concatenate(envs.single_observation_space, each, shared)
    return answer


def _portable(error: Exception) -> Exception:
    """The error itself where it can be sent, else one with its text."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return VectorWorkerError(f"{type(error).__name__}: {error}")
    return error
