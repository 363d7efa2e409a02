"""Every import and every dotted name of pushplan in the documentation leads somewhere."""

from __future__ import annotations

import ast
import importlib
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    *ROOT.glob("*.md"),
    *ROOT.glob("docs/*.md"),
    *ROOT.glob("bridges/**/*.md"),
    *ROOT.glob("examples/**/*.py"),
    *ROOT.glob("notebooks/*.ipynb"),
]
CODE = sorted(ROOT.glob("pushplan/**/*.py"))
IMPORT = re.compile(r"\bfrom (pushplan[\w.]*) import (\([^)]*\)|[^\n`]*)")
DOTTED = re.compile(r"(?<![\w./-])pushplan(?:[.:][A-Za-z_]\w*)+(?![\w/])")
FILE = re.compile(r"\.(json|yaml|toml|md)$")


def text_of(page: Path) -> str:
    """What a reader sees; a change log also names what is gone."""
    text = page.read_text("utf-8")
    if page.suffix == ".ipynb":
        return "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    return "" if page.name == "CHANGELOG.md" else text


def docstrings_of(module: Path) -> str:
    """What the reference makes of a module."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    nodes = ast.walk(ast.parse(module.read_text("utf-8")))
    return "\n".join(ast.get_docstring(node) or "" for node in nodes if isinstance(node, kinds))


def names_in(text: str) -> Iterator[str]:
    """Dotted names in a text, and those that its imports make."""
    for package, names in IMPORT.findall(text):
        for name in re.sub(r"#.*", "", names).strip("() \n").split(","):
            if name.strip():
                yield f"{package}.{name.split()[0]}"
    for name in DOTTED.findall(text):
        if not FILE.search(name):
            yield name.replace(":", ".")


def leads_somewhere(name: str) -> bool:
    """Whether a name is a module, or an attribute of one, of a class, or of its instances."""
    if name in ("pushplan.policies", "pushplan.robots", "pushplan.tasks"):  # of entry points
        return True
    parts = name.split(".")
    found: object = importlib.import_module(parts[0])
    for at, part in enumerate(parts[1:], start=1):
        if hasattr(found, part):
            found = getattr(found, part)
        elif part in getattr(found, "__annotations__", ()):
            return True
        else:
            try:
                found = importlib.import_module(".".join(parts[: at + 1]))
            except ImportError as error:
                # a library of an extra that is not installed says nothing about the name
                return bool(error.name) and error.name.partition(".")[0] != "pushplan"
    return True


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_imports_and_names_is_there(page: Path) -> None:
    assert [name for name in set(names_in(text_of(page))) if not leads_somewhere(name)] == []


def test_what_docstrings_name_is_there() -> None:
    names = {name for module in CODE for name in names_in(docstrings_of(module))}
    assert names
    assert [name for name in sorted(names) if not leads_somewhere(name)] == []


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("`from pushplan.runtime import Runner, Gone`", {"pushplan.runtime.Gone"}),
        (
            "from pushplan.world import (\n    World,  # it\n    Gone as G,\n)",
            {"pushplan.world.Gone"},
        ),
        ("see `pushplan.world.World.gone` and pushplan.json", {"pushplan.world.World.gone"}),
        ("`pushplan.gone:Policy`, a `World`", {"pushplan.gone.Policy"}),
    ],
)
def test_a_name_that_is_gone_is_found(text: str, wrong: set[str]) -> None:
    assert {name for name in names_in(text) if not leads_somewhere(name)} == wrong
