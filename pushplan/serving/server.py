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

from pushplan.planners import make_policy
from pushplan.planners.kernel_warmup import warm_up_policy
from pushplan.runtime.held_actions import check_world_policy
from pushplan.serving.address import Address
from pushplan.serving.connection import Connection, LeftError, RefusedError
from pushplan.serving.limits import ServerLimits
from pushplan.serving.listener import Listener
from pushplan.serving.session import LOG, Session
from pushplan.world import InvalidInputError, Policy
from pushplan.world.checks import expect
from pushplan.world.errors import short

_GRACE_S = 5.0  # for how long planning calls may go on after the end of the server [s]
_LOOK_S = 0.1  # how often it looks whether clients have left that wait for an answer [s]
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
        self._lock = threading.Lock()
        self._present: dict[int, _Client] = {}
        self._refused = 0
        self._warm = self._over = False
        self._listener: Listener | None = None
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
        if self._listener is not None:
            raise InvalidInputError(f"the server at {self.address} serves already")
        self.warm_up()
        listening = self._address.listen()
        if self._address.path:
            self._inode = os.stat(self._address.path).st_ino
        else:
            port = int(listening.getsockname()[1])
            self._address = Address(host=self._address.host, port=port)
        self._over = False
        self._listener = Listener(listening, self._attend, self._look)
        self._thread = threading.Thread(
            target=self._listener.serve_forever,
            args=(_LOOK_S,),
            name="pushplan server",
            daemon=True,
        )
        self._thread.start()

    def close(self) -> bool:
        """Cut all clients off and end; planning calls have five seconds to return.

        Returns:
            Whether no thread is left.
        """
        if self._listener is None:
            return True
        assert self._thread is not None
        self._over = True
        self._listener.shutdown()
        self._thread.join()
        self._listener.server_close()
        self._listener = None
        if self._address.path:
            self._remove_socket()
        with self._lock:
            present = list(self._present.values())
        for client in present:
            client.session.abandon()
            client.connection.cut()
        end = time.monotonic() + _GRACE_S
        for client in present:
            client.thread.join(max(0.0, end - time.monotonic()))
            if client.thread.is_alive():
                LOG.warning("%s has not returned from its planning call", client.thread.name)
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

    def _remove_socket(self) -> None:
        """Remove the socket, unless another server has put its own there."""
        with suppress(OSError):
            if os.lstat(self._address.path).st_ino == self._inode:
                os.unlink(self._address.path)

    def _look(self) -> None:
        """End planning calls whose clients have left."""
        with self._lock:
            busy = [client for client in self._present.values() if client.busy]
        for client in busy:
            if client.connection.has_left():
                client.session.abandon()

    def _attend(self, connected: socket.socket) -> None:
        """Answer a client until it leaves; its place is free when its planning has ended."""
        connection = Connection(connected, self._limits)
        client = _Client(connection, Session(self._policy, self._label, self._limits))
        with self._lock:
            number = next(self._numbers)
            full, over = len(self._present) >= self._limits.clients, self._over
            if not (full or over):
                self._present[number] = client
        if over:
            return
        if full:
            limit = self._limits.clients
            self._send_away(connection, f"the server has {limit} clients, which is its limit")
            return
        client.thread.name = f"pushplan client {number}"
        LOG.info("client %d has come", number)
        why, refusal = "closed", ""
        try:
            client.converse()
        except LeftError:
            why = "left"
        except RefusedError as error:
            why = refusal = str(error)
        finally:
            if not refusal:
                connected.close()
            client.session.close()
            with self._lock:
                del self._present[number]
            LOG.info("client %d has gone: %s", number, why)
            if refusal:  # its place is free already
                self._send_away(connection, refusal)
                connected.close()

    def _send_away(self, connection: Connection, why: str) -> None:
        """Tell a client that holds no place (any more) why."""
        with self._lock:
            if self._refused >= _MOST_REFUSED:
                return
            self._refused += 1
        connection.refuse(why)
        with self._lock:
            self._refused -= 1


class _Client:
    """A client that is there, and the thread that answers it, which makes this."""

    def __init__(self, connection: Connection, session: Session) -> None:
        self.connection, self.session = connection, session
        self.thread = threading.current_thread()
        self.busy = False

    def converse(self) -> None:
        """Answer message after message until the client says close."""
        last = False
        while not last:
            body = self.connection.read()
            self.busy = True
            answer = self.session.answer(body)
            self.busy = False
            if self.session.abandoned:  # cut short, planning gives an action that nobody asked for
                raise RefusedError(
                    "planning was ended: the client sends no more, or the server ends"
                )
            if self.session.greeted:
                self.connection.greeted()
            self.connection.write(answer.data)
            last = answer.last
