"""The results of a run, read back from its directory."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from pushplan.evaluation.statistics.summary import (
    PairedDifference,
    PolicySummary,
    natural,
    paired_differences,
    policies_of,
    settings_of,
    summarise,
)
from pushplan.evaluation.store.rows import ResultRow, columns
from pushplan.evaluation.store.run_directory import open_results
from pushplan.world import Episode


@dataclass(frozen=True)
class StoredRun:
    """The rows of a run, its recorded episodes, and what they say about its policies."""

    rows: tuple[ResultRow, ...]  # by the titles of their settings, otherwise as given
    # configuration, policies and titles of the settings
    about: Mapping[str, Any] = field(default_factory=dict)
    path: Path | None = None  # the run directory; None for rows that come from elsewhere
    # job -> value by name of metrics that are no columns
    measured: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        place = {setting: natural(title) for setting, title in self.titles.items()}
        rows = sorted(self.rows, key=lambda row: place[row.setting])
        object.__setattr__(self, "rows", tuple(rows))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what the last command on a run directory asked for; all of one that was merged.

        Raises:
            InvalidInputError: if it holds no results.
        """
        rows, about, measured = open_results(path)
        return cls(tuple(rows), about, Path(path), measured)

    @property
    def policies(self) -> list[str]:
        """Labels, in the order in which they were given."""
        return policies_of(self.rows, list(self.about.get("policies", {})))

    @property
    def titles(self) -> dict[str, str]:
        """Words for each setting."""
        known = self.about.get("settings", {})
        return {setting: known.get(setting, setting) for setting in settings_of(self.rows)}

    @property
    def remarks(self) -> list[str]:
        """Lines about results that are not among the rows: of pending jobs and other calls."""
        lines = []
        jobs = self.about.get("jobs")
        if isinstance(jobs, int) and jobs > len(self.rows):
            lines.append(f"{jobs - len(self.rows)} of {jobs} jobs have no result yet")
        if others := self.about.get("left_out"):
            listed = ", ".join(f"{count} of {policy}" for policy, count in others.items())
            what = f"results that the last command did not ask for: {listed}"
            lines.append(f"{self.path} also holds {what}; a command that asks for them shows them")
        return lines

    @functools.cached_property
    def pooled(self) -> Self:
        """The rows of all settings as one setting."""
        title = f"All {len(self.titles)} settings together"
        rows = tuple(replace(row, pool=title) for row in self.rows)
        return replace(self, rows=rows, about={**self.about, "settings": {}})

    @property
    def measured_columns(self) -> dict[str, list[float | None]]:
        """Metrics that are no columns: name -> value of each row, None where it has none."""
        return {
            name: [self.measured.get(row.job, {}).get(name) for row in self.rows]
            for name in self.about.get("metrics", ())
            if name not in columns()
        }

    def rows_of(self, setting: str) -> list[ResultRow]:
        """The rows of one setting."""
        return [row for row in self.rows if row.setting == setting]

    def policies_in(self, setting: str) -> dict[str, int]:
        """Labels of the policies that ran in a setting -> their places in `policies`."""
        ran = {row.policy for row in self.rows_of(setting)}
        return {label: place for place, label in enumerate(self.policies) if label in ran}

    def episode(self, row: ResultRow) -> Episode | None:
        """The recorded episode of a row; None if none was kept.

        Raises:
            SchemaError: if it cannot be read.
        """
        if self.path is None or row.trace_file is None:
            return None
        path = self.path / row.trace_file
        return Episode.load(path) if path.is_file() else None

    def summary(self) -> list[PolicySummary]:
        """Summaries of the rows, of each policy in each setting."""
        return list(self._summaries)

    @functools.cached_property
    def _summaries(self) -> list[PolicySummary]:
        return summarise(self.rows, self.policies)

    def compare(self, pairs: str = "first") -> list[PairedDifference]:
        """Paired differences of policies on the same scenarios.

        Args:
            pairs: ``"first"`` for the first policy with each other one, or ``"all"``.
        """
        if pairs not in self._differences:
            self._differences[pairs] = paired_differences(self.rows, self.policies, pairs)
        return list(self._differences[pairs])

    @functools.cached_property
    def _differences(self) -> dict[str, list[PairedDifference]]:
        return {}  # of the calls of `compare` so far
