"""The door: train a policy from a configuration, export what comes out, write its card."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import pushplan
from pushplan.drawing.figure import DPI, STYLE, TEXT
from pushplan.imports.on_demand import need
from pushplan.learned.sb3_policy import attach
from pushplan.training.libraries import chosen_device, hardware, parameter_count
from pushplan.training.policies.config import IMITATING, SamOptions, TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.training_run import (
    CHECKPOINT,
    CURVE,
    MODEL,
    PICTURE,
    POLICY,
    RECORD,
    TrainingRun,
    Until,
    train,
)
from pushplan.world import InvalidInputError, SchemaError

ScoreRow = Mapping[str, Any]
"""A suite's scores: ``suite``, ``episodes``, ``success`` with ``success_low`` and ``success_high``,
``scores`` (name -> mean, low, high; of one episode the mean), ``failures`` (reason -> count)."""

_WORDS = {
    "ppo": "PPO (Stable-Baselines3)",
    "sac": "SAC (Stable-Baselines3)",
    "sam": "Spatial action maps, double deep Q-learning (Stable-Baselines3)",
    "bc": "Behaviour cloning",
    "flow": "Flow matching of chunks of a planner's actions",
}


def train_policy(
    config: TrainingConfig,
    folder: str | Path,
    *,
    resume: bool = False,
    device: str = "auto",
    processes: bool = False,
    threads: int = 1,
    data: str | Path | Sequence[str | Path] = (),
    command: str = "",
    until: Until | None = None,
) -> Path | None:
    """Train, and write ``policy.onnx``, ``curve.csv``, ``curve.png`` and ``training.json``.

    Args:
        config: what is trained.
        folder: of the training; also holds its checkpoint.
        resume: go on with what is in the folder.
        device: ``"auto"``, ``"cpu"`` or ``"cuda"``.
        processes: unless it imitates, a process for each environment.
        threads: of PyTorch.
        data: with ``bc`` and ``flow``, the folders of data sets, or one of them.
        command: what the model card says that the training was started with.
        until: asked with the number of chunks that are done; true leaves the training off.

    Returns:
        The network; None if the training was left off before its end.

    Raises:
        InvalidInputError: if something does not fit.
        MissingDependencyError: without the extra ``learn``.
    """
    folders = [data] if isinstance(data, str | Path) else list(data)
    imitates = config.algorithm in IMITATING
    if imitates and not folders:
        raise InvalidInputError(
            f"{config.algorithm} needs a data set (--data DIR): make one with 'pushplan dataset "
            "export'"
        )
    if folders and not imitates:
        raise InvalidInputError(
            f"a data set belongs to {' and '.join(IMITATING)}, not to {config.algorithm}"
        )
    need("torch").set_num_threads(threads)
    device = chosen_device(device)
    run = TrainingRun(folder, config, resume=resume)
    try:
        env = TrainingEnv(config)
        learner = _learner(run, env, folders, device, processes)
        train(run, learner, env, until)
    except InvalidInputError:  # the configuration asks for what cannot be
        run.abandon()
        raise
    learner.close()
    network = learner.policy
    if isinstance(config.options, SamOptions):
        network = network.acting
    elif not imitates:
        network = _saved_actor(run, learner.model, env)
    _draw(run)
    path = None
    if run.done >= run.chunks:
        path = _finish(run, network, env, device, threads, folders, command)
    env.close()
    return path


def _learner(
    run: TrainingRun, env: TrainingEnv, data: Sequence[str | Path], device: str, processes: bool
) -> Any:
    config = run.config
    if config.algorithm in IMITATING:
        from pushplan.training.policies.cloning import Imitator

        return Imitator(config, data, env, device)
    need("stable_baselines3")
    from pushplan.training.policies.sb3_training import Sb3Learner

    learner = Sb3Learner(config, device, processes, run.folder)
    start = getattr(config.options, "start", "")
    if start and not run.path(CHECKPOINT).is_file():
        learner.policy.begin_with(start)
    return learner


def _saved_actor(run: TrainingRun, model: Any, env: TrainingEnv) -> Any:
    """Keep a model of Stable-Baselines3 as it is too, and give its actor alone."""
    from pushplan.training.policies.networks import SquashedActor

    path = run.path(MODEL)
    path.unlink(missing_ok=True)
    model.save(path)
    attach(path, env.specification)
    return SquashedActor(model.policy, len(model.observation_space.shape) == 3)


def _draw(run: TrainingRun) -> None:
    """Draw return and success over decisions, for training and validation."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    points = run.curve
    algorithm = run.config.algorithm
    if not points:
        return
    with rc_context(STYLE):
        figure: Any = Figure(figsize=(TEXT, 2.6), layout="constrained")
        returns, fractions = figure.subplots(1, 2)
        returns.set_ylabel("reward of an episode")
        steps = [point.steps for point in points]
        for axes, name, style, label in (
            (returns, "train_return", ".-", "training"),
            (returns, "valid_return", "o-", "validation"),
            (fractions, "train_success", ".-", "success, training"),
            (fractions, "valid_success", "o-", "success"),
            (fractions, "valid_share", "--", "sub-tasks done"),
        ):
            axes.plot(steps, [getattr(p, name) for p in points], style, label=label, lw=1, ms=3)
        fractions.set_ylim(-0.02, 1.02)
        for axes in (returns, fractions):
            axes.set_xlabel("pairs" if algorithm in IMITATING else "decisions")
            axes.locator_params(axis="x", nbins=6)
            axes.grid(alpha=0.3)
            axes.legend()
        figure.suptitle(f"{run.config.task}, {algorithm}")
    figure.savefig(str(run.path(PICTURE)), dpi=DPI)


