"""The structure of the package in figures: size, imports between families, circles.

    python -m benchmarks.structure [PACKAGE_FOLDER ...] [--check]

Reads source code only. Given the folders of two versions it prints a column for each. With
``--check`` it fails where a figure is above its limit in ``reference/structure.yaml``, and where a
limit is higher than in any earlier commit. The *lines of the package* are those of all files that
git does not ignore: Python, stubs, tables and page files in ``pushplan/``, C++ and bindings in
``core/`` without its tests. ``later rises`` in that file are lines that planned features may still
take: a feature moves its entry into ``lines of the package``, so that the sum never grows.

A *node* is one of Python's syntax tree: neither comments nor the layout of lines change their
number. A *name imported between families* is one name in an import statement from one planner
family in another; files directly in ``planners/`` are the room's doors and belong to no family. A
*circle* is a set of modules that import each other in a loop, imports inside functions counted too.
A conditional expression is *long* if it holds another one, spans lines or has over 60 characters.
*Public names* are classes and functions at the top of modules; *numeric constants* are assignments
of numbers, or of arithmetic on numbers, there.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx as nx
import yaml

from benchmarks.reporting import command_line

LONGEST_CHOICE = 60
"""Characters of a conditional expression that is read at a glance."""
ROOT = Path(__file__).resolve().parent.parent
LIMITS = ROOT / "benchmarks" / "reference" / "structure.yaml"
TOTAL = "lines of the package"
COUNTED = {
    "pushplan": ("py", "pyi", "toml", "yaml", "yml", "json", "js", "css", "html"),
    "core": ("cpp", "hpp", "c", "h"),
}
"""Endings of the files whose lines make up the total, by folder."""
PREPOSITIONS = (
    "of for from until by in on at to with without over under after before whose that which"
)
NUMBERS = (ast.Constant, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop)
"""Kinds of nodes in a value that is made of numbers alone."""


@dataclass(frozen=True)
class Module:
    """One source file, read."""

    name: str
    text: str
    tree: ast.Module

    @property
    def lines(self) -> int:
        """Lines of the file."""
        return self.text.count("\n")

    @property
    def nodes(self) -> int:
        """Nodes of its syntax tree."""
        return sum(1 for _ in ast.walk(self.tree))

    @property
    def family(self) -> str | None:
        """Planner family that it belongs to."""
        parts = self.name.split(".")
        return parts[2] if parts[1:2] == ["planners"] and len(parts) > 3 else None


def read(folder: Path) -> list[Module]:
    """All modules of a package."""
    found = []
    for file in sorted(folder.rglob("*.py")):
        parts = file.relative_to(folder.parent).with_suffix("").parts
        package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if package else parts)
        if package and parts[1:2] == ("planners",) and len(parts) == 4:
            name += ".__init__"  # the face of a family belongs to it
        text = file.read_text()
        found.append(Module(name, text, ast.parse(text)))
    return found


def imported(module: Module, root: str) -> Iterator[tuple[str, str]]:
    """(module, name) of each name that a module imports from its own package."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == root:
            for alias in node.names:
                yield str(node.module), alias.name


def packed_assignments(module: Module) -> int:
    """Assignments of several values in one statement; only a swap needs one."""
    return sum(
        isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Tuple)
        and any(isinstance(target, ast.Tuple) for target in node.targets)
        for node in ast.walk(module.tree)
    )


def long_choices(module: Module) -> int:
    """Conditional expressions that are no short choice between two short values."""
    choices = [node for node in ast.walk(module.tree) if isinstance(node, ast.IfExp)]
    return sum(
        one.lineno != one.end_lineno
        or len(ast.unparse(one)) > LONGEST_CHOICE
        or any(isinstance(node, ast.IfExp) for node in ast.walk(one) if node is not one)
        for one in choices
    )


def circles(modules: list[Module], root: str) -> list[list[str]]:
    """Sets of modules that import each other in a loop."""
    names = {module.name.removesuffix(".__init__") for module in modules}
    graph: nx.DiGraph[str] = nx.DiGraph()
    for module in modules:
        here = module.name.removesuffix(".__init__")
        for source, name in imported(module, root):
            there = f"{source}.{name}" if f"{source}.{name}" in names else source
            if there in names and there != here and not here.startswith(f"{there}."):
                graph.add_edge(here, there)
    return [sorted(found) for found in nx.strongly_connected_components(graph) if len(found) > 1]


