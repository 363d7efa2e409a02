"""``pushplan dataset export``: what a policy sees and does, as a data set."""

from __future__ import annotations

import argparse
from typing import Any

from pushplan.cli.common import add_command, say, whole

_EXAMPLES = """\
  pushplan dataset export --policy push-aware-constant-speed --task maze --episodes 200 \\
      --noise 0.02 --out runs/maze-data
  pushplan dataset export --policy ship-predictive --task ship_ice --episodes 100 --out runs/ice
  pushplan dataset export --policy push-aware-constant-speed --task maze --episodes 5 \\
      --out runs/few --minari pushplan/maze/push-aware-v0
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "dataset", "export episodes as a data set", _EXAMPLES, run)
    parser.add_argument("action", choices=("export",))
    parser.add_argument("--policy", required=True, metavar="NAME", help="as in 'pushplan run'")
    parser.add_argument(
        "--task", required=True, metavar="NAME", help="scenarios of its configuration for bc"
    )
    parser.add_argument("--config", metavar="FILE.yaml", help="take scenarios and observation here")
    parser.add_argument("--episodes", required=True, type=whole(1), metavar="N")
    parser.add_argument("--out", required=True, metavar="DIR", help="a new folder")
    parser.add_argument(
        "--noise",
        type=float,
        default=0.0,
        metavar="P",
        help="probability that a random action is carried out instead (default 0)",
    )
    parser.add_argument("--minari", metavar="NAME", help="also make a data set of Minari's own")


def run(options: argparse.Namespace) -> int:
    """Run the policy and write its episodes."""
    from pushplan.evaluation import parse_policy
    from pushplan.training.policies.config import config_named, read_config
    from pushplan.training.policies.dataset import DatasetRequest, read_metadata, record, to_minari
    from pushplan.world import InvalidInputError

    given = options.config
    config = config_named(options.task, "bc") if given is None else read_config(given)
    if config.task != options.task:
        raise InvalidInputError(f"{given} is for task {config.task!r}, not {options.task!r}")
    spec = parse_policy(options.policy)
    request = DatasetRequest(
        task=config.task,
        scenarios=config.scenarios,
        observation=config.observation,
        episodes=options.episodes,
        simulator=config.simulator,
        preset=config.preset,
        noise=options.noise,
    )
    folder = record(request, spec.make(), spec.label, options.out)
    about = read_metadata(folder)
    say(
        f"wrote {folder}: {about['total_episodes']} episodes, {about['total_steps']} steps, "
        f"{about['successes']} successes"
    )
    if options.minari is not None:
        to_minari(folder, options.minari)
        say(f"made the Minari data set {options.minari}")
    return 0
