"""The rows of a run and what was noted about it, as page and plots read them."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.summary import PolicySummary, natural, policies_of, settings_of, summarise
from pushplan.world import Episode


@dataclass(frozen=True)
class RunRecord:
    """Rows of a run and what was noted about it."""

    rows: tuple[ResultRow, ...]  # by the titles of their settings, otherwise as given
    # configuration, policies and titles of the settings
    about: Mapping[str, Any] = field(default_factory=dict)
    path: Path | None = None  # the run directory; None for rows that come from elsewhere
    # job -> value by name of metrics that are no columns
    measured: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = self.about.get("settings", {})
        place = {one: natural(known.get(one, one)) for one in settings_of(self.rows)}
        rows = sorted(self.rows, key=lambda row: place[row.setting])
        object.__setattr__(self, "rows", tuple(rows))

    @property
    def policies(self) -> list[str]:
        """Labels, in the order in which they were given."""
        return policies_of(self.rows, list(self.about.get("policies", {})))

    @functools.cached_property
    def pooled(self) -> Self:
        """The rows of all settings as one setting."""
        title = f"All {len(self.titles)} settings together"
        rows = tuple(replace(row, pool=title) for row in self.rows)
        return replace(self, rows=rows, about={**self.about, "settings": {}})

    @property
    def titles(self) -> dict[str, str]:
        """Words for each setting."""
        known = self.about.get("settings", {})
        return {setting: known.get(setting, setting) for setting in settings_of(self.rows)}

    def rows_of(self, setting: str) -> list[ResultRow]:
        """The rows of one setting."""
        return [row for row in self.rows if row.setting == setting]

    def policies_in(self, setting: str) -> dict[str, int]:
        """Labels of the policies that ran in a setting -> their places in `policies`."""
        ran = {row.policy for row in self.rows_of(setting)}
        return {label: place for place, label in enumerate(self.policies) if label in ran}

    @functools.cached_property
    def summaries(self) -> list[PolicySummary]:
        """What the rows say about each policy in each setting."""
        return summarise(self.rows, self.policies)

    def episode(self, row: ResultRow) -> Episode | None:
        """The recorded episode of a row; None if none was kept.

        Raises:
            SchemaError: if it cannot be read.
        """
        if self.path is None or row.trace_file is None:
            return None
        path = self.path / row.trace_file
        return Episode.load(path) if path.is_file() else None
