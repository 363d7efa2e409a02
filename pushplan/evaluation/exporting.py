"""All rows of a run as one file for other tools."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from pushplan.evaluation.rows import columns, rows_csv
from pushplan.evaluation.run_record import RunRecord
from pushplan.world import InvalidInputError
from pushplan.world.libraries import need
from pushplan.world.output_files import write_atomic


def export(run: RunRecord, path: Path) -> None:
    """Write the rows; see `Results.export`."""
    if path.suffix not in (".csv", ".parquet"):
        raise InvalidInputError(f"rows are written as .csv or .parquet, got {path.name!r}")
    if not path.absolute().parent.is_dir():
        raise InvalidInputError(f"there is no folder {path.parent} for {path.name!r}")
    more = {name: [run.measured.get(row.job, {}).get(name) for row in run.rows] for name in
            run.about.get("metrics", [])}  # fmt: skip
    write_atomic(path, rows_csv(run.rows, more).encode() if path.suffix == ".csv" else
                 _parquet(run, more))  # fmt: skip


def _parquet(run: RunRecord, more: dict[str, list[Any]]) -> bytes:
    arrow, parquet = need("pyarrow"), need("pyarrow.parquet")
    named = {name: [getattr(row, name) for row in run.rows] for name in columns()}
    buffer = io.BytesIO()
    parquet.write_table(arrow.table({**named, **more}), buffer)
    return buffer.getvalue()