def between_families(modules: list[Module], root: str) -> Counter[tuple[str, str]]:
    """Names that one planner family imports from another."""
    found: Counter[tuple[str, str]] = Counter()
    families = {module.family for module in modules} - {None}
    for module in modules:
        for source, name in imported(module, root):
            parts = [*source.split("."), name]
            there = parts[2] if parts[1:2] == ["planners"] and len(parts) > 2 else None
            if module.family and there in families and there != module.family:
                found[module.family, str(there)] += 1
    return found


def mechanisms(modules: list[Module], folder: Path) -> dict[str, int]:
    """How many there are of what a package needs one of, found by what the code calls and names."""
    rules = yaml.safe_load(LIMITS.read_text())["mechanisms"]
    classes = [n for m in modules for n in ast.walk(m.tree) if isinstance(n, ast.ClassDef)]
    functions = [n for m in modules for n in ast.walk(m.tree) if isinstance(n, ast.FunctionDef)]
    found = {}
    for name, rule in rules.items():
        if "calls" in rule:
            calls = set(rule["calls"])
            found[name] = sum(_loops_over(function, calls) for function in functions)
        else:
            kinds = classes if rule["kind"] == "class" else functions
            found[name] = sum(re.search(rule["name"], one.name) is not None for one in kinds)
    configs = [one for one in classes if one.name.endswith("Config")]
    found["fields of configurations"] = sum(
        isinstance(line, ast.AnnAssign) and "ClassVar" not in ast.unparse(line.annotation)
        for config in configs
        for line in config.body
    )
    options = folder / "cli" / "commands.toml"
    if options.is_file():
        found["options of the command line"] = _options(tomllib.loads(options.read_text()))
    return found


def _loops_over(function: ast.FunctionDef, calls: set[str]) -> bool:
    """True if one of the functions is called in a loop."""
    for loop in ast.walk(function):
        if isinstance(loop, ast.While | ast.For):
            for node in ast.walk(loop):
                if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in calls:
                    return True
    return False


def _options(value: Any) -> int:
    """Keys of a table of commands that are options."""
    if isinstance(value, dict):
        return sum(key.startswith("-") for key in value) + sum(map(_options, value.values()))
    return sum(map(_options, value)) if isinstance(value, list) else 0


def git(folder: Path, *arguments: str) -> str:
    """Output of a command of git in a folder.

    Raises:
        SystemExit: if git fails there, with what it says.
    """
    done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"lines and limits are compared by git: {done.stderr.strip()}")
    return done.stdout


def package_lines(top: Path) -> int:
    """Lines of the package and its core in all languages, of files that git does not ignore."""
    total = 0
    for folder, endings in COUNTED.items():
        names = git(top, "ls-files", "-z", "--cached", "--others", "--exclude-standard", folder)
        for name in set(names.split("\0")) - {""}:
            file = top / name
            counted = file.suffix[1:] in endings and not name.startswith("core/tests/")
            if counted and file.is_file():
                total += file.read_bytes().count(b"\n")
    return total


def numeric_constants(module: Module) -> int:
    """Assignments of numbers at the top of a module."""
    return sum(
        isinstance(line, ast.Assign | ast.AnnAssign)
        and line.value is not None
        and all(
            isinstance(node, NUMBERS)
            and isinstance(getattr(node, "value", 0), int | float)
            and not isinstance(getattr(node, "value", 0), bool)
            for node in ast.walk(line.value)
        )
        for line in module.tree.body
    )


def public_names(module: Module) -> int:
    """Classes and functions at the top of a module whose names do not begin with an underscore."""
    kinds = ast.ClassDef | ast.FunctionDef
    return sum(isinstance(line, kinds) and line.name[0] != "_" for line in module.tree.body)


def hanging_comments(module: Module) -> int:
    """Comments that begin with a preposition or a relative, so that they hang on the code."""
    hanging = re.compile(rf"#\s*({PREPOSITIONS.replace(' ', '|')})\b")
    tokens = tokenize.generate_tokens(io.StringIO(module.text).readline)
    return sum(one.type == tokenize.COMMENT and bool(hanging.match(one.string)) for one in tokens)


def python_lines(folder: Path) -> str:
    """Lines of all Python files below a folder."""
    return str(sum(file.read_bytes().count(b"\n") for file in folder.rglob("*.py")))


