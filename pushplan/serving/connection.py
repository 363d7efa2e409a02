"""`Connection`: the bytes of one client, within limits of size and time."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress

from pushplan.serving import messages
from pushplan.serving.limits import ServerLimits
from pushplan.world import PushplanError

_PIECE = 65536  # most bytes that are read at once
_LINGER_S = 0.5  # for how long a client that is sent away may still send, and read why [s]
_GONE = getattr(select, "POLLRDHUP", 0) | select.POLLHUP | select.POLLERR


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
        if client.family != socket.AF_UNIX:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, patience: float) -> bytes:
        """The body of the next message.

        Args:
            patience: how long its first byte may take [s]; the rest has a limit of its own.

        Raises:
            LeftError: if the client has left.
            RefusedError: if the message is too long or too slow, or none comes.
        """
        if not self._buffer and not self._receive(patience):
            raise RefusedError(f"no message came for {patience:g} s, which is the limit")
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
        while len(self._buffer) < count:
            if not self._receive(end - time.monotonic()):
                limit = self._limits.message_s
                raise RefusedError(f"a message must be whole {limit:g} s after its first byte")

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
        with suppress(OSError, LeftError):
            self._socket.settimeout(_LINGER_S)
            self._socket.sendall(messages.error(message, closing=True))
            self._socket.shutdown(socket.SHUT_WR)
            while self._receive(end - time.monotonic()):  # else a reset takes the error along
                self._buffer.clear()

    def has_left(self) -> bool:
        """Whether the client has closed its side; from any thread, at once."""
        poll = select.poll()
        try:
            poll.register(self._socket, _GONE)
            return bool(poll.poll(0))
        except (OSError, ValueError):  # closed by ourselves
            return True

    def cut(self) -> None:
        """End it, from any thread: what reads or writes gives up."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
