"""The numbers of the Bench-Push paper, as data: ``published.yaml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from pushplan.metrics import Role, metric_names
from pushplan.scenarios import suite

SETTINGS = {"paper": "paper", "robot": "paper, physical robot", "code": "the paper's code"}
"""Where a row comes from -> words."""

ENOUGH = 0.9
"""Fraction of successes, or S_manip, from which on a value of I is held against another."""


@dataclass(frozen=True)
class Score:
    """A published number."""

    value: float  # mean, or median
    sd: float | None = None  # standard deviation, if it was given


@dataclass(frozen=True)
class PublishedRow:
    """One policy of the paper."""

    policy: str  # as the paper calls it
    setting: str  # a key of `SETTINGS`
    episodes: int | None  # how many, if known
    scores: Mapping[str, Score]  # ``"success"``, ``"E_nav"``, ... -> number.


@dataclass(frozen=True)
class PublishedTable:
    """What the paper says about the scenes of one suite."""

    suite: str  # of ours that mirrors it
    title: str  # one line
    source: str  # table or figure
    statistic: str  # ``"mean"`` or ``"median"``
    notes: tuple[str, ...]  # what is comparable and what is not
    rows: tuple[PublishedRow, ...]  # none where there is no number

    @property
    def task(self) -> str:
        """Name of the task."""
        return suite(self.suite, episodes=1).scenarios[0].task

    def best(self, name: str) -> float | None:
        """The best published value of a score, without those of the physical robot.

        I counts for who does the task: `ENOUGH`, where the paper says it.
        """
        rows = [row for row in self.rows if row.setting != "robot" and name in row.scores]
        if name.startswith("I_"):
            rows = [
                r for r in rows if "S_manip" not in r.scores or r.scores["S_manip"].value >= ENOUGH
            ]
        return max((row.scores[name].value for row in rows), default=None)


@cache
def published_tables() -> tuple[PublishedTable, ...]:
    """All tables, in the order of the paper."""
    data = yaml.safe_load(Path(__file__).with_name("published.yaml").read_text("utf-8"))
    return tuple(
        PublishedTable(
            **{key: entry[key] for key in ("suite", "title", "source", "statistic")},
            notes=tuple(entry["notes"]),
            rows=tuple(_row(row, entry.get("episodes", {})) for row in entry["rows"]),
        )
        for entry in data["tables"]
    )


def _row(data: Mapping[str, Any], episodes: Mapping[str, int]) -> PublishedRow:
    scores = {}
    for name in ("success", *metric_names(Role.SCORE)):
        if name in data:
            given = data[name]
            scores[name] = Score(*given) if isinstance(given, list) else Score(float(given))
    setting = data.get("setting", "paper")
    return PublishedRow(data["policy"], setting, episodes.get(setting), scores)
