"""``pushplan serve``: a policy behind a socket, for simulators and robots of any language."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from typing import Any

from pushplan.cli.common import add_command, add_trust, positive, whole
from pushplan.cli.kernel_progress import kernel_progress
from pushplan.cli.scenario_options import variation

_EXAMPLES = """\
  pushplan serve push-aware --socket unix:/tmp/push.sock
  pushplan serve gtsp-mpc --socket tcp:127.0.0.1:7400
  pushplan serve push-aware --set push_weight=2.0 --socket unix:/tmp/push.sock
  pushplan serve my_planner.py:MyPlanner --socket unix:/tmp/mine.sock --clients 2

The messages are described in docs/serve.md; examples/serve_client.py is a client in one file.
Ctrl-C, SIGTERM or SIGHUP ends the server.
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "serve", "serve a policy at a socket: worlds in, commands out", _EXAMPLES, run
    )
    parser.add_argument("policy", metavar="POLICY", help="as one of 'pushplan bench --policies'")
    parser.add_argument(
        "--socket",
        required=True,
        metavar="ADDRESS",
        help="unix:PATH, or tcp:127.0.0.1:PORT (0: any free port)",
    )
    parser.add_argument(
        "--set",
        dest="options",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="an argument of the policy, or a field of its config; may be repeated",
    )
    parser.add_argument(
        "--allow-remote",
        action="store_true",
        help="listen where other machines can connect: nothing is encrypted, nobody is asked for "
        "a password",
    )
    _add_limits(parser)
    parser.add_argument("--verbose", action="store_true", help="say who comes and goes")
    add_trust(parser)


def _add_limits(parser: argparse.ArgumentParser) -> None:
    for name, kind, default, metavar, what in (
        ("clients", whole(1), 8, "N", "clients at once"),
        ("message-bytes", whole(1), 4_000_000, "BYTES", "greatest length of a message"),
        ("message-s", positive, 10.0, "S", "time for a whole message [s]"),
        ("idle-s", positive, 600.0, "S", "time in which a client may be silent [s]"),
    ):
        parser.add_argument(
            f"--{name}",
            type=kind,
            default=default,
            metavar=metavar,
            help=f"{what} (default {default:,})",
        )


def run(options: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    import logging
    import warnings

    from pushplan.evaluation.policies import parse_policy
    from pushplan.serving import PROTOCOL, PolicyServer, ServerLimits
    from pushplan.world import InvalidInputError

    spec = parse_policy(options.policy)
    given: dict[str, Any] = {}
    for name, value in map(variation, options.options):
        if name in given:
            raise InvalidInputError(f"option {name!r} is given twice")
        given[name] = value
    server = PolicyServer(
        replace(spec, options=given).make,
        options.socket,
        allow_remote=options.allow_remote,
        limits=ServerLimits(
            clients=options.clients,
            message_bytes=options.message_bytes,
            message_s=options.message_s,
            idle_s=options.idle_s,
        ),
        label=spec.label,
    )
    logging.basicConfig(
        stream=sys.stderr,
        format="%(message)s",
        level=logging.INFO if options.verbose else logging.WARNING,
    )
    # of numbers in a client's world: they say nothing to whoever reads the log
    warnings.filterwarnings("ignore", category=RuntimeWarning, module=r"pushplan\.")

    def ready() -> None:
        sys.stdout.write(f"{spec.label} is served at {server.address} ({PROTOCOL})\n")
        sys.stdout.flush()

    with kernel_progress(spec.label):
        server.warm_up()
    server.serve_forever(ready)
    return 0
