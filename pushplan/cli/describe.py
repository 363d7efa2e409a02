"""``pushplan describe``: the specification of a network that learns in an environment."""

from __future__ import annotations

import argparse
import json

from pushplan.cli.common import say
from pushplan.cli.output_files import check_file
from pushplan.cli.scenario_options import scenario_of


def run(options: argparse.Namespace) -> int:
    """Describe the environment of a scenario."""
    from pushplan.envs import make
    from pushplan.learned import FeatureObservation, describe
    from pushplan.learned.sb3_policy import ALGORITHMS, write_beside
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
    facts = {}
    if options.algorithm is not None:
        facts["algorithm"] = options.algorithm
    specification = describe(env, repeat=options.repeat, training=facts)
    env.close()
    if options.model is None:
        say(json.dumps(json.loads(specification.to_json()), indent=1))
    else:
        say(f"wrote {write_beside(options.model, specification)}")
    return 0
