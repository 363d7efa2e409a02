"""``pushplan serve`` from end to end, and the client that is copied into other environments."""

from __future__ import annotations

import ast
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from served import EXAMPLES, PolicyClient, ServeError, maze_dict

from pushplan.cli import main
from pushplan.serving import PROTOCOL, PolicyServer, ServerLimits

CLIENT = EXAMPLES / "serve_client.py"


@contextmanager
def command(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server in a process of its own, and what it says first."""
    process = subprocess.Popen(
        [sys.executable, "-m", "pushplan", "serve", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield process, process.stdout.readline()
    finally:
        process.kill()
        process.communicate()


@pytest.mark.slow
def test_the_command_serves_the_client_that_is_shipped_until_a_signal(tmp_path):
    path = tmp_path / "s"
    address = f"unix:{path}"
    with command("straight", "--socket", address) as (process, said):
        assert said == f"straight is served at {address} ({PROTOCOL})\n"
        done = subprocess.run(
            [sys.executable, "-I", str(CLIENT), address], capture_output=True, text=True
        )
        assert re.search(r"straight: \d\d steps", done.stdout), done
        process.kill()
        process.wait()
    assert path.exists()  # it had no time to remove it
    with command("straight", "--socket", address, "--set", "spacing=0.3", "--verbose") as (
        process,
        said,
    ):
        client = PolicyClient(address)
        client.reset(maze_dict())
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0 and "client 1 has come" in errors, errors
        with pytest.raises((ConnectionError, ServeError)):
            client.act(time=1.0, robot_pose=[1, 1, 0])
    assert not path.exists()


@pytest.mark.parametrize("ends", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_every_signal_that_ends_it_removes_the_socket(ends, tmp_path):
    path = tmp_path / "s"
    before = signal.default_int_handler if ends == signal.SIGINT else signal.SIG_DFL
    inherited = signal.signal(ends, before)  # nohup, for one, has SIGHUP ignored
    server = PolicyServer("straight", f"unix:{path}")
    seen = []

    def ready() -> None:
        seen.append(path.exists())
        os.kill(os.getpid(), ends)

    try:
        assert server.serve_forever(ready) and seen == [True]
        assert not path.exists() and signal.getsignal(ends) is before
    finally:
        signal.signal(ends, inherited)


def test_a_server_under_nohup_outlives_its_terminal(tmp_path):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    seen = []

    def ready() -> None:
        seen.append(signal.getsignal(signal.SIGHUP))
        os.kill(os.getpid(), signal.SIGTERM)

    try:
        PolicyServer("straight", f"unix:{tmp_path / 's'}").serve_forever(ready)
    finally:
        signal.signal(signal.SIGHUP, before)
    assert seen == [signal.SIG_IGN]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["straight", "--socket", "tcp:0.0.0.0:7400"], "can be reached from other machines"),
        (["straight", "--socket", "here"], "a socket is unix:PATH or tcp:127.0.0.1:PORT"),
        (["strait", "--socket", "unix:s"], "did you mean 'straight'?"),
        (["nowhere.py:Policy", "--socket", "unix:s"], "there is no file nowhere.py"),
        (["straight", "--socket", "unix:s", "--set", "speed=2"], "unknown option"),
        (["straight", "--socket", "unix:s", "--set", "speed"], "--set takes NAME=VALUE"),
        (["straight", "--socket", "unix:s", "--message-bytes", "10"], "limit message_bytes must"),
        (["straight"], "--socket"),
    ],
)
def test_what_cannot_be_served_is_one_line(arguments, said, capsys):
    assert main(["serve", *arguments]) == 2
    errors = capsys.readouterr().err
    assert said in errors and "Traceback" not in errors


def test_the_help_says_the_limits(capsys):
    assert main(["serve", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for value in vars(ServerLimits()).values():
        assert f"(default {value:,})" in text


def test_the_client_needs_python_3_8_and_its_standard_library_alone():
    tree = ast.parse(CLIENT.read_text("utf-8"), feature_version=(3, 8))
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            names.add(str(node.module))
    assert {name.partition(".")[0] for name in names} <= sys.stdlib_module_names


@pytest.mark.slow
def test_the_example_runs_as_it_is_shipped(tmp_path):
    done: Any = subprocess.run(
        [sys.executable, str(CLIENT)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    assert done.returncode == 0 and "straight: 64 steps" in done.stdout, done
    assert list(Path(tmp_path).iterdir()) == []
