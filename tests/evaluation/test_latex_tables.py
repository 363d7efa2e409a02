# ruff: noqa: RUF001
"""Tables for LaTeX: they compile whatever is in them, and fit on a page."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest
from synthetic_rows import many_rows

from pushplan.evaluation.report import table_formats as latex_tables
from pushplan.evaluation.report.table_formats import TEXT_WIDTH, escaped, latex
from pushplan.evaluation.report.tables import AGGREGATE_NOTE, GAP_NOTE, PAIR_NOTE, SCORE_NOTE, Table

ODD = "a\\b~c^d_e&f%g$h#i{j}k|l<m>n±o`p''q\"--?`"
SYMBOLS = "m₀l₀+Σmᵢlᵢ×·−–—…≤≥≈°µμ∞→½²⁻¹√∆ΑΩάςωéüßŁčąøı中文😀ﬁ™„“”‘’§€\u00a0\u200b"
LONG = "a_very_long_policy_name_of_a_sweep@push_weight-0.25@clearance-0.125@x-1"


@pytest.fixture(scope="module")
def tables() -> list[Table]:
    """Every kind of table of a study with many policies of long names, and odd ones."""
    results = many_rows(96, 8)
    for row in results.rows:
        object.__setattr__(row, "policy", f"{LONG[:60]}{row.policy[-1]}")
    notes = (AGGREGATE_NOTE.format(first="a"), GAP_NOTE, PAIR_NOTE, SCORE_NOTE)
    rows = tuple((f"{place}", "[0.1, 0.2]\n[0.3, 0.4]") for place in range(60))
    return [
        *results.tables(settings=True),
        *results.tables(wide=True, settings=True, pairs="all")[:4],
        Table(ODD + SYMBOLS, (ODD, *SYMBOLS), ((SYMBOLS, *SYMBOLS[::-1]),), " ".join(notes)),
        Table("kitchens/" + "x" * 80, ("policy", "values"), rows, ODD),
        Table("nothing", ("policy",), ()),
    ]


def test_a_label_names_each_table_once(tables: list[Table]) -> None:
    labels = re.findall(r"\\label{(.*?)}", latex(tables))
    assert len(set(labels)) == len(labels) == latex(tables).count(r"\caption{")
    assert all(re.fullmatch(r"tab:[a-z0-9-]+", label) for label in labels)
    some = [Table(title, ("policy",), (("a",),)) for title in ("maze, 5 boxes", "maze", "Maze")]
    found = re.findall(r"\\label{(.*?)}", latex([*some, Table("maze 2", ("policy",), ())]))
    assert found == ["tab:maze-5-boxes", "tab:maze", "tab:maze-2", "tab:maze-2-2"]


def test_notes_are_broken_within_names_and_never_within_words() -> None:
    text = latex([Table("rooms", ("policy",), (("straight",),), f"{PAIR_NOTE}; {LONG}")])
    plain, _, name = text.partition("differences hold; ")
    assert r"\allowbreak" not in plain and "correlation" in plain
    assert r"\allowbreak{}" in name


@pytest.mark.parametrize("step", [11, pytest.param(1, marks=pytest.mark.slow)])
def test_the_text_is_ascii_and_every_character_is_there(tables: list[Table], step: int) -> None:
    assert latex(tables).isascii()
    pieces = (r"100 \% of A\_1 \& B\textasciicircum{}2", r"a\textbackslash{}b", r"\{1\}")
    assert tuple(map(escaped, ("100 % of A_1 & B^2", r"a\b", "{1}"))) == pieces
    assert escaped("m₀ l₀ + Σ mᵢ lᵢ") == r"m$_{0}$ l$_{0}$ + $\Sigma$ m$_{i}$ l$_{i}$"
    assert escaped("-0.5 [-1, +2] a-1 x--y") == r"$-$0.5 [$-$1, +2] a-1 x-{}-y"
    assert escaped("½ é ü Λ Ω ς µ ™ 中") == (
        r"1/2 \'{e} \"{u} $\Lambda$ $\Omega$ $\sigma$ $\mu$ $^{TM}$ [U+4E2D]"
    )
    for code in (*range(0x180), *range(0x180, 0x3100, step), *range(0x3100, sys.maxunicode, 997)):
        text = escaped(chr(code))
        assert text.isascii() and text.isprintable(), hex(code)
        assert text.count("{") - text.count(r"\{") == text.count("}") - text.count(r"\}")
        assert (text.count("$") - text.count(r"\$")) % 2 == 0
        if unicodedata.category(chr(code))[0] in "LNPS":
            assert text, hex(code)


def test_columns_agree_and_no_table_is_wider_than_a_page(tables: list[Table]) -> None:
    text = latex(tables)
    blocks = re.findall(r"\\begin{tabular}{([lr]+)}\n(.*?)\n\\end{tabular}", text, re.DOTALL)
    assert len(blocks) > len(tables)
    for columns, body in blocks:
        for line in body.splitlines():
            if line not in (r"\toprule", r"\midrule", r"\bottomrule"):
                assert len(re.findall(r"(?<!\\)&", line)) == len(columns) - 1
    for table in tables:
        lines = [
            [latex_tables._lines(cell) for cell in row] for row in (table.headings, *table.cells)
        ]
        widths = [max(map(latex_tables._width, column)) for column in zip(*lines, strict=True)]
        parts = latex_tables._parts(widths, 1)
        assert all(sum(widths[i] for i in part) <= TEXT_WIDTH for part in parts)
        assert sorted({i for part in parts for i in part}) == list(range(len(widths)))
    assert text.count(r"\begin{table}") == text.count(r"\end{table}")


@pytest.mark.release
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
def test_the_tables_compile_and_nothing_is_cut_off(tables: list[Table], tmp_path: Path) -> None:
    every = [chr(code) for code in range(0x20, 0x2FF0) if unicodedata.name(chr(code), "")]
    lines = [tuple(every[i : i + 12]) for i in range(0, len(every) - 12, 12)]
    symbols = Table("symbols", tuple("abcdefghijkl"), tuple(lines))
    document = "\n".join(
        [
            r"\documentclass{article}",
            r"\usepackage{booktabs}",
            r"\begin{document}",
            latex([*tables, symbols]),
            r"\end{document}",
        ]
    )
    (tmp_path / "study.tex").write_text(document)
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "study.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, timeout=300)
    log = (tmp_path / "study.log").read_text(errors="replace")
    assert done.returncode == 0, log[-2000:]
    assert "Overfull \\hbox" not in log and "Float too large" not in log
    assert (tmp_path / "study.pdf").stat().st_size > 0
