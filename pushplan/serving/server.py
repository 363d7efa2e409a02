"""`PolicyServer`: one policy for any number of programs, each with an episode of its own."""

from __future__ import annotations

import itertools
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

from pushplan.errors import short
from pushplan.planners import make_policy
from pushplan.planners.kernel_warmup import warm_up_policy
from pushplan.runtime.held_actions import check_world_policy
from pushplan.serving.address import Address
from pushplan.serving.connection import Connection, RefusedError, ServerLimits
from pushplan.serving.session import LOG, Session
from pushplan.world import InvalidInputError, Policy
from pushplan.world.checks import expect

_GRACE_S = 5.0  # for how long planning calls may go on after the end of the server [s]
_LOOK_S = 0.1  # how often it looks whether clients have left that wait for an answer [s]
_PAUSE_S = 0.1  # after a connection that could not be accepted [s]
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_MOST_REFUSED = 32  # clients that are told at the same time why they are sent away


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
        self._present: dict[threading.Thread, tuple[Connection, Session]] = {}
        self._places = threading.Semaphore(self._limits.clients)
        self._refusals = threading.Semaphore(_MOST_REFUSED)
        self._warm = self._over = False
        self._thread: threading.Thread | None = None
        self._inode = 0

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
        """Load all kernels, and serve in threads until `close`.

        Raises:
            InvalidInputError: if it serves already, or cannot listen at the address.
        """
        if self._thread is not None:
            raise InvalidInputError(f"the server at {self.address} serves already")
        self.warm_up()
        listener = self._address.listen()
        if self._address.path:
            self._inode = os.stat(self._address.path).st_ino
        else:
            self._address = replace(self._address, port=int(listener.getsockname()[1]))
        self._over = False
        self._thread = threading.Thread(
            target=self._accept, args=(listener,), name="pushplan server", daemon=True
        )
        self._thread.start()

    def close(self) -> bool:
        """Cut all clients off and end; planning calls have five seconds to return.

        Returns:
            Whether no thread is left.
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
        present = self._present.copy()
        for connection, session in present.values():
            session.abandon()
            connection.cut()
        end = time.monotonic() + _GRACE_S
        for thread in present:
            thread.join(max(0.0, end - time.monotonic()))
            if thread.is_alive():
                LOG.warning("%s has not returned from its planning call", thread.name)
        return not self._present

    def serve_forever(self, ready: Callable[[], object] = lambda: None) -> bool:
        """Load all kernels, and serve until SIGINT, SIGTERM or SIGHUP; called by the main thread.

        Args:
            ready: called when clients can connect.

        Returns:
            Whether no thread is left.

        Raises:
            InvalidInputError: as `start`.
        """
        over = threading.Event()
        self.warm_up()
        before = {
            one: signal.signal(one, lambda *_: over.set())
            for one in _SIGNALS
            if one is not signal.SIGHUP or signal.getsignal(one) is not signal.SIG_IGN  # nohup
        }
        try:
            self.start()
            ready()
            over.wait()
        finally:
            ended = self.close()
            for one, handler in before.items():
                signal.signal(one, handler)
        return ended

    def _accept(self, listener: socket.socket) -> None:
        """Give each connection a thread, and look after the clients meanwhile."""
        listener.settimeout(_LOOK_S)
        with listener:
            while not self._over:
                self._look()
                try:
                    connected, _ = listener.accept()
                    client = (connected, Connection(connected, self._limits))
                    threading.Thread(target=self._attend, args=client, daemon=True).start()
                except TimeoutError:
                    continue
                except (OSError, RuntimeError):  # without file handles, or threads
                    time.sleep(_PAUSE_S)

    def _look(self) -> None:
        """End planning calls whose clients have left."""
        for connection, session in self._present.copy().values():
            if session.busy and connection.has_left():
                session.abandon()

    def _attend(self, connected: socket.socket, connection: Connection) -> None:
        """Answer a client in its thread; who is sent away is told why when its place is free."""
        with connected:
            refusal = f"the server has {self._limits.clients} clients, which is its limit"
            if self._places.acquire(blocking=False):
                thread = threading.current_thread()
                session = Session(self._policy, self._label, self._limits)
                self._present[thread] = (connection, session)
                try:
                    refusal = self._serve(thread, connection, session)
                finally:
                    del self._present[thread]
                    self._places.release()
            if refusal and self._refusals.acquire(blocking=False):
                connection.refuse(refusal)
                self._refusals.release()

    def _serve(self, thread: threading.Thread, connection: Connection, session: Session) -> str:
        """Answer message after message, then end planning; why it is sent away, if it is."""
        number = next(self._numbers)
        thread.name = f"pushplan client {number}"
        LOG.info("client %d has come", number)
        why, refusal, last = "closed", "", False
        try:
            while not (last or self._over):
                data, last = session.answer(connection.read())
                if session.abandoned:  # cut short, planning gives an action that nobody asked for
                    raise RefusedError(
                        "planning was ended: the client sends no more, or the server ends"
                    )
                if session.greeted:
                    connection.greeted()
                connection.write(data)
        except OSError:
            why = "left"
        except RefusedError as error:
            why = refusal = str(error)
        if not refusal:
            connection.cut()
        session.close()
        LOG.info("client %d has gone: %s", number, why)
        return refusal
