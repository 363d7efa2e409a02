"""Tables as Markdown, LaTeX, CSV and text."""

from __future__ import annotations

import io
import itertools
import re
import string
import textwrap
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pushplan.evaluation.report.tables import RUNS_NOTE, Table
from pushplan.evaluation.statistics.summary import PairedDifference, PolicySummary
from pushplan.evaluation.store.rows import csv_text
from pushplan.files.safe_files import read_data

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table as RichTable

TEXT_WIDTH = 345.0
"""Width of the text in the class ``article`` [pt]; most other classes have more."""
_SEPARATION = 3.0  # on either side of a column [pt]
_LETTERS = 26  # on a line of a cell
_LINES = 36  # of a table on a page
_PARTS = 3  # groups of columns on a page
_FLOATS = 10  # tables that LaTeX is given before it has to place them
_LETTER = 4.6  # width of what is not listed [pt]
_BROADEST = 8.0  # width of what is not ASCII, at most [pt]
_WIDTHS = {
    **dict.fromkeys(string.ascii_uppercase, 5.5),
    **dict.fromkeys("mwMW@%&<>=+~", _BROADEST),
    **dict.fromkeys("iljft.,:;'`|!()[]/ -1I", 3.5),
}
"""Widths of letters of 8 pt, never less than they are [pt]."""
_CHARACTERS = read_data(Path(__file__).with_name("latex_symbols.json"))
_SYMBOLS: dict[str, str] = _CHARACTERS["symbols"]
_ACCENTS: dict[str, str] = _CHARACTERS["accents"]


def markdown(tables: Sequence[Table]) -> str:
    """The tables as a Markdown document."""
    blocks = []
    for table in tables:
        lines = [f"## {table.title}", "", _line(table.headings)]
        lines.append(_line(["---"] * len(table.headings)))
        lines += [_line([cell.replace("\n", "<br>") for cell in row]) for row in table.cells]
        if table.note:
            lines += ["", f"{table.note[0].upper()}{table.note[1:]}."]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks) + "\n"


def summary_csv(summaries: Sequence[PolicySummary], titles: dict[str, str]) -> str:
    """One line for each setting, policy and metric, with all digits."""
    lines = []
    for summary in summaries:
        who = {"setting": titles.get(summary.setting, summary.setting), "policy": summary.policy}
        rate = {"mean": summary.success.fraction, **vars(summary.success)}
        lines.append({**who, "metric": "success", **rate})
        lines += [{**who, "metric": name, **vars(one)} for name, one in summary.metrics.items()]
    return _csv("setting,policy,metric,count,mean,sd,median,low,high", lines)


def differences_csv(pairs: Sequence[PairedDifference], titles: dict[str, str]) -> str:
    """One line for each setting, metric and pair of policies, with all digits."""
    names = (
        "setting,metric,first,second,count,mean,sd,median,low,high,better,worse,p_value,"
        "p_corrected,effect,needed,verdict"
    )
    lines = []
    for pair in pairs:
        title = titles.get(pair.setting, pair.setting)
        facts = {**vars(pair), "setting": title, "verdict": pair.verdict}
        lines.append({**facts, **vars(pair.difference)})
    return _csv(names, lines)


def _csv(names: str, lines: Sequence[Mapping[str, object]]) -> str:
    """The values of these names, with commas between them; an empty field for None and NaN."""
    header = names.split(",")
    found = [[line.get(name) for name in header] for line in lines]
    # NaN alone is not equal to itself
    return csv_text(header, [[one if one == one else None for one in line] for line in found])


def print_tables(tables: Sequence[Table], console: Console) -> None:
    """Print tables on a terminal, and below them `RUNS_NOTE` if it belongs to one."""
    for table in tables:
        console.print(rich_table(table))
        console.print()
    if any(RUNS_NOTE in table.note for table in tables):
        console.print(RUNS_NOTE, markup=False, highlight=False)


