"""`Listener`: accepts connections and gives each a thread."""

from __future__ import annotations

import socket
import socketserver
import time
from collections.abc import Callable
from typing import Any

from pushplan.serving.session import LOG

_PAUSE_S = 0.1  # after a connection that could not be accepted, as without file handles [s]


class Listener(socketserver.ThreadingTCPServer):
    """Accepts connections of a socket that listens already, of any family.

    Args:
        listening: the socket.
        attend: called with each connected socket, in a thread of its own.
        look: called about ten times a second.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(
        self,
        listening: socket.socket,
        attend: Callable[[socket.socket], None],
        look: Callable[[], None],
    ) -> None:
        super().__init__(("", 0), socketserver.BaseRequestHandler, bind_and_activate=False)
        self.socket.close()
        self.socket = listening
        self._attend, self._look = attend, look

    def get_request(self) -> tuple[socket.socket, Any]:
        """Accept a connection."""
        try:
            return super().get_request()
        except OSError:
            time.sleep(_PAUSE_S)
            raise

    def finish_request(self, request: Any, client_address: Any) -> None:
        """Attend to a client; called in its thread."""
        self._attend(request)

    def service_actions(self) -> None:
        """Look after the clients."""
        self._look()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Tell the log of an error that is ours."""
        LOG.exception("a connection has failed")
