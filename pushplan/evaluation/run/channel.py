"""Messages between a batch and its workers: a header in JSON and raw bytes, nothing that runs."""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Callable, Mapping
from typing import Any

from pushplan.world import PushplanError

_FRAME = struct.Struct("!4sIQ")  # mark, length of the header, length of the body
_MARK = b"pp1\n"
_LONGEST_HEADER = 2**20
_LONGEST_BODY = 2**30
_CHUNK = 2**18
_POLL_S = 0.2


class ChannelError(PushplanError):
    """What came is no message."""


class Channel:
    """One end of a stream socket.

    Args:
        line: the socket; closed with the channel.
    """

    def __init__(self, line: socket.socket) -> None:
        self._line = line

    def send(self, header: Mapping[str, Any], body: bytes = b"") -> None:
        """Send one message.

        Raises:
            OSError: if the other end has gone.
        """
        text = json.dumps(header).encode()
        self._line.settimeout(None)
        self._line.sendall(_FRAME.pack(_MARK, len(text), len(body)) + text)
        self._line.sendall(body)

    def receive(self, waiting: Callable[[], None] | None = None) -> tuple[dict[str, Any], bytes]:
        """The next message.

        Args:
            waiting: called several times a second until all of it is there; ends the wait by
                raising.

        Raises:
            EOFError: if the other end has closed.
            ChannelError: if something else came.
        """
        mark, length, size = _FRAME.unpack(self._bytes(_FRAME.size, waiting))
        if mark != _MARK or length > _LONGEST_HEADER or size > _LONGEST_BODY:
            raise ChannelError("it does not begin as one")
        text = self._bytes(length, waiting)
        body = self._bytes(size, waiting)
        try:
            header = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise ChannelError("its header is not JSON") from error
        if not isinstance(header, dict):
            raise ChannelError("its header is no mapping")
        return header, body

    def _bytes(self, count: int, waiting: Callable[[], None] | None) -> bytes:
        data = bytearray()
        self._line.settimeout(None if waiting is None else _POLL_S)
        while len(data) < count:
            try:
                chunk = self._line.recv(min(count - len(data), _CHUNK))
            except TimeoutError:
                assert waiting is not None
                waiting()
                continue
            except ConnectionError:
                chunk = b""
            if not chunk:
                raise EOFError
            data += chunk
        return bytes(data)

    def close(self) -> None:
        """Let the other end know that nothing more comes."""
        self._line.close()
