"""The site: every public name and parameter is in the reference, examples run, links lead on."""

from __future__ import annotations

import doctest
import importlib
import importlib.util
import re
import shlex
import sys
from itertools import groupby
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from pushplan.cli import main
from pushplan.cli.parser import build_parser

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def site() -> ModuleType:
    """What makes the pages; it needs Sphinx only for comments on constants."""
    sys.path.insert(0, str(DOCS / "site"))
    try:
        return importlib.import_module("generate")
    finally:
        sys.path.remove(str(DOCS / "site"))


def test_every_public_name_is_described_once(
    site: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = site.public_names
    monkeypatch.setattr(names, "comment_on", lambda package, name: "")
    pages = {package: site.api_page(package) for package in names.packages()}
    assert {"world", "planners", "envs", "metrics", "scenarios", "evaluation"} <= set(pages)
    for package, page in pages.items():
        for name in names.names_of(package):
            described = [p for p in pages if re.search(rf"^\.\. \w+:: {name}$", pages[p], re.M)]
            assert described == [names.homes()[name]], name
            assert package in described or f"`~pushplan.{described[0]}.{name}`" in page


def test_every_parameter_has_a_line_with_a_text(site: ModuleType) -> None:
    page, read = site.parameter_page(), site.parameters
    for kind in read.classes():
        for one in read.parameters(kind):
            assert one.text, f"{kind.__name__}.{one.name}"
            assert f"`{kind.__name__}` | `{one.name}` | " in page
    assert re.search(r"`KinodynamicRRTConfig` \|", page) and "`RearrangementConfig`" in page
    assert re.search(r"`MppiConfig` \| `stride` \| `0.3` \| R \| .*\| float > 0 \|", page)


def test_every_option_of_the_command_line_has_a_line(site: ModuleType) -> None:
    page = site.command_page()
    for command in ("demo", "bench", "plan"):
        assert f"## pushplan {command}\n" in page
    assert "| `--json` |" in page and "| 130 | interrupted" in page


def test_the_search_has_entries_for_what_users_look_for(site: ModuleType) -> None:
    for page, entries in site.SOUGHT.items():
        source = [(DOCS / f"{page}.md").read_text("utf-8")]
        site.prepare(SimpleNamespace(srcdir=DOCS), page, source)
        first, *rest = source[0].splitlines()
        assert first.startswith("# ")
        shown = [line for line in rest if line.startswith("```{index} ! ")]
        assert shown == [f"```{{index}} ! {entry}" for entry in entries]


def test_every_page_is_in_the_order_of_the_site() -> None:
    listed = set(re.findall(r"^([\w-]+)$", (DOCS / "index.md").read_text("utf-8"), re.MULTILINE))
    assert {path.stem for path in DOCS.glob("*.md")} - {"index"} <= listed


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.stem)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    text = page.read_text("utf-8")
    for link in re.findall(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)", text):
        made = link.startswith("generated/") and "python -m sphinx docs build/site" in text
        assert made or (DOCS / link).exists(), link


def test_installation_is_from_a_clone() -> None:
    """PyPI has no pushplan; ``'pushplan[sim]'`` is what errors say, where it is installed."""
    pages = [ROOT / "README.md", *DOCS.glob("*.md"), *(ROOT / "examples").rglob("*.*")]
    for page in pages:
        text = page.read_bytes().decode("utf-8", "replace")
        assert not re.search(r'pip install (-e )?"?pushplan', text), page.name


@pytest.mark.parametrize(
    "module", ["world.stop", "perception.object_tracker", "evaluation.benchmark"]
)
def test_examples_of_docstrings_run(module: str) -> None:
    found = doctest.testmod(importlib.import_module(f"pushplan.{module}"))
    assert found.attempted and not found.failed


def test_the_start_page_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    text = (DOCS / "start.md").read_text("utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    exec(compile(block, "start.md", "exec"), {})
    for file in re.findall(r"examples/\w+\.\w+", text):
        assert (ROOT / file).is_file(), file
    for command in re.findall(r"^pushplan (?:list|doctor).*$", text, re.MULTILINE):
        assert main(command.split()[1:]) == 0


def test_a_site_that_cannot_be_reached_is_left_out(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("inventories", DOCS / "site" / "inventories.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.reachable({"nobody": "http://127.0.0.1:9/", "other": "file:///none/"}) == {}
    there = f"{tmp_path.as_uri()}/"
    (tmp_path / "objects.inv").write_bytes(b"# Sphinx inventory version 2\n")
    assert module.reachable({"one": there, "other": "file:///none/"}) == {"one": (there, None)}


@pytest.mark.release
@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.stem)
def test_code_blocks_are_python_and_commands_have_their_options(page: Path) -> None:
    parser = build_parser()
    text = page.read_text("utf-8").replace("$part", "1")
    for language, block in re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        if language == "python":
            compile(block, page.name, "exec")
        elif language == "bash":
            block = re.sub(r"\\\n|(?<!\S)#.*", "", block)
            words = shlex.shlex(block, posix=True, punctuation_chars=";<>|&\n")
            words.commenters, words.whitespace = "", " \t"
            words.whitespace_split = True
            for ends, command in groupby(words, lambda word: word[0] in ";<>|&\n"):
                program, *arguments = command
                if program == "pushplan" and not ends:
                    parser.parse_args(arguments)
