"""The structure of the package in figures: size, kernels, imports between families, circles.

    python benchmarks/structure.py [PACKAGE_FOLDER ...]

Reads source code only. Given the folders of two versions it prints a column for each. A *name
imported between families* is one name in an import statement from one planner family in another;
files directly in ``planners/`` are the room's doors and belong to no family. A *circle* is a set of
modules that import each other in a loop, imports inside functions counted too. A *kernel* is a
function that Numba compiles.
"""

from __future__ import annotations

import argparse
import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import networkx as nx

MANY_ARGUMENTS = 10


@dataclass(frozen=True)
class Module:
    """One source file, read."""

    name: str
    lines: int
    tree: ast.Module

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


def kernels(module: Module) -> Iterator[ast.FunctionDef]:
    """The compiled functions of a module."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.FunctionDef):
            words = " ".join(ast.unparse(item) for item in node.decorator_list)
            if any(word in words for word in ("njit", "kernel", "jit", "inline")):
                yield node


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


def measure(folder: Path) -> tuple[dict[str, str], list[str]]:
    """Figures of one package, and what stands behind them in words."""
    modules = read(folder)
    root = folder.name
    compiled = [kernel for module in modules for kernel in kernels(module)]
    crossing, loops = between_families(modules, root), circles(modules, root)
    wide = sum(len(kernel.args.args) >= MANY_ARGUMENTS for kernel in compiled)
    rooms: Counter[str] = Counter()
    for module in modules:
        rooms[module.name.split(".")[1] if "." in module.name else root] += module.lines
    figures = {
        "lines": str(sum(module.lines for module in modules)),
        "files": str(len(modules)),
        "longest file": str(max(module.lines for module in modules)),
        "files over 300 lines": str(sum(module.lines > 300 for module in modules)),
        "kernels": str(len(compiled)),
        f"kernels with {MANY_ARGUMENTS} arguments or more": str(wide),
        "names imported between planner families": str(sum(crossing.values())),
        "circles": str(len(loops)),
    }
    figures |= {f"lines of {room}": str(lines) for room, lines in sorted(rooms.items())}
    words = [f"{a} takes {count} names from {b}" for (a, b), count in sorted(crossing.items())]
    return figures, [*words, *("circle: " + ", ".join(loop) for loop in loops)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    here = Path(__file__).resolve().parent.parent / "pushplan"
    parser.add_argument("folders", nargs="*", type=Path, default=[here])
    folders = parser.parse_args().folders
    measured = [measure(folder.resolve()) for folder in folders]
    rows = dict.fromkeys(key for figures, _ in measured for key in figures)
    width = max(len(row) for row in rows)
    for row in rows:
        print(row.ljust(width), *(figures.get(row, "-").rjust(8) for figures, _ in measured))
    for folder, (_, words) in zip(folders, measured, strict=True):
        print(
            f"\n{folder}:", *(words or ["nothing crosses between families, no circles"]), sep="\n  "
        )


if __name__ == "__main__":
    main()