def _known(value: float) -> float | None:
    """The value; None in place of NaN, which JSON has no word for."""
    if math.isnan(value):
        return None
    return value


def _finish(
    run: TrainingRun,
    network: Any,
    env: TrainingEnv,
    device: str,
    threads: int,
    data: Sequence[str | Path],
    command: str,
) -> Path:
    from pushplan.training.policies.dataset import read_metadata
    from pushplan.training.policies.export import decision_time, export, observation_time

    libraries = ["torch"]
    if run.config.algorithm not in IMITATING:
        libraries.append("stable_baselines3")
    best = max(run.curve, key=lambda point: (point.rank, point.steps))
    specification = env.specification
    facts = {**specification.training, "best_steps": best.steps}
    path = export(network, replace(specification, training=facts), run.path(POLICY))
    run.record(
        parameters=parameter_count(network),
        bytes=path.stat().st_size,
        decision_ms=1e3 * decision_time(path),
        observation_ms=1e3 * observation_time(env),
        steps=run.curve[-1].steps,
        seconds=run.seconds,
        best_steps=best.steps,
        valid_success=_known(best.valid_success),
        valid_share=_known(best.valid_share),
        hardware=f"{hardware(device)}, {threads} thread{'s' * (threads > 1)}",
        versions={
            "pushplan": pushplan.__version__,
            "Python": platform.python_version(),
            **{name: str(need(name).__version__) for name in libraries},
        },
        command=command,
        data=[read_metadata(folder) for folder in data],
        curve=CURVE,
    )
    return path


def write_card(folder: str | Path, scores: Sequence[ScoreRow], path: str | Path) -> Path:
    """Write the model card of a training.

    Raises:
        SchemaError: if the folder holds no finished training.
        MissingDependencyError: without Jinja2, of the extra ``learn``.
    """
    try:
        record = json.loads((Path(folder) / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SchemaError(f"{folder} holds no finished training: {error}") from error
    cards = need("jinja2").Environment(trim_blocks=True, lstrip_blocks=True)
    cards.filters["json"] = json.dumps
    cards.filters["file_name"] = lambda path: Path(path).name
    template = resources.files("pushplan.training.policies").joinpath("model_card.md")
    text = cards.from_string(template.read_text(encoding="utf-8")).render(
        algorithm=_WORDS[record["config"]["algorithm"]],
        config=record["config"],
        record=record,
        scores=scores,
        names=list(dict.fromkeys(name for row in scores for name in row["scores"])),
    )
    path = Path(path)
    path.write_text(text + "\n", encoding="utf-8")
    return path
