"""Model cards, written from the record of a training and from its scores."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pushplan.imports.on_demand import need
from pushplan.training.policies.training_run import RECORD
from pushplan.world import SchemaError

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
