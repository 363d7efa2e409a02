"""``pushplan run``, ``teleop`` and ``serve``: one policy, or a person, at work."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pushplan.cli.common import (
    DRIVEN_WITH_KEYS,
    check_episode_file,
    milliseconds,
    save_episode,
    say,
    say_json,
    say_scores,
    say_without_deadline,
    say_written,
    scenario_of,
    variations,
)
from pushplan.cli.output_files import check_file

if TYPE_CHECKING:
    from pushplan.scenarios import Scenario
    from pushplan.world import Episode
    from pushplan.world.checks import FloatArray


def run(options: argparse.Namespace) -> int:
    """Run the episode, print its scores, write files."""
    from pushplan.cli.film import Camera
    from pushplan.evaluation import Job, JobSettings, PolicyError, parse_policy, run_episode
    from pushplan.evaluation.run.execute import dry_run
    from pushplan.evaluation.run.policy_specs import with_deadline
    from pushplan.evaluation.store.rows import Status, blank_row, scored_row

    scenario = scenario_of(options)
    check_episode_file(options.out)
    camera = Camera(options.render) if options.render else None
    spec = parse_policy(options.policy)
    if options.deadline is not None:
        spec = with_deadline(spec, options.deadline)
        say_without_deadline([spec])
    policy = spec.make()
    settings = JobSettings(observation=options.observation)
    mode = "human" if options.live else None
    env = settings.environment(scenario, policy, render_mode=mode)
    dry_run(Job(spec, scenario), settings)  # so that no timing holds the loading of libraries
    try:
        episode = run_episode(
            env, policy, scenario, observer=camera, latency_factor=options.latency
        )
    except PolicyError as error:
        raise PolicyError(f"policy {spec.label!r} failed: {error}") from error
    finally:
        env.close()
    if options.out:
        save_episode(episode, options.out)
    if camera is not None:
        camera.write(episode)
    if options.json:
        row = blank_row(spec.label, scenario, Status.DONE, episode.reason)
        calls = len(episode.plan_times_s) or None
        say_json(scored_row(row, episode, calls).by_column())
    else:
        _print(spec.label, scenario, episode)
    say_written(options, options.out, options.render)
    return 0


def _print(label: str, scenario: Scenario, episode: Episode) -> None:
    from pushplan.metrics import compute

    values = compute(episode)
    say(f"{label} on {scenario.key}: {'success' if episode.success else episode.reason}")
    scores = [f"{key} {values[key]:.3f}" for key in values if key[:2] in ("E_", "I_", "S_")]
    say("  " + "   ".join(scores))
    say(
        f"  path {values['path_length_m']:.2f} m, work {values['interaction_work_kg_m']:.3f} kg m, "
        f"{len(episode.actions)} steps, {values['sim_time_s']:.1f} s simulated"
    )
    calls = len(episode.plan_times_s)
    _print_times(f"planning: {calls} calls,", episode.plan_times_s)
    if (factor := episode.about.get("latency_factor")) is not None:
        say(f"  latency-aware simulation: a second of computing was {factor:g} s for the robot")
    _print_times("policy:", episode.act_times_s, " a step")


def _print_times(what: str, times: FloatArray, each: str = "") -> None:
    if len(times):
        typical = milliseconds(float(np.median(times)))
        say(f"  {what} median {typical}{each}, max {milliseconds(times.max())}")


def teleop(options: argparse.Namespace) -> int:
    """Open a window, drive, print the scores, write the episode."""
    scenario = scenario_of(options)
    check_file(options.out)
    env = _environment(scenario, options.action)
    from pushplan.cli.cockpit import Keyboard, drive
    from pushplan.envs.window import Window

    keyboard = Keyboard()
    window = Window(f"pushplan {scenario.task}, seed {scenario.seed}", keyboard=keyboard)
    try:
        episode = drive(env, scenario, window, speed=options.speed)
    finally:
        window.close()
        env.close()
    if options.out:
        episode.save(options.out)
    say_scores(episode)
    if options.out:
        say(f"wrote {options.out}")
    return 0


def _environment(scenario: Scenario, action: str | None) -> Any:
    from pushplan.envs import make
    from pushplan.envs.registry import task_class
    from pushplan.world import InvalidInputError

    known = task_class(scenario.task).actions
    usable = [name for name in known if name in DRIVEN_WITH_KEYS]
    if not usable:
        raise InvalidInputError(
            f"task {scenario.task!r} cannot be driven with keys: it has none of the actions "
            f"{', '.join(DRIVEN_WITH_KEYS)} (it has: {', '.join(known)})"
        )
    return make(scenario, observation="state", action=action or usable[0])


def serve(options: argparse.Namespace) -> int:
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
