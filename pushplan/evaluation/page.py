"""One page about a run that needs nothing beside it: tables, plots, links to what went wrong."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from pathlib import Path

from pushplan.evaluation.provenance import in_words
from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.run_record import RunRecord
from pushplan.evaluation.tables import Table
from pushplan.world.files import write_atomic

LISTED = 200
"""At most so many rows are listed in full."""

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1b1f24; background: #fff;
       max-width: 68rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin-bottom: .2rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .88rem; }
th, td { padding: .35rem .8rem; text-align: right; border-bottom: 1px solid #e3e6ea;
         vertical-align: top; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
.rows th, .rows td { text-align: left; } .rows td.why { white-space: normal; }
thead th { border-bottom: 2px solid #8b949e; }
td small, p.note, .about { color: #57606a; } p.note { font-size: .82rem; max-width: 50rem; }
figure { margin: 1.5rem 0; } figcaption { font-weight: 600; margin-bottom: .4rem; }
img { max-width: 100%; height: auto; } a { color: #0558b0; }
code { font-size: .85em; }
"""


def write_page(
    run: RunRecord, tables: Sequence[Table], plots: Mapping[str, Path], folder: Path
) -> Path:
    """Write ``report.html`` and return its path.

    Args:
        run: whose page it is.
        tables: tables, scores first.
        plots: caption -> PNG file; the pictures are embedded.
        folder: where the page goes; links are relative to it.
    """
    pairs = [table for table in tables if table.title.startswith("Paired")]
    scores = [table for table in tables if table not in pairs]
    parts = [
        _head(run),
        *(_table(table) for table in scores),
        *(_figure(caption, path) for caption, path in plots.items()),
        *(_table(table) for table in pairs),
        _listing(run),
    ]
    title = html.escape(_title(run))
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>{_STYLE}</style></head>\n<body>\n" + "\n".join(parts) + "\n</body></html>\n"
    )
    path = folder / "report.html"
    write_atomic(path, page.encode())
    return path


def _title(run: RunRecord) -> str:
    name = run.about.get("configuration", {}).get("suite")
    return f"pushplan: {name}" if name else "pushplan: results"


def _head(run: RunRecord) -> str:
    facts = {"episodes": len(run.rows), **run.about.get("configuration", {})}
    text = ", ".join(f"{key} {value}" for key, value in facts.items() if value is not None)
    sources = "".join(
        f"<li><code>{html.escape(label)}</code>: {html.escape(str(source))}</li>"
        for label, source in run.about.get("policies", {}).items()
        if label != source
    )
    return (
        f"<h1>{html.escape(_title(run))}</h1>\n"
        f'<p class="about">{html.escape(text)}. All rows: <a href="results.csv">results.csv</a>.'
        f"</p>" + (f"<ul>{sources}</ul>" if sources else "") + _runs(run)
    )


def _runs(run: RunRecord) -> str:
    """Where the rows come from, a line for each call that ran jobs."""
    lines = "".join(f"<li>{html.escape(in_words(one))}</li>" for one in run.about.get("runs", ()))
    return f'<details class="about"><summary>Runs</summary><ul>{lines}</ul></details>' * bool(lines)


def _table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in table.headings)
    lines = ["<tr>" + "".join(f"<td>{_cell(c)}</td>" for c in row) + "</tr>" for row in table.cells]
    note = f'<p class="note">{html.escape(table.note)}.</p>' if table.note else ""
    return (
        f"<h2>{html.escape(table.title)}</h2>\n"
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead>\n<tbody>'
        + "\n".join(lines)
        + f"</tbody></table></div>{note}"
    )


def _cell(text: str) -> str:
    first, *rest = html.escape(text).split("\n")
    return "<br>".join([first, *(f"<small>{line}</small>" for line in rest)])


def _figure(caption: str, path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    text = html.escape(caption)
    return (
        f"<figure><figcaption>{text}</figcaption>"
        f'<img alt="{text}" src="data:image/png;base64,{data}"></figure>'
    )


def _listing(run: RunRecord) -> str:
    """Jobs that failed, then episodes without success."""
    failed = [row for row in run.rows if row.failed]
    missed = [row for row in run.rows if not row.failed and not row.success]
    if not failed and not missed:
        return "<h2>Failures</h2>\n<p>None: every episode ended in success.</p>"
    chosen = (failed + missed)[:LISTED]
    rows = "\n".join(_row(row, run.path) for row in chosen)
    more = len(failed) + len(missed) - len(chosen)
    rest = f"<p>{more} more are in results.csv.</p>" if more else ""
    return (
        f"<h2>Failures: {len(failed)} failed jobs, {len(missed)} episodes without success</h2>\n"
        '<div class="scroll"><table class="rows"><thead><tr><th>policy</th><th>scenario</th>'
        "<th>seed</th><th>status</th><th>reason</th><th>files</th></tr></thead>\n"
        f"<tbody>{rows}</tbody></table></div>{rest}"
    )


def _row(row: ResultRow, run: Path | None) -> str:
    links = [
        f'<a href="{html.escape(place)}">{word}</a>'
        for word, place in (
            ("trace", row.trace_file),
            ("traceback", f"failures/{row.job}.txt"),
        )
        if run is not None and place is not None and (run / place).is_file()
    ]
    cells = [row.policy, row.scenario, str(row.seed), row.status]
    plain = "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)
    why = html.escape(row.reason)
    return f'<tr>{plain}<td class="why">{why}</td><td>{" ".join(links)}</td></tr>'
