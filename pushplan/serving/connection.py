"""`Connection`: the bytes of one client, within limits of size and time."""

from __future__ import annotations

import math
import select
import socket
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pushplan.serving import messages
from pushplan.world import PushplanError
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat

_PIECE = 65536  # most bytes that are read at once
_LINGER_S = 0.5  # for how long a client that is sent away may still send, and read why [s]
_GONE = select.POLLHUP | select.POLLERR
_SENDS_NO_MORE = getattr(select, "POLLRDHUP", 0)


@dataclass(frozen=True)
class ServerLimits(CheckedFields):
    """What clients may take; whoever wants more gets an error message and is sent away.

    Args:
        clients: how many there may be at once. One that has left counts until its planning call has
            returned.
        message_bytes: greatest length of a message; of a longer one nothing is read.
        message_s: time for a whole message, from its first byte to its last, in either direction,
            and from connecting to the end of the hello [s].
        idle_s: time in which a client may be silent that waits for no reply [s].
    """

    field_prefix: ClassVar[str] = "server limit "

    clients: Annotated[int, Limits(1, 1000)] = 8
    message_bytes: Annotated[int, Limits(1000, 64_000_000)] = 4_000_000
    message_s: PositiveFloat = 10.0
    idle_s: PositiveFloat = 600.0


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
        self._tcp = client.family != socket.AF_UNIX
        self._buffer = bytearray()
        self._hello_by = time.monotonic() + limits.message_s
        if self._tcp:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def greeted(self) -> None:
        """Lift the limit of time that a client has until its hello is accepted."""
        self._hello_by = math.inf

    def read(self) -> bytes:
        """The body of the next message.

        Raises:
            OSError: if the client has left.
            RefusedError: if the message is too long, too slow or cut off, or none comes.
        """
        limits = self._limits
        if not self._buffer:
            late = f"no message came for {limits.idle_s:g} s, which is the limit"
            self._receive(time.monotonic() + limits.idle_s, late)
        end = time.monotonic() + limits.message_s
        start = messages.LENGTH.size
        (length,) = messages.LENGTH.unpack(self._first(start, end))
        if length > limits.message_bytes:
            raise RefusedError(
                f"a message may have {limits.message_bytes:,} bytes, the length before this one "
                f"says {length:,}"
            )
        body = self._first(start + length, end)[start:]
        del self._buffer[: start + length]
        return body

    def _first(self, count: int, end: float) -> bytes:
        """The first bytes of a message, which has to come until a time [s]."""
        late = f"a message must be whole {self._limits.message_s:g} s after its first byte"
        while len(self._buffer) < count:
            self._receive(end, late)
        return bytes(self._buffer[:count])

    def _receive(self, end: float, late: str) -> None:
        """Read what comes until a time of the monotonic clock [s], or refuse the client."""
        if self._hello_by < end:
            end = self._hello_by
            late = f"no valid hello came within {self._limits.message_s:g} s of connecting"
        left = end - time.monotonic()
        if left <= 0.0:
            raise RefusedError(late)
        try:
            self._socket.settimeout(left)
            piece = self._socket.recv(_PIECE)
        except TimeoutError:
            raise RefusedError(late) from None
        if not piece and self._buffer:
            raise RefusedError("the connection was closed amid a message")
        if not piece:
            raise ConnectionResetError
        self._buffer += piece

    def write(self, data: bytes) -> None:
        """Send a reply.

        Raises:
            OSError: if the client has left, or has not read it within the time for a message.
        """
        self._socket.settimeout(self._limits.message_s)
        self._socket.sendall(data)

    def refuse(self, message: str) -> None:
        """Send a last error, and give the client a moment to read it."""
        end = time.monotonic() + _LINGER_S
        self.greeted()
        with suppress(OSError, RefusedError):
            self._socket.settimeout(_LINGER_S)
            self._socket.sendall(messages.error(message, closing=True))
            self._socket.shutdown(socket.SHUT_WR)
            while True:  # else a reset takes the error along
                self._buffer.clear()
                self._receive(end, "")

    def has_left(self) -> bool:
        """True if the client has closed its side; from any thread, at once.

        A client that only sends no more may still read. A Unix socket tells that from one that has
        left; a TCP socket does not, and such a client counts as having left.
        """
        poll = select.poll()
        try:
            poll.register(self._socket, _GONE | _SENDS_NO_MORE if self._tcp else _GONE)
            return bool(poll.poll(0))
        except (OSError, ValueError):  # closed by ourselves
            return True

    def cut(self) -> None:
        """End it, from any thread: what reads or writes gives up."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
