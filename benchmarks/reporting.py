"""Options, tables and figures that benchmarks share."""

from __future__ import annotations

import os
import platform
import time
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

SHARED = {
    "episodes": "episodes of a policy on a suite",
    "seed": "of the first episode or scene",
    "seeds": "repetitions with a seed each",
    "scenes": "random scenes in each row",
    "workers": "processes that run episodes",
}
"""Options that mean the same wherever they occur."""


def command_line(doc: str | None, **defaults: int) -> ArgumentParser:
    """Return a parser that shows the text of a module as its help.

    Args:
        doc: text of the module.
        defaults: shared options of the benchmark, and their default values.
    """
    parser = ArgumentParser(description=doc, formatter_class=RawDescriptionHelpFormatter)
    for name, value in defaults.items():
        about = f"{SHARED[name]}; default {value}"
        parser.add_argument(f"--{name}", type=int, default=value, help=about)
    return parser


def write(*lines: str) -> None:
    """Print lines at once, so that a long run can be watched."""
    print(*lines, sep="\n", flush=True)


def origin() -> str:
    """Date, machine and its load, as the pages of the documentation name them."""
    today = datetime.now(UTC).date()
    machine = f"{os.cpu_count()}-core {platform.machine()}"
    return f"{today}, {machine}, Python {platform.python_version()}, load {os.getloadavg()[0]:.1f}"


def head(*columns: str) -> None:
    """Print the head of a Markdown table."""
    row(*columns)
    write(f"|{'---|' * len(columns)}")


def row(*cells: object) -> None:
    """Print a line of a Markdown table."""
    write(f"| {' | '.join(map(str, cells))} |")


def percentiles(
    values: Iterable[float], at: Sequence[float] = (50, 95, 99, 100), digits: int = 1
) -> list[str]:
    """Percentiles of values, each as a cell."""
    return [f"{value:.{digits}f}" for value in np.percentile(list(values), at)]


def median_ms(call: Callable[[], object], repeats: int = 200) -> float:
    """Median time of a call [ms]."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e3 * float(np.median(times))


def resident_mb() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
