"""``pushplan serve``: a policy behind a socket, for simulators and robots of any language."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from pushplan.cli.scenario_options import variations


def run(options: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    import logging
    import warnings

    from pushplan.evaluation.run.policy_specs import parse_policy
    from pushplan.serving import PROTOCOL, PolicyServer, ServerLimits

    spec = parse_policy(options.policy)
    server = PolicyServer(
        replace(spec, options=variations("option", options.options)).make,
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

    server.serve_forever(ready)
    return 0
