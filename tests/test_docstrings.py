"""Docstrings begin with a verb or a noun phrase: "Return True if …", not "Whether …"."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "pushplan"
CLAUSE = re.compile(r"\s*(What|Whether|How|Where|Which)\b")


def noun_clauses(source: str) -> list[int]:
    """Lines of the docstrings, those of attributes included, that begin with a noun clause."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and CLAUSE.match(str(node.value.value))
    ]


def test_no_docstring_begins_with_a_noun_clause() -> None:
    found = [
        f"{file.relative_to(PACKAGE.parent)}:{line}"
        for file in sorted(PACKAGE.rglob("*.py"))
        for line in noun_clauses(file.read_text(encoding="utf-8"))
    ]
    assert not found, "a docstring begins with a verb or a noun phrase:\n" + "\n".join(found)


@pytest.mark.parametrize("first", ["What", "Whether", "How", "Where", "Which"])
@pytest.mark.parametrize(
    "source",
    [
        '"""{} is there."""',
        'def f():\n    """{} is there."""',
        'async def f():\n    """\n    {} is there.\n    """',
        'class C:\n    """{} is there."""',
        'LIMIT = 1.0\n"""{} is there."""',
        'class C:\n    def __init__(self):\n        self.x = 1\n        """{} is there."""',
    ],
)
def test_every_kind_of_docstring_is_looked_at(source: str, first: str) -> None:
    assert len(noun_clauses(source.format(first))) == 1
    assert noun_clauses(source.format("A door that")) == []
