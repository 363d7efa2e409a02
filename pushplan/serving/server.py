"""`PolicyServer`: one policy for any number of programs, each with an episode of its own."""

from __future__ import annotations

import asyncio
import itertools
import os
import signal
import socket
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TypeVar

from pushplan.errors import short
from pushplan.planners import make_policy
from pushplan.runtime.held_actions import check_world_policy
from pushplan.serving.address import Address
from pushplan.serving.connection import Connection, RefusedError, ServerLimits
from pushplan.serving.session import LOG, Session
from pushplan.world import InvalidInputError, Policy
from pushplan.world.checks import expect

_GRACE_S = 5.0  # for how long planning calls may go on after the end of the server [s]
_LOOK_S = 0.1  # interval of the checks that clients who wait for an answer are still there [s]
_Result = TypeVar("_Result")
_PAUSE_S = 0.01  # between two looks whether all clients have gone [s]
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_MOST_REFUSED = 32  # clients that are told at the same time why they are sent away


async def in_thread(function: Callable[[], _Result], name: str) -> _Result:
    """Call a function in a new thread while the loop goes on, and return its result.

    The thread is a daemon, which those of `concurrent.futures` are not: a policy that hangs does
    not keep the process from ending.
    """
    future: Future[_Result] = Future()
    future.set_running_or_notify_cancel()  # the end of the server does not cancel it
    thread = threading.Thread(target=lambda: future.set_result(function()), name=name, daemon=True)
    thread.start()
    return await asyncio.wrap_future(future)


class PolicyServer:
    """Serves a policy at a socket, by the protocol of docs/serve.md.

    Each client has a policy and an episode of its own, whose planning runs in threads. What a
    client sends is checked; a wrong message gets an error, and no other client notices. It is no
    sandbox: clients share the processor, and whoever can reach the socket may use it.

    Args:
        policy: the name of one of `pushplan.planners.policy_names()`, or a callable that makes a
            policy which acts by the world alone.
        address: ``"unix:PATH"`` or ``"tcp:127.0.0.1:PORT"``; port 0 takes a free one.
        allow_remote: let other machines reach the address. Nothing is encrypted and nobody is asked
            for a password.
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
            label = label or name
            policy = partial(make_policy, name)
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
        self._present: dict[int, tuple[Connection, Session]] = {}
        self._refused = 0  # clients that are being told why
        self._over = False
        self._ended = True
        self._thread: threading.Thread | None = None
        self._inode = 0

    def _policy(self) -> Policy:
        policy = self._make_policy()
        return expect("what is served", policy, Policy)  # type: ignore[type-abstract]

    @property
    def address(self) -> str:
        """Address at which it listens, as clients take it; with the port found for port 0."""
        return str(self._address)

    @property
    def clients(self) -> int:
        """Number of clients, with those that have left while a planning call runs."""
        return len(self._present)

    def __enter__(self) -> PolicyServer:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self) -> None:
        """Serve in threads until `close`.

        Raises:
            InvalidInputError: if it serves already, or cannot listen at the address.
        """
        if self._thread is not None:
            raise InvalidInputError(f"the server at {self.address} serves already")
        listener = self._address.listen()
        if self._address.path:
            self._inode = os.stat(self._address.path).st_ino
        else:
            self._address = replace(self._address, port=int(listener.getsockname()[1]))
        self._over = False
        serving = self._accept(listener)
        self._thread = threading.Thread(
            target=asyncio.run, args=(serving,), name="pushplan server", daemon=True
        )
        self._thread.start()

    def close(self) -> bool:
        """Cut all clients off and end; planning calls have five seconds to return.

        Returns:
            True if no thread is left.
        """
        if self._thread is None:
            return True
        self._over = True
        self._thread.join()
        self._thread = None
        if self._address.path:
            with suppress(OSError):  # another server may have put its own socket there
                if os.lstat(self._address.path).st_ino == self._inode:
                    os.unlink(self._address.path)
        return self._ended

    def serve_forever(self, ready: Callable[[], object] = lambda: None) -> bool:
        """Serve until SIGINT, SIGTERM or SIGHUP; called by the main thread.

        Args:
            ready: called when clients can connect.

        Returns:
            True if no thread is left.

        Raises:
            InvalidInputError: as `start`.
        """
        over = threading.Event()
        before = {
            one: signal.signal(one, lambda *_: over.set())
            for one in _SIGNALS
            if one is not signal.SIGHUP or signal.getsignal(one) is not signal.SIG_IGN  # nohup
        }
        try:
            self.start()
            ready()
            while not over.wait(_LOOK_S):  # a signal does not always interrupt a longer wait
                pass
        finally:
            ended = self.close()
            for one, handler in before.items():
                signal.signal(one, handler)
        return ended

    async def _accept(self, listener: socket.socket) -> None:
        """Attend to every client that connects, until the end of the server."""
        server = await asyncio.start_server(self._attend, sock=listener)
        while not self._over:
            self._look()
            await asyncio.sleep(_LOOK_S)
        server.close()
        for connection, session in self._present.values():
            session.abandon()
            connection.cut()
        with suppress(TimeoutError):
            async with asyncio.timeout(_GRACE_S):
                while self._present:
                    await asyncio.sleep(_PAUSE_S)
        self._ended = not self._present
        for number in self._present:
            LOG.warning("client %d: the policy has not returned from its planning call", number)

    def _look(self) -> None:
        """End planning calls whose clients have left."""
        for connection, session in self._present.values():
            if session.busy and connection.has_left():
                session.abandon()

    async def _attend(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer a client; who is sent away is told why when its place is free."""
        connection = Connection(reader, writer, self._limits)
        refusal = f"the server has {self._limits.clients} clients, which is its limit"
        if self.clients < self._limits.clients:
            number = next(self._numbers)
            session = Session(self._policy, self._label, self._limits)
            self._present[number] = (connection, session)
            try:
                refusal = await self._serve(number, connection, session)
            except asyncio.CancelledError:  # the server has ended before the policy returned
                return
            finally:
                del self._present[number]
        if refusal and self._refused < _MOST_REFUSED:
            self._refused += 1
            await connection.refuse(refusal)
            self._refused -= 1
        connection.cut()

    async def _serve(self, number: int, connection: Connection, session: Session) -> str:
        """Answer message after message, then end planning; why it is sent away, if it is."""
        thread = f"pushplan client {number}"
        LOG.info("client %d has come", number)
        why = "closed"
        refusal = ""
        last = False
        try:
            while not last:
                body = await connection.read()
                if session.is_quick(body):  # a change of threads takes longer than the answer
                    answer = session.answer(body)
                else:
                    answer = await in_thread(partial(session.answer, body), thread)
                if session.abandoned:  # cut short, planning gives an action that nobody asked for
                    raise RefusedError(
                        "planning was ended: the client sends no more, or the server ends"
                    )
                if session.greeted:
                    connection.greeted()
                await connection.write(answer.data)
                last = answer.last
        except OSError:
            why = "left"
        except RefusedError as error:
            why = refusal = str(error)
        if not refusal:
            connection.cut()
        await in_thread(session.close, thread)
        LOG.info("client %d has gone: %s", number, why)
        return refusal
