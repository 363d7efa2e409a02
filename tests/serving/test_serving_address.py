"""Where a server listens, and who may reach it."""

from __future__ import annotations

import os
import socket
import stat
from pathlib import Path

import pytest
from served import PolicyClient, served

from pushplan.planners import make_policy
from pushplan.serving import Address, PolicyServer, ServerLimits
from pushplan.world import InvalidInputError, UnknownNameError


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("unix:/tmp/a b.sock", "unix:/tmp/a b.sock"),
        ("tcp:127.0.0.1:7400", "tcp:127.0.0.1:7400"),
        ("tcp:127.9.9.9:0", "tcp:127.9.9.9:0"),
        ("tcp:localhost:7400", "tcp:127.0.0.1:7400"),
        ("tcp:[::1]:7400", "tcp:[::1]:7400"),
    ],
)
def test_addresses(text, read):
    assert str(Address.parse(text)) == read


@pytest.mark.parametrize(
    "text",
    [
        *("", "unix:", "/tmp/x", "tcp:", "tcp:7400", "tcp:127.0.0.1", "tcp:127.0.0.1:99999"),
        *("udp:a:1", "tcp:127.0.0.1:-1", "tcp:::1:7400", "unix:\0x", "x" * 10_000, 7),
    ],
)
def test_what_is_no_address_is_refused(text):
    with pytest.raises(
        InvalidInputError, match=r"socket (is unix:PATH or tcp|must be a text)"
    ) as e:
        Address.parse(text)
    assert len(str(e.value)) <= 300


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "[::]", "example.org", "8.8.8.8"])
def test_other_machines_are_let_in_only_by_name(host):
    with pytest.raises(InvalidInputError, match=r"from other machines.*--allow-remote"):
        PolicyServer("straight", f"tcp:{host}:7400")
    assert Address.parse(f"tcp:{host}:7400", allow_remote=True).port == 7400


def test_the_socket_is_for_its_owner_alone(tmp_path):
    with served("straight", tmp_path) as server:
        mode = os.stat(tmp_path / "s").st_mode
        assert stat.S_ISSOCK(mode) and stat.S_IMODE(mode) == 0o600
        with pytest.raises(InvalidInputError, match="another server does"):
            PolicyServer("straight", server.address).start()
        with pytest.raises(InvalidInputError, match="serves already"):
            server.start()
        PolicyClient(server.address).close()


def test_a_dead_socket_is_replaced_and_nothing_else(tmp_path):
    dead = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    dead.bind(str(tmp_path / "s"))
    dead.close()
    with served("straight", tmp_path) as server:
        PolicyClient(server.address).close()
    for name in ("file", "link", "folder"):
        path = tmp_path / name
        {"file": path.touch, "link": lambda p=path: p.symlink_to("s"), "folder": path.mkdir}[name]()
        with pytest.raises(InvalidInputError, match="a file already, which is no socket"):
            Address.parse(f"unix:{path}").listen()
        assert path.is_symlink() or path.exists()


def test_a_socket_of_another_server_is_left_alone(tmp_path):
    server = PolicyServer("straight", f"unix:{tmp_path / 's'}")
    server.start()
    os.unlink(tmp_path / "s")
    (tmp_path / "s").touch()
    assert server.close()
    assert (tmp_path / "s").exists()


@pytest.mark.parametrize("path", ["nowhere/s", "s" * 200])
def test_where_no_socket_can_be(path, tmp_path):
    with pytest.raises(InvalidInputError, match="cannot listen at"):
        Address.parse(f"unix:{tmp_path / path}").listen()


def test_a_port_that_is_taken(tmp_path):
    with PolicyServer("straight", "tcp:127.0.0.1:0") as server:
        with pytest.raises(InvalidInputError, match="in use"):
            Address.parse(server.address).listen()


def test_what_is_served_is_checked_first(tmp_path):
    address = f"unix:{tmp_path / 's'}"

    class Sees:
        observation = "image"
        reset = act = lambda self, *_: None

    class Aims:
        actions = ("heading",)
        reset = act = lambda self, *_: None

    for policy, said in (
        (7, "a name or a callable"),
        (object, "must be a Policy"),
        (Sees, "needs the observation 'image'"),
        (Aims, "gives heading"),
    ):
        with pytest.raises(InvalidInputError, match=said):
            PolicyServer(policy, address)  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="straight"):
        PolicyServer("strait", address)
    with pytest.raises(InvalidInputError, match="server limit clients"):
        ServerLimits(clients=0)
    with pytest.raises(InvalidInputError, match="limits"):
        PolicyServer("straight", address, limits=3)  # type: ignore[arg-type]
    assert PolicyServer(lambda: make_policy("straight"), address, label="mine")
    assert not Path(address.removeprefix("unix:")).exists()