def rich_table(table: Table) -> RichTable:
    """The table for a terminal."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    rich = RichTable(
        title=Text(table.title),
        box=box.SIMPLE_HEAD,
        show_edge=False,
        title_justify="left",
        padding=(0, 1, 0, 0),
    )
    for i, heading in enumerate(table.headings):
        rich.add_column(Text(heading), justify="left" if i == 0 else "right", no_wrap=i == 0)
    for row in table.cells:
        rich.add_row(*(Text(cell) for cell in row))
    return rich


def text(tables: Sequence[Table], width: int = 160) -> str:
    """The tables as plain text."""
    from rich.console import Console

    console = Console(
        file=io.StringIO(),
        width=width,
        force_terminal=False,
        force_jupyter=False,
        color_system=None,
    )
    with console.capture() as capture:
        print_tables(tables, console)
    return "\n".join(line.rstrip() for line in capture.get().rstrip().splitlines()) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def latex(tables: Sequence[Table]) -> str:
    """The tables as floats, each `TEXT_WIDTH` wide at most.

    A label is ``tab:`` and the words of the caption with hyphens between them, and a number from
    the second of such a name on. Of a table that is wider, the further columns follow below, beside
    the first ones again. A table that is longer than a page goes on in another one.
    """
    blocks = [r"% \usepackage{booktabs}"]
    labels: list[str] = []
    for table in tables:
        keys = 2 if table.headings[1:2] == ("pair",) else 1
        lines = [[_lines(cell) for cell in row] for row in (table.headings, *table.cells)]
        parts = _parts([max(map(_width, column)) for column in zip(*lines, strict=True)], keys)
        beside = [parts[i : i + _PARTS] for i in range(0, len(parts), _PARTS)]
        pages = [(few, rows) for few in beside for rows in _pages(lines[1:], len(few))]
        for number, (few, rows) in enumerate(pages):
            more = " (continued)" if number else ""
            block = [r"\begin{table}", r"\centering\footnotesize"]
            block.append(rf"\setlength{{\tabcolsep}}{{{_SEPARATION:g}pt}}")
            block.append(rf"\caption{{{_breakable(table.title)}{more}}}")
            labels.append(_label(table.title, labels))
            block.append(rf"\label{{tab:{labels[-1]}}}")
            block += [_tabular([lines[0], *rows], part, keys) for part in few]
            if table.note and number == len(pages) - 1:
                block.append(rf"\par\smallskip\raggedright {_breakable(table.note)}.")
            blocks.append("\n".join([*block, r"\end{table}"]))
            if len(blocks) % _FLOATS == 0:
                blocks.append(r"\clearpage")
    return "\n\n".join(blocks) + "\n"


def _label(title: str, taken: Sequence[str]) -> str:
    """Letters and digits of a title, which no document has to escape, and a number if need be."""
    words = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "table"
    numbered = (f"{words}-{number}" for number in itertools.count(2))
    return next(label for label in itertools.chain([words], numbered) if label not in taken)


def _lines(cell: str) -> list[str]:
    spelled = "".join(code if (code := _character(c)).startswith("[U+") else c for c in cell)
    return [part for line in spelled.split("\n") for part in textwrap.wrap(line, _LETTERS) or [""]]


def _width(lines: Sequence[str]) -> float:
    """Width of a column that holds a cell [pt]."""
    widths = [
        sum(_WIDTHS.get(letter, _LETTER if letter.isascii() else _BROADEST) for letter in line)
        for line in lines
    ]
    return max(widths) + 2.0 * _SEPARATION


def _parts(widths: Sequence[float], keys: int) -> list[list[int]]:
    """Columns that fit beside the first ``keys`` ones, group by group."""
    parts = [list(range(keys))]
    for column in range(keys, len(widths)):
        shown = sum(widths[i] for i in parts[-1])
        if shown + widths[column] > TEXT_WIDTH and len(parts[-1]) > keys:
            parts.append(list(range(keys)))
        parts[-1].append(column)
    return parts


def _pages(rows: Sequence[list[list[str]]], parts: int) -> Iterator[Sequence[list[list[str]]]]:
    """The rows of a table, as many at a time as a page has room for."""
    # of the headings
    first = 0
    height = 3 * parts
    for i, row in enumerate(rows):
        lines = parts * max(map(len, row))
        if i > first and height + lines > _LINES:
            yield rows[first:i]
            first = i
            height = 3 * parts
        height += lines
    yield rows[first:]


def _tabular(rows: Sequence[list[list[str]]], columns: Sequence[int], keys: int) -> str:
    """Some columns of rows, the first of which is the heading."""
    head, *body = (" & ".join(_cell(row[i], i < keys) for i in columns) + r" \\" for row in rows)
    body = [f"{{}}{line}" if line.startswith(("[", "*")) else line for line in body]
    sides = "l" * keys + "r" * (len(columns) - keys)
    lines = [rf"\begin{{tabular}}{{{sides}}}", r"\toprule", head, r"\midrule", *body]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}\par\medskip"])


def _cell(lines: Sequence[str], left: bool) -> str:
    if len(lines) == 1:
        return escaped(lines[0])
    # a line that begins with a bracket would be an argument of the line break before it
    joined = r"\\{}".join(map(escaped, lines))
    return rf"\begin{{tabular}}[t]{{@{{}}{'l' if left else 'r'}@{{}}}}{joined}\end{{tabular}}"


def _breakable(text: str) -> str:
    """An escaped text with places to break words at that LaTeX cannot hyphenate, such as names."""
    whole = re.compile(rf"(?=.{{,{_LETTERS}}}$)[(']?[A-Za-z'-]+[).,;:]*")
    pieces = ([word] if whole.fullmatch(word) else textwrap.wrap(word, 8) for word in text.split())
    return " ".join(r"\allowbreak{}".join(map(escaped, words)) for words in pieces)


def escaped(text: str) -> str:
    """A text in ASCII as LaTeX takes it."""
    signed = re.sub(r"(?<![^\s\[])-(?=\d)", "\u2212", text)  # the hyphen of a negative number
    return "".join(map(_character, signed)).replace("--", "-{}-")


def _character(character: str) -> str:
    if character in _SYMBOLS:
        return _SYMBOLS[character]
    if character.isascii():
        return character if character.isprintable() else " "
    if unicodedata.combining(character):
        return ""
    kind, *codes = unicodedata.decomposition(character).split() or [""]
    base, *marks = list(unicodedata.normalize("NFKD", character))
    inner = "".join(map(_character, [base, *marks])) if codes else ""
    if kind in ("<sub>", "<super>"):
        return f"${'_' if kind == '<sub>' else '^'}{{{inner.replace('$', '')}}}$"
    for mark in marks:
        if mark in _ACCENTS:
            inner = rf"\{_ACCENTS[mark]}{{{inner}}}"
    return inner or f"[U+{ord(character):04X}]"
