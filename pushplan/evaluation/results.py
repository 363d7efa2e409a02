"""The results of a run, read back from its directory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pushplan.evaluation.jobs import file_stem
from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.sheets import (
    Sheet,
    differences_csv,
    markdown,
    measured_sheets,
    pair_sheets,
    score_sheets,
    summary_csv,
    text,
)
from pushplan.evaluation.statistics import estimate
from pushplan.evaluation.store import open_results, write_atomic
from pushplan.evaluation.summary import (
    PairedDifference,
    PolicySummary,
    paired_differences,
    policies_of,
    settings_of,
    summarise,
)
from pushplan.metrics import compute
from pushplan.world import Episode, InvalidInputError


@dataclass(frozen=True)
class Results:
    """Rows of a run and what was noted about it.

    Args:
        rows: sorted.
        about: configuration, policies and titles of the settings.
        path: the run directory; None for rows that come from elsewhere.
    """

    rows: tuple[ResultRow, ...]
    about: Mapping[str, Any] = field(default_factory=dict)
    path: Path | None = None

    @classmethod
    def load(cls, path: str | Path) -> Results:
        """Read a run directory.

        Raises:
            InvalidInputError: if it holds no results.
        """
        rows, about = open_results(path)
        return cls(tuple(rows), about, Path(path))

    @property
    def policies(self) -> list[str]:
        """Labels, in the order in which they were given."""
        return policies_of(self.rows, list(self.about.get("policies", {})))

    @property
    def titles(self) -> dict[str, str]:
        """Words for each setting."""
        known = self.about.get("settings", {})
        factor = self.about.get("configuration", {}).get("honest_time")
        mode = "" if factor is None else f", honest time x {factor:g}"
        return {setting: known.get(setting, setting) + mode for setting in settings_of(self.rows)}

    def summary(self) -> list[PolicySummary]:
        """What the rows say about each policy in each setting."""
        return summarise(self.rows, self.policies)

    def compare(self) -> list[PairedDifference]:
        """Paired differences of all policies on the same scenarios."""
        return paired_differences(self.rows, self.policies)

    def measure(self, metrics: Sequence[str]) -> list[Sheet]:
        """Metrics that are no columns, from the stored traces of jobs that did not fail.

        Args:
            metrics: names of `pushplan.metrics`, or functions as ``"module:function"``.

        Raises:
            UnknownNameError: if there is no such metric.
            InvalidInputError: if these results have no run directory.
        """
        if self.path is None:
            raise InvalidInputError("metrics of stored episodes need a run directory")
        values: dict[tuple[str, str, str], list[float]] = {}
        for row in self.rows:
            if row.failed:
                continue
            stem = file_stem(row.policy, row.scenario, row.seed)
            episode = Episode.load(self.path / "episodes" / f"{stem}.npz")
            for name, value in compute(episode, metrics).items():
                values.setdefault((row.setting, row.policy, name), []).append(value)
        estimates = {key: estimate(found) for key, found in values.items()}
        return measured_sheets(estimates, self.policies, metrics, self.titles)

    def sheets(self, *, wide: bool = False) -> list[Sheet]:
        """Scores of the policies, then their paired differences."""
        titles = self.titles
        return [
            *score_sheets(self.summary(), titles, wide=wide),
            *pair_sheets(self.compare(), titles, wide=wide),
        ]

    def table(self, width: int = 160) -> str:
        """Scores and paired differences as text of at most ``width`` characters a line."""
        return text(self.sheets(), width)

    def report(self, out: str | Path | None = None) -> Path:
        """Write ``summary.md``, ``summary.csv``, ``differences.csv``, plots and ``report.html``.

        Args:
            out: folder; the run directory by default.

        Returns:
            The path of the page.
        """
        from pushplan.evaluation.page import write_page
        from pushplan.evaluation.plots import write_plots

        folder = Path(out) if out is not None else self.path or Path()
        folder.mkdir(parents=True, exist_ok=True)
        sheets = self.sheets(wide=True)
        write_atomic(folder / "summary.md", markdown(sheets).encode())
        write_atomic(folder / "summary.csv", summary_csv(self.summary(), self.titles).encode())
        write_atomic(
            folder / "differences.csv", differences_csv(self.compare(), self.titles).encode()
        )
        plots = write_plots(self, folder)
        return write_page(self, sheets, plots, folder)


def compare(rows: Sequence[ResultRow] | Results) -> list[PairedDifference]:
    """Paired differences of all policies on the same scenarios."""
    return rows.compare() if isinstance(rows, Results) else paired_differences(rows)
