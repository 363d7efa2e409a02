"""`Connection`: the bytes of one client, within limits of size and time."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any

from pushplan.serving import messages
from pushplan.serving.limits import ServerLimits
from pushplan.serving.session import Answer
from pushplan.serving.worker import SessionWorker
from pushplan.world import PushplanError

_LINGER_S = 0.5  # for how long a client that is sent away may still send, and read why [s]


class LeftError(Exception):
    """The client has closed the connection."""


class RefusedError(PushplanError):
    """The client broke a rule after which its bytes make no sense any more."""


class Connection:
    """Reads requests, one ahead of the one that is being answered, and writes replies.

    Args:
        reader, writer: the client's streams.
        limits: of sizes and times.
    """

    def __init__(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, limits: ServerLimits
    ) -> None:
        self._reader, self._writer, self._limits = reader, writer, limits

    async def converse(self, worker: SessionWorker) -> None:
        """Answer requests until the client says close.

        Raises:
            LeftError: if it leaves before; at once, also while a request is being answered.
            RefusedError: if it breaks a limit, or is silent for too long.
        """
        reading = asyncio.ensure_future(self._read())
        try:
            patience = self._limits.message_s  # until hello
            while True:
                await asyncio.wait({reading}, timeout=patience)
                if not reading.done():
                    raise RefusedError(f"no message came for {patience:g} s, which is the limit")
                body = reading.result()
                reading = asyncio.ensure_future(self._read())
                answer = await self._answer(worker, body, reading)
                await self._write(answer.data)
                if answer.last:
                    return
                patience = self._limits.idle_s
        finally:
            reading.cancel()
            await asyncio.wait({reading})
            if not reading.cancelled():
                reading.exception()  # nobody else asks for it

    async def _answer(
        self, worker: SessionWorker, body: bytes, reading: asyncio.Future[bytes]
    ) -> Answer:
        answering = worker.answer(body)
        both: set[asyncio.Future[Any]] = {answering, reading}
        await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        if not answering.done() and isinstance(reading.exception(), LeftError):
            reading.result()
        return await answering

    async def _read(self) -> bytes:
        """The body of the next message; the time for it counts from its first byte on."""
        limits = self._limits
        try:
            head = await self._reader.readexactly(1)
            async with asyncio.timeout(limits.message_s):
                head += await self._reader.readexactly(messages.LENGTH.size - 1)
                (length,) = messages.LENGTH.unpack(head)
                if length > limits.message_bytes:
                    raise RefusedError(
                        f"a message may have {limits.message_bytes:,} bytes, the length before "
                        f"this one says {length:,}"
                    )
                return await self._reader.readexactly(length)
        except TimeoutError:
            raise RefusedError(
                f"a message must be whole {limits.message_s:g} s after its first byte"
            ) from None
        except (asyncio.IncompleteReadError, OSError):
            raise LeftError from None

    async def _write(self, data: bytes) -> None:
        try:
            async with asyncio.timeout(self._limits.message_s):
                self._writer.write(data)
                await self._writer.drain()
        except TimeoutError:
            raise LeftError from None  # it does not read, so there is nothing to tell it
        except OSError:
            raise LeftError from None

    async def refuse(self, message: str) -> None:
        """Send a last error, and give the client the time to read it."""
        with suppress(Exception):
            async with asyncio.timeout(_LINGER_S):
                self._writer.write(messages.error(message, closing=True))
                await self._writer.drain()
                if self._writer.can_write_eof():
                    self._writer.write_eof()
                while await self._reader.read(65536):  # else what was sent is lost with a reset
                    pass

    def close(self) -> None:
        """Close at once; what has not been sent by now is dropped if the client does not read."""
        if self._writer.transport.get_write_buffer_size():
            self._writer.transport.abort()
        else:
            self._writer.close()
