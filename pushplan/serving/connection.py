"""`Connection`: the messages of one client, within limits of size and time."""

from __future__ import annotations

import asyncio
import math
import select
import socket
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pushplan.serving import messages
from pushplan.world import PushplanError
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat

_LINGER_S = 0.5  # for how long a client that is sent away may still send, and read why [s]
_GONE = select.POLLHUP | select.POLLERR
_SENDS_NO_MORE = getattr(select, "POLLRDHUP", 0)


@dataclass(frozen=True)
class ServerLimits(CheckedFields):
    """Limits on clients; whoever wants more gets an error message and is sent away.

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
    """Reads messages and writes replies.

    Args:
        reader: what the client sends.
        writer: to the client.
        limits: of sizes and times.
    """

    def __init__(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, limits: ServerLimits
    ) -> None:
        self._reader = reader
        self._writer = writer
        self._limits = limits
        self._clock = asyncio.get_running_loop().time
        self._hello_by = self._clock() + limits.message_s
        writer.transport.set_write_buffer_limits(0)  # draining waits until all is sent

    def greeted(self) -> None:
        """Lift the limit of time that a client has until its hello is accepted."""
        self._hello_by = math.inf

    async def read(self) -> bytes:
        """The body of the next message.

        Raises:
            OSError: if the client has left.
            RefusedError: if the message is too long, too slow or cut off, or none comes.
        """
        limits = self._limits
        head = b""
        late = f"no message came for {limits.idle_s:g} s, which is the limit"
        try:
            head = await self._exactly(1, self._clock() + limits.idle_s, late)
            end = self._clock() + limits.message_s
            late = f"a message must be whole {limits.message_s:g} s after its first byte"
            head += await self._exactly(messages.LENGTH.size - 1, end, late)
            (length,) = messages.LENGTH.unpack(head)
            if length > limits.message_bytes:
                raise RefusedError(
                    f"a message may have {limits.message_bytes:,} bytes, the length before this "
                    f"one says {length:,}"
                )
            return await self._exactly(length, end, late)
        except asyncio.IncompleteReadError as error:
            if not head:  # between two messages
                raise ConnectionResetError from error
            raise RefusedError("the connection was closed amid a message") from error

    async def _exactly(self, count: int, end: float, late: str) -> bytes:
        """Read so many bytes until a time of the loop's clock [s], or refuse the client."""
        if self._hello_by < end:
            end = self._hello_by
            late = f"no valid hello came within {self._limits.message_s:g} s of connecting"
        try:
            async with asyncio.timeout_at(end):
                return await self._reader.readexactly(count)
        except TimeoutError:
            raise RefusedError(late) from None

    async def write(self, data: bytes) -> None:
        """Send a reply.

        Raises:
            OSError: if the client has left, or has not read it within the time for a message.
        """
        self._writer.write(data)
        async with asyncio.timeout(self._limits.message_s):
            await self._writer.drain()

    async def refuse(self, message: str) -> None:
        """Send a last error, and give the client a moment to read it."""
        with suppress(OSError):
            async with asyncio.timeout(_LINGER_S):
                self._writer.write(messages.error(message, closing=True))
                await self._writer.drain()
                self._writer.write_eof()
                while await self._reader.read(65536):  # else a reset takes the error along
                    pass

    def has_left(self) -> bool:
        """True if the client has closed its side.

        A client that only sends no more may still read. A Unix socket tells that from one that has
        left; a TCP socket does not, and such a client counts as having left.
        """
        client = self._writer.get_extra_info("socket")
        poll = select.poll()
        try:
            tcp = client.family != socket.AF_UNIX
            poll.register(client.fileno(), _GONE | _SENDS_NO_MORE if tcp else _GONE)
            return bool(poll.poll(0))
        except (OSError, ValueError):  # closed by ourselves
            return True

    def cut(self) -> None:
        """End it: what reads or writes gives up."""
        self._writer.transport.abort()
