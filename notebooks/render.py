"""Run the notebooks, and write what they say and show into pages of docs, one for each.

Usage::

    python notebooks/render.py [NAME ...] [--check]

Without a name all notebooks are run, each in a process of its own; with names the pages of the
others stay as they are. With --check nothing is written.

No Jupyter kernel is needed: what a cell prints, the value of its last line and the figures that it
leaves open are kept, as Jupyter shows them.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import io
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("MPLBACKEND", "Agg")

from PIL import Image

HERE = Path(__file__).parent
DOCS = HERE.parent / "docs"
ORDER = (
    "first_plan",
    "your_own_planner",
    "cost_of_pushing",
    "gtsp_and_pushing",
    "learned_against_classical",
    "planner_in_a_control_loop",
    "robot_through_faults",
)
COLOURS = 96
"""Of a picture: flat drawings look the same with few, and are a third of the size."""
DPI = 110
HEAD = """\
# Notebooks

Seven, in [`notebooks/`](../notebooks). `pip install -e ".[notebooks]"` brings what they need. Open
one with Jupyter, or read here what it says and shows; code that only draws is in the notebook
alone. `python notebooks/render.py` makes these pages. Each took 5 to 80 s on a busy 2-core machine
(2026-11-25), so the times in them are upper bounds.
"""


@dataclass(frozen=True)
class Output:
    """What a code cell has given.

    Args:
        text: printed, and the value of the last line.
        pictures: drawn, as PNG.
    """

    text: str
    pictures: tuple[bytes, ...] = ()


Cell = tuple[str, str, Output | None]
"""Kind, source and output; only code has an output. A page shows hidden code by its output."""


def notebooks() -> list[Path]:
    """The notebooks in reading order."""
    rank = {name: i for i, name in enumerate(ORDER)}
    return sorted(HERE.glob("*.ipynb"), key=lambda path: (rank.get(path.stem, 99), path.stem))


def cells_of(path: Path) -> list[tuple[str, str]]:
    """Kind and source of each cell; code with the tag ``hide-input`` is of the kind ``hidden``."""
    cells = json.loads(path.read_text("utf-8"))["cells"]
    return [
        (
            "hidden" if "hide-input" in cell["metadata"].get("tags", ()) else cell["cell_type"],
            "".join(cell["source"]),
        )
        for cell in cells
    ]


def run_notebook(path: Path) -> Iterator[Cell]:
    """Run a notebook in an empty scope, cell by cell."""
    scope: dict[str, Any] = {"__name__": "__main__"}
    for kind, source in cells_of(path):
        yield kind, source, run_cell(source, scope) if kind != "markdown" else None


def run_cell(source: str, scope: dict[str, Any]) -> Output:
    """Run one cell as a notebook would."""
    body = ast.parse(source).body
    last = body.pop() if body and isinstance(body[-1], ast.Expr) else None
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body, []), "<cell>", "exec"), scope)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), scope)
    if source.rstrip().endswith(";"):
        value = None  # as IPython has it
    text = printed.getvalue()
    pictures = [png(image) for image in open_figures()]
    if isinstance(value, Image.Image):
        pictures.append(png(value))
    elif hasattr(value, "savefig"):
        pictures.append(png(picture_of(value)))
    elif value is not None and not pictures:
        text += f"{value!r}\n"
    return Output(text, tuple(pictures))


def open_figures() -> list[Image.Image]:
    """The figures of pyplot, which are closed."""
    plt = sys.modules.get("matplotlib.pyplot")
    images = []
    for number in plt.get_fignums() if plt else ():
        images.append(picture_of(plt.figure(number)))
        plt.close(number)
    return images


def picture_of(figure: Any) -> Image.Image:
    """A figure of matplotlib as a picture."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    return Image.open(buffer)


def png(image: Image.Image) -> bytes:
    """A small PNG."""
    flat = image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    buffer = io.BytesIO()
    flat.save(buffer, format="png", optimize=True)
    return buffer.getvalue()


def markdown(path: Path, cells: list[Cell]) -> str:
    """The page that shows a notebook; writes its pictures."""
    for old in (DOCS / "images").glob(f"notebook-{path.stem}-*.png"):
        old.unlink()
    blocks, count, heading = [], 0, ""
    for kind, source, output in cells:
        if kind != "hidden":
            blocks.append(shown(kind, source))
        if output is None:
            heading = (re.findall(r"^#+ (.*)", source, flags=re.MULTILINE) or [heading])[-1]
            continue
        if output.text.strip():
            blocks.append(f"```\n{output.text.rstrip()}\n```")
        for picture in output.pictures:
            count += 1
            name = f"notebook-{path.stem}-{count}.png"
            (DOCS / "images" / name).write_bytes(picture)
            blocks.append(f"![{heading}](images/{name})")
    blocks.append(f"The notebook: [`{path.name}`](../notebooks/{path.name}).")
    return "\n\n".join(blocks) + "\n"


def shown(kind: str, source: str) -> str:
    """How a page shows the source of a cell: links from where the page is.

    The semicolon that keeps Jupyter from showing a value is left out.
    """
    if kind == "code":
        return f"```python\n{source.removesuffix(';')}\n```"
    return source.replace("](../docs/", "](")


def page_of(path: Path) -> Path:
    """Where the page of a notebook is."""
    return DOCS / f"notebook-{path.stem}.md"


def overview() -> str:
    """The page with the list of notebooks, each with the first sentence of its text."""
    lines = ["| notebook | what it shows |", "|---|---|"]
    for path in notebooks():
        title, _, text = cells_of(path)[0][1].partition("\n")
        about = " ".join(text.split()).partition(". ")[0].removesuffix(".")
        lines.append(f"| [{title.lstrip('# ')}]({page_of(path).name}) | {about} |")
    return "\n".join([HEAD, *lines, ""])


def main() -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description="run the notebooks and render them into docs/")
    parser.add_argument("names", nargs="*", metavar="NAME", help="of a notebook; all by default")
    parser.add_argument("--check", action="store_true", help="run, and write nothing")
    options = parser.parse_args()
    found = {path.stem: path for path in notebooks()}
    names = options.names or list(found)
    if unknown := sorted(set(names) - set(found)):
        parser.error(f"no notebook is called {unknown[0]!r} (valid: {', '.join(found)})")
    if len(names) > 1:
        flags = ["--check"] if options.check else []
        command = [sys.executable, __file__, *flags]
        return max([subprocess.run([*command, name]).returncode for name in names])
    path, began = found[names[0]], time.perf_counter()
    cells = list(run_notebook(path))
    sys.stdout.write(f"{path.stem}: {time.perf_counter() - began:.1f} s\n")
    if not options.check:
        page_of(path).write_text(markdown(path, cells), "utf-8")
        (DOCS / "notebooks.md").write_text(overview(), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
