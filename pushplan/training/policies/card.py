"""Model cards, written from the record of a training and from its scores."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pushplan.training.policies.config import IMITATING
from pushplan.training.policies.run import RECORD
from pushplan.world import SchemaError

ScoreRow = Mapping[str, Any]
"""A suite's scores: ``suite``, ``episodes``, ``success`` with ``success_low`` and ``success_high``,
``scores`` (name -> mean, low, high), ``failures`` (reason -> count)."""

_WORDS = {
    "ppo": "PPO (Stable-Baselines3)",
    "sac": "SAC (Stable-Baselines3)",
    "sam": "Spatial action maps, double deep Q-learning",
    "bc": "Behaviour cloning",
    "flow": "Flow matching of chunks of a planner's actions",
}


def write_card(folder: str | Path, scores: Sequence[ScoreRow], path: str | Path) -> Path:
    """Write the model card of a training.

    Raises:
        SchemaError: if the folder holds no finished training.
    """
    try:
        record = json.loads((Path(folder) / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SchemaError(f"{folder} holds no finished training: {error}") from error
    text = "\n".join([*_head(record), *_training(record), *_scores(scores), *_failures(scores)])
    path = Path(path)
    path.write_text(text + "\n", encoding="utf-8")
    return path


def _head(record: Mapping[str, Any]) -> list[str]:
    config = record["config"]
    name = f"{config['task']}, {config['algorithm']}"
    return [
        f"# Model card: {name}",
        "",
        f"{_WORDS[config['algorithm']]} for `{config['task']}` ({config['preset']}, "
        f"{config['simulator']}). Runs on ONNX Runtime: `onnx:FILE`, see docs/learned.md.",
        "",
        f"- Observation: `{json.dumps(config['observation'])}`",
        f"- Action: mode `{config['action']['mode']}`, output `{config['action']['output']}`, each "
        f"decision stands for {config['action']['repeat']} steps.",
        f"- Size: {record['parameters']:,} parameters, {record['bytes']:,} bytes. A decision takes "
        f"{record['observation_ms']:.2g} ms to observe and {record['decision_ms']:.2g} ms in the "
        "network (medians, one thread).",
        "",
    ]


def _training(record: Mapping[str, Any]) -> list[str]:
    config = record["config"]
    hours = record["seconds"] / 3600.0
    start = Path(config["options"].get("start", "")).name
    begin = [f"- Begins with the weights of `{start}`."] if start else []
    lines = [
        "## Training",
        "",
        f"- Data: {_data(record)}",
        *begin,
        f"- {record['steps']:,} {'pairs' if config['algorithm'] in IMITATING else 'decisions'}, "
        f"{hours:.2f} h of training on a {record['hardware']}, seed {config['seed']}.",
        f"- The weights are those after {record['best_steps']:,}: the best in validation on "
        f"{config['validation']} starts that are neither for training nor for scores.",
        f"- Options: `{json.dumps(config['options'])}`",
        f"- Versions: {', '.join(f'{k} {v}' for k, v in record['versions'].items())}.",
        f"- Again: `{record['command']}`",
        "",
    ]
    return lines


def _data(record: Mapping[str, Any]) -> str:
    config = record["config"]
    if config["algorithm"] in IMITATING:
        return "; ".join(map(_dataset, record["data"])) + "."
    drawn = "; ".join(json.dumps(one) for one in config["scenarios"])
    return f"random starts of {drawn}; rewards of the task times {config['reward_scale']:g}."


def _dataset(about: Mapping[str, Any]) -> str:
    if about.get("driver") is None:
        disturbed = f"noise {about['noise']:g}"
    else:
        name = Path(about["driver"]).name
        disturbed = f"`{name}` drives {about['hold']} steps with probability {about['noise']:g}"
    return (
        f"{about['total_episodes']} episodes of `{about['policy']}` ({about['total_steps']:,} "
        f"pairs, {about['successes']} successes, {disturbed})"
    )


def _scores(scores: Sequence[ScoreRow]) -> list[str]:
    lines = ["## Scores", ""]
    if not scores:
        return [*lines, "Not scored.", ""]
    names = list(dict.fromkeys(name for row in scores for name in row["scores"]))
    lines += [
        "Held-out scenarios; means with 95 % intervals, success with Wilson's.",
        "",
        f"| {' | '.join(['suite', 'episodes', 'success', *names])} |",
        "|---" * (len(names) + 3) + "|",
    ]
    for row in scores:
        values = [_interval(row["scores"].get(name)) for name in names]
        success = _interval((row["success"], row["success_low"], row["success_high"]))
        cells = [row["suite"], str(row["episodes"]), success, *values]
        lines.append(f"| {' | '.join(cells)} |")
    return [*lines, ""]


def _failures(scores: Sequence[ScoreRow]) -> list[str]:
    lines = ["## Known failures", ""]
    for row in scores:
        if row["failures"]:
            counts = ", ".join(f"{reason} {count}" for reason, count in row["failures"].items())
            lines.append(f"- {row['suite']}: {counts} of {row['episodes']} episodes.")
    if len(lines) == 2:
        lines.append("- None in the episodes above." if scores else "- Not known yet.")
    lines.append("- Other robots, presets and simulators than those above were not trained for.")
    return lines


def _interval(value: Sequence[float] | None) -> str:
    if value is None:
        return "-"
    mean, low, high = value
    return f"{mean:.3f} [{low:.3f}, {high:.3f}]"
