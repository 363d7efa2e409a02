"""Pages that are made from the code when the site is built."""

from __future__ import annotations

import argparse
import inspect
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import parameters
import public_names

from pushplan.cli.parser import build_parser

if TYPE_CHECKING:
    from docutils.nodes import Element

_SCORES = re.compile(r"^(?=\| suite \| )", re.MULTILINE)
_LINK_UP = re.compile(r"\[([^\]]*)\]\((\.\./[^)#]+)(?:#[^)]*)?\)")


def write_pages(folder: Path) -> None:
    """Write all of them; a page that is as it was keeps its time stamp."""
    pages = {"parameters.md": parameter_page(), "command-line.md": command_page()}
    for package in public_names.packages():
        pages[f"api/{package}.rst"] = api_page(package)
    pages["api/index.md"] = api_index()
    for name, text in pages.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")
    for path in folder.rglob("*.*"):
        if str(path.relative_to(folder)) not in pages:
            path.unlink()


def api_index() -> str:
    """The page that the pages of packages hang on."""
    lines = ["# Python API", "", "Every public name of every package, from its docstring.", ""]
    lines += ["```{toctree}", ":maxdepth: 1", "", *public_names.packages(), "```"]
    return "\n".join(lines) + "\n"


def api_page(package: str) -> str:
    """The public names of a package; those that belong to another one as links."""
    title = f"pushplan.{package}"
    lines = [title, "=" * len(title), "", f".. automodule:: {title}", "   :no-members:", ""]
    lines += [f".. currentmodule:: {title}", ""]
    elsewhere = []
    for name in public_names.names_of(package):
        home = public_names.homes()[name]
        if home != package:
            elsewhere.append(f"* :py:obj:`~pushplan.{home}.{name}`")
            continue
        directive = public_names.directive_of(public_names.value_of(package, name))
        lines += [f".. {directive}:: {name}", ""]
        if directive == "data":
            said = public_names.comment_on(package, name).splitlines()
            lines += [*(f"   {line}" for line in said), ""]
    if elsewhere:
        lines += ["Also here:", "", *elsewhere, ""]
    return "\n".join(lines)


def parameter_page() -> str:
    """One table of every parameter of every planner."""
    lines = [
        "---",
        "hide-toc: true",
        "---",
        "",
        "<style>.content { width: auto; max-width: 72em; flex: 1; padding: 0 2em; }</style>",
        "",
        "# Parameters",
        "",
        "Every parameter of every planner, policy and controller, from the dataclasses that hold "
        "them. `make_planner(NAME, parameter=value)` and `make_policy` change those of the class "
        "that the name uses; so do experiment files, and `--set` of `pushplan serve`. Values out "
        "of the range are refused. Where no unit is given, a number has none, or the class says "
        "in what all its lengths are.",
        "",
        "| class | what it is | used by |",
        "|---|---|---|",
    ]
    kinds = parameters.classes()
    for kind in kinds:
        about = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0]
        users = ", ".join(f"`{name}`" for name in parameters.users(kind))
        link = f'<a href="#{_anchor(kind)}">{kind.__name__}</a>'
        lines.append(f"| {link} | {_cell(about)} | {users} |")
    lines += ["", "## Names that change defaults", "", "| name | values |", "|---|---|"]
    for name, given in parameters.changes().items():
        values = ", ".join(f"`{key}={value}`" for key, value in given.items())
        lines.append(f"| `{name}` | {values} |")
    lines += ["", "## All of them", "", "| class | parameter | default | unit | what | valid |"]
    lines.append("|---|---|---|---|---|---|")
    for kind in kinds:
        for index, one in enumerate(parameters.parameters(kind)):
            owner = f"`{kind.__name__}`"
            target = "" if index else f'<span id="{_anchor(kind)}"></span>'
            cells = (f"`{_cell(one.default)}`", one.unit, one.text, one.valid)
            lines.append(
                f"| {target}{owner} | `{one.name}` | " + " | ".join(map(_cell, cells)) + " |"
            )
    return "\n".join(lines) + "\n"


def _anchor(kind: type) -> str:
    return f"parameters-of-{kind.__name__.lower()}"


