"""Address of a server: a Unix socket, or a TCP port that only this machine reaches."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import os
import re
import socket
import stat
import time
from collections.abc import Iterator
from dataclasses import dataclass

from pushplan.errors import InvalidInputError, short
from pushplan.files.file_locks import take_lock
from pushplan.world.checks import word

_TCP = re.compile(r"tcp:(\[[^\]]+\]|[^:\[\]]+):(\d{1,5})")
_LOCK_S = 5.0  # for how long another server may be starting in the same folder [s]
_FORMS = "unix:PATH or tcp:127.0.0.1:PORT"


@dataclass(frozen=True)
class Address:
    """Address at which a server listens.

    Args:
        path: of a Unix socket; empty for TCP.
        host: of a TCP port.
        port: 0 for any free one.
    """

    path: str = ""
    host: str = ""
    port: int = 0

    @classmethod
    def parse(cls, text: str, *, allow_remote: bool = False) -> Address:
        """Read ``unix:PATH`` or ``tcp:HOST:PORT``.

        Args:
            text: the address. An IPv6 address stands in brackets; ``localhost`` is 127.0.0.1.
            allow_remote: let other machines reach it, too.

        Raises:
            InvalidInputError: if it is neither, or other machines would reach it.
        """
        kind, _, path = word("socket", text).partition(":")
        if kind == "unix" and path and "\0" not in path:
            return cls(path=path)
        found = _TCP.fullmatch(text)
        if found is None or int(found[2]) > 65535:
            raise InvalidInputError(f"a socket is {_FORMS} (PORT up to 65535), got {short(text)}")
        host = found[1].strip("[]")
        if host == "localhost":
            host = "127.0.0.1"
        if not allow_remote and not _is_loopback(host):
            raise InvalidInputError(
                f"{short(host)} can be reached from other machines, and the server asks nobody who "
                f"it is: choose {_FORMS}, or allow it by name (--allow-remote, allow_remote=True)"
            )
        return cls(host=host, port=int(found[2]))

    def __str__(self) -> str:
        """The text that `parse` reads."""
        if self.path:
            return f"unix:{self.path}"
        return f"tcp:{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"

    def listen(self) -> socket.socket:
        """A listening socket; that of a path is open to its owner alone (mode 0600).

        A socket that a dead server left behind is replaced.

        Raises:
            InvalidInputError: if something else is at the path, a server listens there, or the
                system refuses it.
        """
        try:
            if self.path:
                return self._listen_at_path()
            six = ":" in self.host
            family = socket.AF_INET6 if six else socket.AF_INET
            dual = six and socket.has_dualstack_ipv6()  # [::] stands for IPv4, too
            return socket.create_server((self.host, self.port), family=family, dualstack_ipv6=dual)
        except OSError as error:
            why: object = error.strerror or error
            if "too long" in str(error):
                why = "the path is too long"
            raise InvalidInputError(f"cannot listen at {self}: {why}") from error

    def _listen_at_path(self) -> socket.socket:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            with _alone(os.path.dirname(self.path) or "."):
                self._clear()
                listener.bind(self.path)
                os.chmod(self.path, 0o600)  # nobody can connect before it listens
                listener.listen()
        except BaseException:
            listener.close()
            raise
        return listener

    def _clear(self) -> None:
        """Remove a socket at which nobody listens."""
        try:
            mode = os.lstat(self.path).st_mode
        except FileNotFoundError:
            return
        if not stat.S_ISSOCK(mode):
            raise InvalidInputError(
                f"cannot listen at {self}: there is a file already, which is no socket"
            )
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as caller:
            caller.settimeout(1.0)
            try:
                caller.connect(self.path)
            except ConnectionRefusedError:
                os.unlink(self.path)
                return
            except (BlockingIOError, TimeoutError):
                pass  # its server is busy
        raise InvalidInputError(
            f"cannot listen at {self}: another server does; end it or choose another path"
        )


@contextlib.contextmanager
def _alone(folder: str) -> Iterator[None]:
    """Keep other servers from looking for dead sockets in a folder meanwhile."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        end = time.monotonic() + _LOCK_S
        while take_lock(handle) is False:  # on a disk without locks there is nothing to wait for
            if time.monotonic() > end:
                raise OSError(errno.EBUSY, f"the folder {folder} is locked")
            time.sleep(0.02)
        yield
    finally:
        os.close(handle)


def _is_loopback(host: str) -> bool:
    with contextlib.suppress(ValueError):  # a name may be of any machine
        return ipaddress.ip_address(host).is_loopback
    return False
