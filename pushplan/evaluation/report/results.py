"""The results of a run, read back from its directory."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pushplan.evaluation.report.table_formats import differences_csv, markdown, summary_csv, text
from pushplan.evaluation.report.tables import (
    Table,
    aggregate_table,
    difference_tables,
    gap_tables,
    measured_tables,
    on_few_lines,
    score_tables,
)
from pushplan.evaluation.statistics.gaps import gaps
from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.evaluation.store.database import DATABASE
from pushplan.evaluation.store.rescoring import metric_label, rescore
from pushplan.evaluation.store.rows import columns, rows_csv
from pushplan.evaluation.store.run_directory import open_results, remove_report
from pushplan.files.output_files import check_folder, write_atomic
from pushplan.imports.on_demand import need
from pushplan.scenarios.known_bounds import known_bounds
from pushplan.world import InvalidInputError, UnknownNameError
from pushplan.world.checks import choice, integer


class Results(StoredRun):
    """Stored run with summaries, paired differences, tables and a report."""

    def measure(self, metrics: Sequence[str]) -> list[Table]:
        """Metrics that are no columns, from the stored episodes of jobs that did not fail.

        They are kept in the run directory, where later reports show them; see `rescore`.

        Args:
            metrics: names of `pushplan.metrics`, or functions as ``"module:function"`` or
                ``"file.py:function"``.

        Raises:
            UnknownNameError: if there is no such metric.
            InvalidInputError: if these results have no run directory, or it holds no episodes.
        """
        if self.path is None:
            raise InvalidInputError("metrics of stored episodes need a run directory")
        done = rescore(self.path, metrics, columns=False)
        measured = Results.load(self.path).measured
        if done.unreadable or not measured:
            raise InvalidInputError(
                f"{self.path} has no readable episode of {len(done.unreadable) or 'any'} jobs"
            )
        names = [metric_label(metric) for metric in metrics]
        return measured_tables(self.rows, measured, names, self.policies, self.titles)

    def tables(
        self, *, wide: bool = False, settings: bool = False, pairs: str = "first"
    ) -> list[Table]:
        """Scores of the policies, their gaps to what is known, then their paired differences.

        Of several settings, the tables of all together come first.

        Args:
            wide: with medians and further columns, for files and pages.
            settings: add the tables of each of several settings.
            pairs: as for `compare`.
        """
        titles = self.titles
        found: list[Table] = []
        if len(titles) > 1:
            found = self.pooled.tables(wide=wide, pairs=pairs)
        if found and not settings:
            return found
        metrics = self.about.get("metrics", [])
        together = aggregate_table(self.rows, self.policies) if wide else None
        return [
            *found,
            *([together] if together else []),
            *score_tables(self.summary(), titles, wide=wide),
            *measured_tables(self.rows, self.measured, metrics, self.policies, titles),
            *gap_tables(gaps(self.rows, self.policies, known_bounds()), titles),
            *difference_tables(self.compare(pairs), titles, wide=wide),
        ]

    def table(self, width: int = 160, *, settings: bool = False, pairs: str = "first") -> str:
        """Scores, paired differences and `remarks` as text.

        Args:
            width: most characters of a line of a table.
            settings: as for `tables`.
            pairs: as for `compare`.
        """
        tables = on_few_lines(self.tables(settings=settings, pairs=pairs))
        return "\n".join([text(tables, width), *self.remarks])

    def figure(self, name: str) -> Any:
        """One figure of the report, to show or to save.

        Args:
            name: ``"intervals"``, ``"tradeoff"``, ``"scores"``, ``"profiles"`` or
                ``"planning_time"``.

        Returns:
            A `matplotlib.figure.Figure`; None if the rows have nothing for it.

        Raises:
            UnknownNameError: if there is no such figure.
            MissingDependencyError: without Matplotlib.
        """
        plots = need("pushplan.evaluation.report.plots")
        if name not in plots.FIGURES:
            raise UnknownNameError("figure", name, plots.FIGURES)
        return plots.draw(self, name)

    def export(self, path: str | Path) -> int:
        """Write all rows, and metrics that are no columns, as CSV or Parquet.

        Args:
            path: ends in ``.csv`` or ``.parquet``.

        Returns:
            How many rows there are.

        Raises:
            InvalidInputError: if the file ends otherwise, or its folder does not exist.
            MissingDependencyError: for Parquet, without PyArrow.
        """
        path = Path(path)
        if path.suffix not in (".csv", ".parquet"):
            raise InvalidInputError(f"rows are written as .csv or .parquet, got {path.name!r}")
        if not path.absolute().parent.is_dir():
            raise InvalidInputError(f"there is no folder {path.parent} for {path.name!r}")
        more = self.measured_columns
        if path.suffix == ".csv":
            data = rows_csv(self.rows, more).encode()
        else:
            named = {name: [getattr(row, name) for row in self.rows] for name in columns()}
            buffer = io.BytesIO()
            table = need("pyarrow").table({**named, **more})
            need("pyarrow.parquet").write_table(table, buffer)
            data = buffer.getvalue()
        write_atomic(path, data)
        return len(self.rows)

    def report(
        self,
        out: str | Path | None = None,
        *,
        replays: str = "embed",
        most: int = 40,
        figures: Sequence[str] = (),
        pairs: str = "first",
    ) -> Path:
        """Write ``report.html``, its figures, the summaries and ``results.csv``, all of these rows.

        Args:
            out: folder; the run directory by default.
            replays: ``"embed"`` in the page, ``"beside"`` it as files, or ``"none"``.
            most: how many episodes have a replay: whole scenarios, those with failures first.
            figures: formats to write the figures in beside SVG: ``"pdf"``, ``"png"``.
            pairs: as for `compare`.

        Returns:
            The path of the page.

        Raises:
            InvalidInputError: if the folder is the directory of a run with other rows.
            MissingDependencyError: without Matplotlib and Jinja.
        """
        from pushplan.evaluation.report.page import PAGE, REPLAYS, is_page, write_page

        plots = need("pushplan.evaluation.report.plots")
        choice("replays", replays, REPLAYS)
        integer("most", most, low=0)
        for ending in figures:
            choice("figures", f".{ending}", need("pushplan.drawing.figure").FORMATS)
        compared = self.compare(pairs)
        folder = Path(out) if out is not None else self.path or Path()
        if not is_page(folder / PAGE):
            check_folder(folder, "run directory", DATABASE)
        there = set(self.rows)
        if os.path.lexists(folder / DATABASE):
            there = set(open_results(folder)[0])
        if there != set(self.rows):
            raise InvalidInputError(
                f"{folder} is the directory of a run with {len(there)} rows, which are not the "
                f"{len(self.rows)} of these results: report to another folder, or report that run "
                f"with Results.load({str(folder)!r}).report()"
            )
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / DATABASE).is_file() or (folder / PAGE).is_file():
            remove_report(folder)
        write_atomic(folder / "results.csv", rows_csv(self.rows).encode())
        tables = self.tables(wide=True, settings=True, pairs=pairs)
        lines = [markdown(tables), *self.remarks]
        write_atomic(folder / "summary.md", "\n".join(lines).encode())
        write_atomic(folder / "summary.csv", summary_csv(self.summary(), self.titles).encode())
        if len(self.titles) > 1:
            compared = [*self.pooled.compare(pairs), *compared]
        write_atomic(folder / "differences.csv", differences_csv(compared, self.titles).encode())
        drawn = plots.write_plots(self, folder, figures)
        return write_page(self, tables, drawn, folder, replays=replays, most=most)
