"""`PolicyServer`: one policy for any number of programs, each with an episode of its own."""

from __future__ import annotations

import asyncio
import itertools
import os
import signal
import socket
import threading
from collections.abc import Callable
from contextlib import suppress

from pushplan.planners import make_policy
from pushplan.planners.kernel_warmup import warm_up_policy
from pushplan.runtime.held_actions import check_world_policy
from pushplan.serving.address import Address
from pushplan.serving.connection import Connection, LeftError, RefusedError
from pushplan.serving.limits import ServerLimits
from pushplan.serving.session import LOG, Session
from pushplan.serving.worker import SessionWorker
from pushplan.world import InvalidInputError, Policy, PushplanError
from pushplan.world.checks import expect
from pushplan.world.errors import describe, short

_GRACE_S = 5.0  # for how long planning calls may go on after the end of the server [s]
_MOST_REFUSED = 32  # clients that are told at the same time that there are too many


class PolicyServer:
    """Serves a policy at a socket, by the protocol of docs/serve.md.

    Each client has a policy, an episode and a thread of its own. What a client sends is checked; a
    wrong message gets an error, and no other client notices. It is no sandbox: clients share the
    processor, and whoever can reach the socket may use it.

    Args:
        policy: the name of one of `pushplan.planners.policy_names()`, or a callable that makes a
            policy which acts by the world alone.
        address: ``"unix:PATH"`` or ``"tcp:127.0.0.1:PORT"``; port 0 takes a free one.
        allow_remote: whether other machines may reach the address. Nothing is encrypted and nobody
            is asked for a password.
        limits: what clients may take.
        label: what clients are told that the policy is called.

    Raises:
        InvalidInputError: if the address or the policy cannot be served.
        UnknownNameError: if there is no policy of that name.

    Example:
        >>> with PolicyServer("push-aware", "unix:/run/user/1000/push.sock") as server:
        ...     print(server.address)  # doctest: +SKIP
    """

    def __init__(
        self,
        policy: str | Callable[[], Policy],
        address: str,
        *,
        allow_remote: bool = False,
        limits: ServerLimits | None = None,
        label: str | None = None,
    ) -> None:
        if isinstance(policy, str):
            name = policy
            label, policy = label or name, lambda: make_policy(name)
        if not callable(policy):
            raise InvalidInputError(
                f"policy must be a name or a callable that makes one, got {short(policy)}"
            )
        self._make_policy: Callable[[], Policy] = policy
        self._label = label or str(getattr(policy, "__name__", type(policy).__name__))
        self._address = Address.parse(address, allow_remote=allow_remote)
        self._limits = expect("limits", limits or ServerLimits(), ServerLimits)
        check_world_policy(self._policy())
        self._numbers = itertools.count(1)
        self._present: dict[int, SessionWorker] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._refused = 0
        self._warm = False
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._over: asyncio.Event | None = None
        self._socket: socket.socket | None = None

    def _policy(self) -> Policy:
        policy = self._make_policy()
        return expect("what is served", policy, Policy)  # type: ignore[type-abstract]

    @property
    def address(self) -> str:
        """Where it listens, as clients take it; with the port that was found for port 0."""
        return str(self._address)

    @property
    def clients(self) -> int:
        """How many clients there are, with those that have left while a planning call runs."""
        return len(self._present)

    def __enter__(self) -> PolicyServer:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def warm_up(self) -> None:
        """Load all kernels, once: that takes seconds, and minutes after an installation."""
        if not self._warm:
            warm_up_policy(self._policy())
            self._warm = True

    def start(self) -> None:
        """Load all kernels, and serve in a thread until `close`.

        Raises:
            InvalidInputError: if it serves already, or cannot listen at the address.
        """
        self._open()
        listening = threading.Event()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._serve(listening.set)),
            name="pushplan server",
            daemon=True,
        )
        self._thread.start()
        listening.wait()

    def close(self) -> bool:
        """Send all clients away and end; a planning call has five seconds to return.

        Returns:
            Whether no thread is left.
        """
        if self._thread is None:
            return True
        if self._loop is not None and self._over is not None:
            with suppress(RuntimeError):  # it has ended already
                self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join()
        self._thread = None
        return not self._present

    def serve_forever(self, ready: Callable[[], object] = lambda: None) -> bool:
        """Load all kernels, and serve in this thread, the main one, until SIGINT or SIGTERM.

        Args:
            ready: called when clients can connect.

        Returns:
            Whether no thread is left.

        Raises:
            InvalidInputError: as `start`.
        """
        self._open()
        asyncio.run(self._serve(ready, signals=(signal.SIGINT, signal.SIGTERM)))
        return not self._present

    def _open(self) -> None:
        if self._socket is not None:
            raise InvalidInputError(f"the server at {self.address} serves already")
        self.warm_up()
        self._socket = self._address.listen()
        if not self._address.path:
            self._address = Address(
                host=self._address.host, port=int(self._socket.getsockname()[1])
            )

    async def _serve(
        self, ready: Callable[[], object], signals: tuple[signal.Signals, ...] = ()
    ) -> None:
        assert self._socket is not None
        self._loop, self._over = asyncio.get_running_loop(), asyncio.Event()
        for one in signals:
            self._loop.add_signal_handler(one, self._over.set)
        inode = os.stat(self._address.path).st_ino if self._address.path else 0
        make = asyncio.start_unix_server if self._address.path else asyncio.start_server
        server = await make(self._welcome, sock=self._socket)
        try:
            ready()
            await self._over.wait()
        finally:
            server.close()
            if self._address.path:
                self._remove(inode)
            for task in self._tasks:
                task.cancel()
            if self._tasks:
                await asyncio.wait(self._tasks, timeout=_GRACE_S)
            for worker in self._present.values():
                LOG.warning("%s has not returned from its planning call", worker.thread.name)
            self._socket = None

    def _remove(self, inode: int) -> None:
        """Remove the socket, unless another server has put its own there."""
        with suppress(OSError):
            if os.lstat(self._address.path).st_ino == inode:
                os.unlink(self._address.path)

    async def _welcome(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        connection = Connection(reader, writer, self._limits)
        try:
            if len(self._present) < self._limits.clients:
                await self._attend(connection, next(self._numbers))
            elif self._refused < _MOST_REFUSED:
                await self._send_away(connection)
        except asyncio.CancelledError:
            pass  # the server ends
        finally:
            connection.close()
            self._tasks.discard(task)

    async def _send_away(self, connection: Connection) -> None:
        most = self._limits.clients
        self._refused += 1
        try:
            await connection.refuse(f"the server has {most} clients, which is its limit")
        finally:
            self._refused -= 1

    async def _attend(self, connection: Connection, number: int) -> None:
        """Answer a client; its place is free when its thread has ended."""
        session = Session(self._policy, self._label, self._limits)
        worker = self._present[number] = SessionWorker(session, number)
        LOG.info("client %d has come", number)
        why = "closed"
        try:
            await connection.converse(worker)
        except LeftError:
            why = "left"
        except RefusedError as error:
            why = str(error)
            await connection.refuse(why)
        except asyncio.CancelledError:
            why = "the server ends"
            await connection.refuse(why)
            raise
        except PushplanError as error:
            why = describe(error)
        finally:
            connection.close()
            LOG.info("client %d has gone: %s", number, why)
            await worker.end()
            del self._present[number]
