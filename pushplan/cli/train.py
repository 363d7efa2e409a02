"""``pushplan train``, ``dataset`` and ``describe``: learned policies, up to a model card."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import say, scenario_of
from pushplan.cli.output_files import check_directory, check_file

if TYPE_CHECKING:
    from pathlib import Path

    from pushplan.training.policies.config import TrainingConfig


def run(options: argparse.Namespace) -> int:
    """Train, score, write the card."""
    import logging

    from pushplan.training.policies.training import train_policy

    check_directory(options.out, "training", "config.yaml")
    config = _config(options)
    _show_progress(logging.getLogger("pushplan.training"))
    try:
        path = train_policy(
            config,
            options.out,
            resume=options.resume,
            device=options.device,
            processes=options.processes,
            threads=options.threads,
            data=options.data,
            command=_command(options, config),
        )
    except KeyboardInterrupt:
        sys.stderr.write(f"stopped; with --resume the training in {options.out} goes on\n")
        raise
    assert path is not None
    say(f"wrote {path}")
    card = _score(config, path, options)
    say(f"wrote {card}")
    return 0


def _config(options: argparse.Namespace) -> TrainingConfig:
    from pushplan.training.policies.config import config_named, read_config
    from pushplan.world import InvalidInputError

    if (options.config is None) == (options.task is None):
        raise InvalidInputError("give either --task NAME or --config FILE.yaml")
    if options.config is not None:
        if options.variant is not None:
            raise InvalidInputError("--variant belongs to --task")
        config = read_config(options.config)
        if config.algorithm != options.algorithm:
            raise InvalidInputError(
                f"{options.config} is for {config.algorithm!r}, not {options.algorithm!r}"
            )
    else:
        variant = "" if options.variant is None else f"-{options.variant}"
        config = config_named(options.task, options.algorithm + variant)
    return config.changed(steps=options.steps, seed=options.seed)


def _command(options: argparse.Namespace, config: TrainingConfig) -> str:
    """Return the command line that starts this training again."""
    words = ["pushplan", "train", options.algorithm]
    for name in ("task", "variant", "config", "out"):
        if (value := getattr(options, name)) is not None:
            words += [f"--{name}", value]
    words += ["--data", *options.data] if options.data else []
    words += ["--steps", str(config.steps), "--seed", str(config.seed)]
    words += ["--threads", str(options.threads)]
    return shlex.join(words)


def _score(config: TrainingConfig, path: Path, options: argparse.Namespace) -> Path:
    """Run the policy on held-out scenarios, and write the model card."""
    from collections import Counter

    from pushplan.evaluation import bench
    from pushplan.training.policies.training import write_card

    rows = []
    for suite in config.suites if options.episodes else ():
        results = bench(
            suite,
            [f"policy=onnx:{path}"],
            episodes=options.episodes,
            workers=options.workers,
        )
        (found,) = results.pooled.summary()
        row = {
            "suite": suite,
            "episodes": found.episodes,
            "success": found.success.fraction,
            "success_low": found.success.low,
            "success_high": found.success.high,
            "scores": {
                name: (one.mean, one.low, one.high)[: 3 if one.count > 1 else 1]
                for name in ("S_manip", "E_manip", "I_manip", "E_nav", "I_nav")
                if (one := found.metrics.get(name)) is not None
            },
            "failures": dict(Counter(one.reason for one in results.rows if not one.success)),
        }
        rows.append(row)
        say(f"  {suite}: success {found.success.fraction:.2f} of {found.episodes}")
    scores = path.with_name("scores.json")
    scores.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return write_card(options.out, rows, path.with_name("MODEL_CARD.md"))


def _show_progress(logger: Any) -> None:
    """Write what a training says to standard error."""
    import logging

    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)


def export(options: argparse.Namespace) -> int:
    """Run the policy and write its episodes."""
    import logging

    from pushplan.evaluation import parse_policy
    from pushplan.imports.on_demand import need
    from pushplan.training.policies.config import config_named, read_config
    from pushplan.training.policies.dataset import METADATA, read_metadata, record, to_minari
    from pushplan.world import InvalidInputError

    check_directory(options.out, "data set", METADATA)
    if options.minari is not None:
        need("minari")
        need("h5py")
    _show_progress(logging.getLogger("pushplan.training"))
    given = options.config
    if given is None:
        config = config_named(options.task, "bc")
    else:
        config = read_config(given)
    if config.task != options.task:
        raise InvalidInputError(f"{given} is for task {config.task!r}, not {options.task!r}")
    spec = parse_policy(options.policy)
    more: dict[str, Any] = {"sources": [spec.identity]}
    if options.first_seed is not None:
        more["first_seed"] = options.first_seed
    if options.driver is not None:
        driver = parse_policy(options.driver)
        more["driver"] = driver.make()
        more["driver_label"] = driver.label
        more["sources"].append(driver.identity)
    try:
        folder = record(
            config,
            spec.make(),
            spec.label,
            options.out,
            episodes=options.episodes,
            noise=options.noise,
            hold=options.hold,
            afresh=options.afresh,
            hindsight=options.hindsight,
            **more,
        )
    except KeyboardInterrupt:
        sys.stderr.write(f"stopped; the same command goes on with the data set in {options.out}\n")
        raise
    about = read_metadata(folder)
    say(
        f"wrote {folder}: {about['total_episodes']} episodes, {about['total_steps']} steps, "
        f"{about['successes']} successes"
    )
    if options.minari is not None:
        to_minari(folder, options.minari)
        say(f"made the Minari data set {options.minari}")
    return 0


def describe(options: argparse.Namespace) -> int:
    """Describe the environment of a scenario."""
    from pushplan import learned
    from pushplan.envs import make
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
    observation = options.observation
    if observation == "features":
        observation = learned.FeatureObservation()
    env = make(scenario_of(options), observation=observation, action=options.action)
    facts = {}
    if options.algorithm is not None:
        facts["algorithm"] = options.algorithm
    specification = learned.describe(env, repeat=options.repeat, training=facts)
    env.close()
    if options.model is None:
        say(json.dumps(json.loads(specification.to_json()), indent=1))
    else:
        say(f"wrote {write_beside(options.model, specification)}")
    return 0
