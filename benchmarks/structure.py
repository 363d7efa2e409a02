"""The structure of the package in figures: size, imports between families, circles.

    python -m benchmarks.structure [PACKAGE_FOLDER ...] [--check]

Reads source code only. Given the folders of two versions it prints a column for each. With
``--check`` it fails where a figure is above its limit in ``reference/structure.yaml``, which may
only be lowered; the package may have more syntax nodes if a line of the changelog that begins with
*Size:* says why. A *node* is one of Python's syntax tree: neither comments nor the layout of lines
change their number. A *name
imported between families* is one name in an import statement from one planner family in another;
files directly in ``planners/`` are the room's doors and belong to no family. A *circle* is a set of
modules that import each other in a loop, imports inside functions counted too. A
conditional expression is *long* if it holds another one, spans lines or has over 60 characters.
"""

from __future__ import annotations

import ast
import re
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


@dataclass(frozen=True)
class Module:
    """One source file, read."""

    name: str
    lines: int
    tree: ast.Module

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
        found.append(Module(name, text.count("\n"), ast.parse(text)))
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
    """Entries of a table of commands that are options."""
    if isinstance(value, dict):
        own = str(value.get("name", "")).startswith("-")
        return own + sum(map(_options, value.values()))
    return sum(map(_options, value)) if isinstance(value, list) else 0


def lines_of_core(folder: Path) -> int:
    """Lines of the C++ core and its bindings; none where the package has none."""
    files = [*folder.rglob("*.hpp"), *folder.rglob("*.cpp")]
    return sum(len(file.read_text().splitlines()) for file in files if "tests" not in file.parts)


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
        "syntax nodes": str(nodes.total()),
        "lines": str(sum(module.lines for module in modules)),
        "lines of C++": str(lines_of_core(folder.parent / "core")),
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


def breaches(figures: dict[str, str]) -> list[str]:
    """Figures above their limits, and limits that can be lowered."""
    limits = yaml.safe_load(LIMITS.read_text())
    most = {name: rule["most"] for name, rule in limits["mechanisms"].items()} | limits["most"]
    found = []
    for name, limit in most.items():
        value = int(figures[name])
        if value > limit and not (name == "syntax nodes" and _growth_is_explained()):
            found.append(f"{name}: {value}, at most {limit}")
    return found


def _growth_is_explained() -> bool:
    """True if the changelog of the next version says why the package has grown."""
    unreleased = (ROOT / "CHANGELOG.md").read_text().split("\n## ")[1]
    return re.search(r"^- Size: .{20,}", unreleased, re.MULTILINE) is not None


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
    print(*(f"above its limit: {line}" for line in broken), sep="\n", end="\n" if broken else "")
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