def _cell(text: str) -> str:
    text = " ".join(text.replace("``", "`").split())
    return text.replace("|", "\\|").replace("<", "&lt;") if not text.startswith("`") else text


def command_page() -> str:
    """The command line, from its parsers."""
    parser = build_parser()
    (commands,) = (one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
    summaries = {one.dest: one.help for one in commands._choices_actions}
    lines = ["# Command line", "", str(parser.description), ""]
    lines += ["| command | what it does |", "|---|---|"]
    lines += [f"| [`{name}`](#pushplan-{name}) | {text} |" for name, text in summaries.items()]
    lines += ["", "## Exit codes", "", "| code | means |", "|---|---|"]
    codes = str(parser.epilog).partition("exit codes:\n")[2]
    lines += [f"| {code} | {text} |" for code, text in re.findall(r"^  (\d+) +(.*)$", codes, re.M)]
    waiting = list(commands.choices.items())
    while waiting:
        name, one = waiting.pop(0)
        below = [a for a in one._actions if isinstance(a, argparse._SubParsersAction)]
        waiting = [
            (f"{name} {word}", leaf) for a in below for word, leaf in a.choices.items()
        ] + waiting
        lines += ["", f"## pushplan {name}", "", str(one.description)]
        lines += [] if below else ["", *_options(one)]
        lines += ["", "```text", str(one.epilog).rstrip(), "```"]
    return "\n".join(lines) + "\n"


def _options(parser: argparse.ArgumentParser) -> list[str]:
    formatter = parser._get_formatter()
    lines = ["| argument | what it is |", "|---|---|"]
    for action in parser._actions:
        if action.help is argparse.SUPPRESS or isinstance(action, argparse._HelpAction):
            continue
        text = formatter._expand_help(action) if action.help else ""
        if action.option_strings:
            value = (
                ""
                if action.nargs == 0
                else " " + formatter._format_args(action, action.dest.upper())
            )
            words = ", ".join(f"`{option}{value}`" for option in action.option_strings)
        else:
            words = f"`{formatter._format_args(action, action.dest)}`"
        needed = "required; " if action.required and action.option_strings else ""
        lines.append(f"| {words.replace('|', chr(92) + '|')} | {needed}{_cell(text)} |")
    return lines


SOUGHT = {
    "rl": ("reinforcement learning", "Gymnasium", "Stable-Baselines3", "SB3", "PPO"),
    "ros2": ("ROS 2", "Nav2"),
    "cpp": ("C++",),
    "paper": ("LaTeX",),
    "extending": ("own planner", "own task", "own robot", "custom planner", "custom task"),
    "evaluation": ("own worlds",),
    "world-file": ("goal pose", "places of objects"),
}
"""Page -> what the search answers with that page first, whatever else has the words."""


def prepare(app: Any, name: str, source: list[str]) -> None:
    """Show links to what has no page as text; add classes of tables and entries of the index."""
    root = Path(app.srcdir) / Path(name).parent

    def shown(found: re.Match[str]) -> str:
        return found[1] if (root / found[2]).is_dir() or found[2].endswith(".md") else found[0]

    if not name.startswith("generated/"):
        source[0] = _LINK_UP.sub(shown, source[0])
        source[0] = _SCORES.sub("{.scores}\n", source[0])
        title, rest = source[0].split("\n", 1)
        entries = (f"```{{index}} ! {entry}\n```\n" for entry in SOUGHT.get(name, ()))
        source[0] = f"{title}\n\n{''.join(entries)}{rest}"


def resolve(app: Any, env: Any, node: Element, contnode: Element) -> Element | None:
    """Find the page of a public name that is written without its package, or by its module."""
    if node.get("refdomain") != "py":
        return None
    parts = str(node["reftarget"]).split(".")
    for index, part in enumerate(parts):
        if (home := public_names.homes().get(part)) is not None:
            target = ".".join(["pushplan", home, *parts[index:]])
            domain = env.get_domain("py")
            where = (env, node["refdoc"], app.builder, "obj", target, node, contnode)
            return domain.resolve_xref(*where)
    return None
