"""``pushplan describe``: the specification of a network that learns in an environment."""

from __future__ import annotations

import argparse
import json
from typing import Any

from pushplan.cli.common import add_command, say, whole
from pushplan.cli.outputs import check_file
from pushplan.cli.scenario_options import add_scenario_options, scenario_of

_EXAMPLES = """\
  pushplan describe maze-2d-3 --observation state
  pushplan describe --task maze --set shape=z --observation features --action velocity
  pushplan describe maze-2d-3 --observation features --algorithm ppo --for model.zip
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "describe", "print the specification of a network", _EXAMPLES, run
    )
    add_scenario_options(parser)
    parser.add_argument(
        "--observation",
        metavar="NAME",
        help="of the task, such as image or state, or features; the task's first by default",
    )
    parser.add_argument("--action", metavar="NAME", help="action mode; the task's first by default")
    parser.add_argument(
        "--repeat", type=whole(1), default=1, metavar="N", help="steps of a decision (default 1)"
    )
    parser.add_argument(
        "--algorithm", metavar="NAME", help="what has trained it: ppo, sac, a2c, td3 or ddpg"
    )
    parser.add_argument(
        "--for",
        dest="model",
        metavar="MODEL.zip",
        help="write MODEL.pushplan.json, so that sb3:MODEL.zip runs; needs --algorithm",
    )


def run(options: argparse.Namespace) -> int:
    """Describe the environment of a scenario."""
    from pushplan.envs import make
    from pushplan.learned import FeatureObservation, describe
    from pushplan.learned.sb3_policy import ALGORITHMS
    from pushplan.learned.sb3_saving import write_beside
    from pushplan.world import InvalidInputError
    from pushplan.world.checks import choice

    names = tuple(name.lower() for name in ALGORITHMS)
    if options.algorithm is not None:
        choice("--algorithm", options.algorithm, names)
    if options.model is not None:
        check_file(options.model, (".zip",))
        if options.algorithm is None:
            raise InvalidInputError(f"--for needs --algorithm, one of {', '.join(names)}")
    features = options.observation == "features"
    env = make(
        scenario_of(options),
        observation=FeatureObservation() if features else options.observation,
        action=options.action,
    )
    facts = {} if options.algorithm is None else {"algorithm": options.algorithm}
    specification = describe(env, repeat=options.repeat, training=facts)
    env.close()
    if options.model is None:
        say(json.dumps(json.loads(specification.to_json()), indent=1))
    else:
        say(f"wrote {write_beside(options.model, specification)}")
    return 0
