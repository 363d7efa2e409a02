"""``pushplan run``: one scenario, one policy."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import (
    add_command,
    add_latency,
    add_trust,
    check_episode_file,
    complete,
    milliseconds,
    save_episode,
    say,
)
from pushplan.cli.kernel_progress import kernel_progress
from pushplan.cli.scenario_options import add_scenario_options, scenario_of

if TYPE_CHECKING:
    from pushplan.scenarios import Scenario
    from pushplan.world import Episode

_EXAMPLES = """\
  pushplan run maze-2d-5 --policy kinodynamic-rrt --seed 3 --render episode.gif
  pushplan run --task maze --boxes 8 --shape z --policy straight --out episode.npz
  pushplan run maze-2d-5 --policy my_planner.py:MyPlanner --render path.png
  pushplan run --task area_clearing --simulator mujoco --policy greedy --render clear.mp4
  pushplan run --task maze --set wheeled=0.5 --set random_start=true --policy straight --live
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "run", "run one policy on one scenario", _EXAMPLES, run)
    add_scenario_options(parser)
    policy = parser.add_argument(
        "--policy", required=True, metavar="NAME", help="as in 'pushplan bench'"
    )
    complete(policy, "policies")
    parser.add_argument(
        "--observation",
        metavar="NAME",
        default="auto",
        help="of the task, such as image or state; by default what the policy asks for",
    )
    add_latency(parser)
    add_trust(parser)
    parser.add_argument(
        "--render",
        metavar="FILE",
        help="picture of the end (.png, .svg, .pdf) or film (.gif, .mp4)",
    )
    parser.add_argument("--live", action="store_true", help="show the episode in a window")
    parser.add_argument("--out", metavar="FILE", help="write the episode: .npz or .mcap")


def run(options: argparse.Namespace) -> int:
    """Run the episode, print its scores, write files."""
    from pushplan.cli.film import Camera
    from pushplan.evaluation import Job, JobSettings, PolicyError, parse_policy, run_episode
    from pushplan.evaluation.execute import dry_run

    scenario = scenario_of(options)
    check_episode_file(options.out)
    camera = Camera(options.render) if options.render else None
    spec = parse_policy(options.policy)
    policy = spec.make()
    settings = JobSettings(observation=options.observation)
    mode = "human" if options.live else None
    env = settings.environment(scenario, policy, render_mode=mode)
    with kernel_progress(spec.label):
        dry_run(Job(spec, scenario), settings)  # so that no timing holds loading and compiling
    try:
        episode = run_episode(
            env, policy, scenario, observer=camera, latency_factor=options.latency
        )
    except PolicyError as error:
        raise PolicyError(f"policy {spec.label!r} failed: {error}") from error
    finally:
        env.close()
    _print(spec.label, scenario, episode)
    if options.out:
        save_episode(episode, options.out)
        say(f"wrote {options.out}")
    if camera is not None:
        camera.write(episode)
        say(f"wrote {options.render}")
    return 0


def _print(label: str, scenario: Scenario, episode: Episode) -> None:
    import numpy as np

    from pushplan.metrics import compute

    values = compute(episode)
    say(f"{label} on {scenario.key}: {'success' if episode.success else episode.reason}")
    scores = [f"{key} {values[key]:.3f}" for key in values if key[:2] in ("E_", "I_", "S_")]
    say("  " + "   ".join(scores))
    say(
        f"  path {values['path_length_m']:.2f} m, work {values['interaction_work_kg_m']:.3f} kg m, "
        f"{len(episode.actions)} steps, {values['sim_time_s']:.1f} s simulated"
    )
    if len(episode.plan_times_s):
        times = episode.plan_times_s
        say(
            f"  planning: {len(times)} calls, median {milliseconds(np.median(times))}, "
            f"max {milliseconds(times.max())}"
        )
    if (factor := episode.about.get("latency_factor")) is not None:
        say(f"  latency-aware simulation: a second of computing was {factor:g} s for the robot")
    if len(episode.act_times_s):
        times = episode.act_times_s
        say(
            f"  policy: median {milliseconds(np.median(times))} a step, "
            f"max {milliseconds(times.max())}"
        )
