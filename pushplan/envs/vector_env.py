"""`WorkerVectorEnv`: environments in a few worker processes, several in each."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import pairwise
from multiprocessing.reduction import ForkingPickler
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import (
    CloudpickleWrapper,
    batch_space,
    create_shared_memory,
    read_from_shared_memory,
)
from numpy.typing import ArrayLike, NDArray

from pushplan.errors import describe, refuse_copy
from pushplan.world import InvalidInputError, PushplanError, UnknownNameError
from pushplan.world.checks import integer

_GUARD = "put the call under `if __name__ == '__main__':`, which worker processes leave out"
_Batch = tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]
"""Observations, rewards, terminated, truncated and information of some environments."""


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

    Worker processes are spawned: a script needs its ``if __name__ == "__main__":``. Without it
    they end with a line on standard error, and this class raises a `VectorWorkerError`.

    Args:
        env_fns: make the environments; all have the same spaces, whose elements are arrays.
        workers: processes among which the environments are divided; no more than there are
            environments.
        copy: `step` and `reset` return observations of their own, which later steps do not change.
        autoreset_mode: as in `gymnasium.vector.SyncVectorEnv`.

    Attributes:
        workers: how many there are, and so how many batches `recv` has after `async_reset`.

    Raises:
        InvalidInputError: if there is no environment, or a number makes no sense.
        UnknownNameError: if the mode is unknown; the message lists the valid ones.
        VectorWorkerError: if a worker process ends before its environments are made.
    """

    __reduce_ex__ = refuse_copy

    def __init__(
        self,
        env_fns: Sequence[Callable[[], Any]],
        *,
        workers: int,
        copy: bool = True,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            sys.exit(
                f"a worker process made a vector environment as it imported the script: {_GUARD}"
            )
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
        self.num_envs = len(env_fns)
        self.copy = copy
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        context: Any = multiprocessing.get_context("spawn")
        memory = create_shared_memory(self.single_observation_space, self.num_envs, context)
        self._observations: Any = read_from_shared_memory(
            self.single_observation_space, memory, self.num_envs
        )
        ends = [n * self.num_envs // workers for n in range(workers + 1)]
        self._shares = [slice(first, end) for first, end in pairwise(ends)]
        self._pending: dict[Future[Any], int] = {}  # answers of workers due, in order of requests
        self._pools = [
            ProcessPoolExecutor(
                1,
                context,
                _keep,
                (list(map(CloudpickleWrapper, env_fns[share])), mode, memory, self.num_envs, share),
            )
            for share in self._shares
        ]
        try:
            self._ask(_make, [()] * workers)
        except BaseException as error:
            self.close()
            if isinstance(error, VectorWorkerError):
                raise VectorWorkerError(
                    f"a worker process ended before it had its environments: in a script, {_GUARD}"
                ) from None
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
        answers = self._ask(_reset, self._reset_arguments(seed, options))
        observations, *_, infos = self._joined(answers)
        return observations, infos

    def _reset_arguments(
        self, seed: int | Sequence[int | None] | None, options: Mapping[str, Any] | None
    ) -> list[Any]:
        """Return the arguments with which each worker resets its environments."""
        count = self.num_envs
        given = dict(options or {})
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
        each = np.asarray(actions)
        return self._joined(self._ask(_step, [(each[share],) for share in self._shares]))

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
        for n, each in enumerate(self._reset_arguments(seed, options)):
            self._pending[self._pools[n].submit(_reset, *each)] = n

    def recv(
        self,
    ) -> _Batch:
        """Return the result of `step` for the environments of the first worker that is ready.

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
        ready, _ = wait(self._pending, return_when=FIRST_COMPLETED)
        future = next(future for future in self._pending if future in ready)
        n = self._pending.pop(future)
        rewards, terminated, truncated, infos = self._answer(future, n)
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
        if n in self._pending.values():
            raise InvalidInputError(f"send: environments {wanted} are still busy: call recv()")
        if len(actions) != len(wanted):
            raise InvalidInputError(
                f"actions must be one for each of {len(wanted)} environments, got {len(actions)}"
            )
        self._pending[self._pools[n].submit(_step, np.asarray(actions))] = n

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every environment, or read an attribute, and return the answers."""
        answers = self._ask(_call, [(name, args, kwargs)] * self.workers)
        return tuple(value for values in answers for value in values)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every environment: one value for all, or a list with one for each."""
        each = values
        if not isinstance(values, list | tuple):
            each = [values] * self.num_envs
        if len(each) != self.num_envs:
            raise InvalidInputError(
                f"values must be one for each of {self.num_envs} environments, got {len(each)}"
            )
        self._ask(_set_attr, [(name, list(each[share])) for share in self._shares])

    def render(self) -> tuple[Any, ...]:
        """The picture of every environment."""
        return self.call("render")

    def close_extras(self, **kwargs: Any) -> None:
        """End the worker processes."""
        for pool in getattr(self, "_pools", ()):
            pool.shutdown(cancel_futures=True)

    def _ask(self, function: Callable[..., Any], arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
        """The results of a function in each worker, with arguments for each."""
        name = function.__name__.strip("_")
        self._check_idle(name)
        try:
            ForkingPickler.dumps(arguments)
        except Exception as error:  # classes of a user raise errors of many kinds
            raise InvalidInputError(
                f"{name}: a value cannot be sent to a worker process: {describe(error)}"
            ) from error
        futures = [self._pools[n].submit(function, *each) for n, each in enumerate(arguments)]
        wait(futures)  # all of them: after an error no worker is busy
        return [self._answer(future, n) for n, future in enumerate(futures)]

    def _answer(self, future: Future[Any], n: int) -> Any:
        try:
            return future.result()
        except BrokenProcessPool:
            share = self._shares[n]
            raise VectorWorkerError(
                f"the worker process of environments {share.start} to {share.stop - 1} has "
                "ended: close this vector environment, make another"
            ) from None

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

    def _seen(self, share: slice = slice(None)) -> Any:
        """The observations of a share in shared memory, or a copy of them."""
        seen = self._observations[share]
        return seen.copy() if self.copy else seen


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
        shape = (count, *first.shape[1:])
        empty = None if first.dtype == object else 0
        out[key] = np.full(shape, empty, dtype=first.dtype)
        for share, value in zip(shares, values, strict=True):
            if value is not None:
                out[key][share] = value
    return out


_kept: list[Any] = []
"""In a worker process: what its environments are made of."""


def _keep(*kept: Any) -> None:
    _kept[:] = kept


def _make() -> None:
    """Make the environments of this process; they and their observations are then what is kept."""
    env_fns, mode, memory, count, share = _kept
    envs = SyncVectorEnv(env_fns, copy=False, autoreset_mode=mode)
    _keep(envs, read_from_shared_memory(envs.single_observation_space, memory, count)[share])


def _reset(seeds: list[int | None], options: dict[str, Any] | None, mask: Any) -> list[Any]:
    """Reset the environments, or those of a mask; the answer is that of a step."""
    envs, shared = _kept
    still = np.zeros(envs.num_envs, dtype=np.bool_)
    infos: dict[str, Any] = {}
    if mask is None or mask.any():
        if mask is not None:
            options = {**(options or {}), "reset_mask": mask}
        shared[:], infos = envs.reset(seed=seeds, options=options)
    return [np.zeros(envs.num_envs), still, still.copy(), infos]


def _step(actions: Any) -> list[Any]:
    envs, shared = _kept
    observations, *answer = envs.step(actions)
    shared[:] = observations
    return list(answer)


def _call(name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    return _kept[0].call(name, *args, **kwargs)


def _set_attr(name: str, values: list[Any]) -> None:
    _kept[0].set_attr(name, values)