def measure(folder: Path) -> tuple[dict[str, str], list[str]]:
    """Figures of one package, and what stands behind them in words."""
    modules = read(folder)
    root = folder.name
    crossing = between_families(modules, root)
    loops = circles(modules, root)
    rooms = Counter[str]()
    nodes = Counter[str]()
    for module in modules:
        room = module.name.split(".")[1] if "." in module.name else root
        rooms[room] += module.lines
        nodes[room] += module.nodes
    figures = {
        TOTAL: str(package_lines(folder.parent)),
        "syntax nodes": str(nodes.total()),
        "lines of Python": str(rooms.total()),
        "lines of tests": python_lines(folder.parent / "tests"),
        "lines of benchmarks": python_lines(folder.parent / "benchmarks"),
        "numeric constants": str(sum(map(numeric_constants, modules))),
        "public names": str(sum(map(public_names, modules))),
        "comments that begin with a preposition": str(sum(map(hanging_comments, modules))),
        "files": str(len(modules)),
        "longest file": str(max(module.lines for module in modules)),
        "files over 300 lines": str(sum(module.lines > 300 for module in modules)),
        "names imported between planner families": str(sum(crossing.values())),
        "circles": str(len(loops)),
        "assignments of a tuple to a tuple": str(sum(map(packed_assignments, modules))),
        "long conditional expressions": str(sum(map(long_choices, modules))),
    }
    figures |= {name: str(count) for name, count in mechanisms(modules, folder).items()}
    for room, lines in sorted(rooms.items()):
        figures[f"{room}: syntax nodes"] = str(nodes[room])
        figures[f"{room}: lines"] = str(lines)
    words = [f"{a} takes {count} names from {b}" for (a, b), count in sorted(crossing.items())]
    return figures, [*words, *("circle: " + ", ".join(loop) for loop in loops)]


def limits_of(text: str) -> dict[str, int]:
    """Limits of a file of them by name; that of the total with the rises that may still follow."""
    read = yaml.safe_load(text)
    limits = {name: rule["most"] for name, rule in read["mechanisms"].items()} | read["most"]
    limits["the total with its later rises"] = limits[TOTAL] + sum(read["later rises"].values())
    return limits


def raised_limits() -> list[str]:
    """Limits that are higher than in an earlier commit, or that are gone."""
    if git(ROOT, "rev-parse", "--is-shallow-repository").strip() == "true":
        return ["earlier limits are not known: fetch the whole history (git fetch --unshallow)"]
    file = LIMITS.relative_to(ROOT).as_posix()
    now = limits_of(LIMITS.read_text())
    found = set()
    for commit in git(ROOT, "log", "--format=%H", "--", file).split():
        text = git(ROOT, "show", f"{commit}:{file}")
        if TOTAL not in text:  # limits could be waived up to version 0.3.0
            continue
        for name, limit in limits_of(text).items():
            if name != TOTAL and now.get(name, limit + 1) > limit:
                found.add(f"the limit of {name}: {now.get(name, 'gone')}, it was {limit}")
    return sorted(found)


def breaches(figures: dict[str, str]) -> list[str]:
    """Figures above their limits, and limits that were raised."""
    found = raised_limits()
    for name, limit in limits_of(LIMITS.read_text()).items():
        if name in figures and int(figures[name]) > limit:
            found.append(f"{name}: {figures[name]}, at most {limit}")
    return found


def main() -> int:
    """Print the table, and look at the limits."""
    parser = command_line(__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[ROOT / "pushplan"])
    parser.add_argument("--check", action="store_true", help="fail where a limit is broken")
    options = parser.parse_args()
    folders = options.folders
    measured = [measure(folder.resolve()) for folder in folders]
    rows = dict.fromkeys(key for figures, _ in measured for key in figures)
    width = max(len(row) for row in rows)
    for row in rows:
        print(row.ljust(width), *(figures.get(row, "-").rjust(8) for figures, _ in measured))
    for folder, (_, words) in zip(folders, measured, strict=True):
        print(
            f"\n{folder}:", *(words or ["nothing crosses between families, no circles"]), sep="\n  "
        )
    broken = breaches(measured[-1][0]) if options.check else []
    for line in broken:
        print(f"above its limit: {line}")
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
