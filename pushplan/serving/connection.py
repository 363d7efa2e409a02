"""`Connection`: the bytes of one client, within limits of size and time."""

from __future__ import annotations

import math
import select
import socket
import time
from contextlib import suppress

from pushplan.serving import messages
from pushplan.serving.limits import ServerLimits
from pushplan.world import PushplanError

_PIECE = 65536  # most bytes that are read at once
_LINGER_S = 0.5  # for how long a client that is sent away may still send, and read why [s]
_GONE = select.POLLHUP | select.POLLERR
_SENDS_NO_MORE = getattr(select, "POLLRDHUP", 0)


class LeftError(Exception):
    """The client has closed the connection, or does not read what it is sent."""


class RefusedError(PushplanError):
    """The client broke a limit, after which its bytes make no sense any more."""


class Connection:
    """Reads messages and writes replies; one thread does both.

    Args:
        client: the connected socket.
        limits: of sizes and times.
    """

    def __init__(self, client: socket.socket, limits: ServerLimits) -> None:
        self._socket, self._limits = client, limits
        self._buffer = bytearray()
        self._hello_by = time.monotonic() + limits.message_s
        if client.family != socket.AF_UNIX:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def greeted(self) -> None:
        """Lift the limit of time that a client has until its hello is accepted."""
        self._hello_by = math.inf

    def read(self) -> bytes:
        """The body of the next message.

        Raises:
            LeftError: if the client has left.
            RefusedError: if the message is too long, too slow or cut off, or none comes.
        """
        idle = self._limits.idle_s
        if not self._buffer:
            self._wait(idle, f"no message came for {idle:g} s, which is the limit")
        end = time.monotonic() + self._limits.message_s
        self._fill(messages.LENGTH.size, end)
        (length,) = messages.LENGTH.unpack_from(self._buffer)
        most = self._limits.message_bytes
        if length > most:
            raise RefusedError(
                f"a message may have {most:,} bytes, the length before this one says {length:,}"
            )
        whole = messages.LENGTH.size + length
        self._fill(whole, end)
        body = bytes(self._buffer[messages.LENGTH.size : whole])
        del self._buffer[:whole]
        return body

    def _fill(self, count: int, end: float) -> None:
        """Read until so many bytes are there; until a time of the monotonic clock [s]."""
        limit = self._limits.message_s
        while len(self._buffer) < count:
            left = end - time.monotonic()
            self._wait(left, f"a message must be whole {limit:g} s after its first byte")

    def _wait(self, seconds: float, late: str) -> None:
        """Read what comes within a time [s], or refuse the client with these words."""
        left = self._hello_by - time.monotonic()
        if left < seconds:
            seconds = left
            late = f"no valid hello came within {self._limits.message_s:g} s of connecting"
        if not self._receive(seconds):
            raise RefusedError(late)

    def _receive(self, seconds: float) -> bool:
        """Read what comes within a time; whether anything did."""
        if seconds <= 0.0:
            return False
        try:
            self._socket.settimeout(seconds)
            piece = self._socket.recv(_PIECE)
        except TimeoutError:
            return False
        except OSError:
            raise LeftError from None
        if not piece and self._buffer:
            raise RefusedError("the connection was closed amid a message")
        if not piece:
            raise LeftError
        self._buffer += piece
        return True

    def write(self, data: bytes) -> None:
        """Send a reply.

        Raises:
            LeftError: if the client has left, or has not read it within the time for a message.
        """
        try:
            self._socket.settimeout(self._limits.message_s)
            self._socket.sendall(data)
        except OSError:
            raise LeftError from None

    def refuse(self, message: str) -> None:
        """Send a last error, and give the client a moment to read it."""
        end = time.monotonic() + _LINGER_S
        self._buffer.clear()
        with suppress(OSError, LeftError):
            self._socket.settimeout(_LINGER_S)
            self._socket.sendall(messages.error(message, closing=True))
            self._socket.shutdown(socket.SHUT_WR)
            while self._receive(end - time.monotonic()):  # else a reset takes the error along
                self._buffer.clear()

    def has_left(self) -> bool:
        """True if the client has closed its side; from any thread, at once.

        A client that only sends no more may still read. A Unix socket tells that from one that has
        left; a TCP socket does not, and such a client counts as having left.
        """
        poll = select.poll()
        tcp = self._socket.family != socket.AF_UNIX
        try:
            poll.register(self._socket, _GONE | _SENDS_NO_MORE if tcp else _GONE)
            return bool(poll.poll(0))
        except (OSError, ValueError):  # closed by ourselves
            return True

    def cut(self) -> None:
        """End it, from any thread: what reads or writes gives up."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
