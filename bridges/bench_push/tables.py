"""The tables of `bench.py`, and the page that has them."""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from episodes import SCORES, WAITS, Run

from pushplan.evaluation.statistics.estimates import Estimate, estimate

END = "<!-- end of the tables -->"
TITLES = {
    "maze": "Maze",
    "ship_ice": "Ship-Ice",
    "area_clearing": "Area-Clearing",
    "box_delivery": "Box-Delivery",
}
OWN = ("theirs:rrt", "theirs:lattice", "theirs:gtsp")
HEADINGS = {
    "theirs": "By the original's code",
    "ours": "By ours, on the same trajectories",
}


def report(runs: Sequence[Run]) -> str:
    """The tables of one scene as Markdown."""
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    lines = [
        f"### {TITLES[runs[0].scene]}",
        "",
        f"{runs[0].original}, measured until {today} ({os.cpu_count()}-core {platform.machine()}), "
        "every policy on the same starts; `seeds` are those that ran. Means with 95 % bootstrap "
        "intervals. Δ is the mean paired difference, on the seeds that both have, to the "
        "original's own planner where it ran, else to the first row of the variation. Rows "
        "`theirs:` are planners of the original, in its process, with its actions clipped to "
        "their limits. Of decisions the first two columns are medians over episodes, of the "
        "median and of the longest decision of each; where a policy plans once, the longest is "
        "its first plan.",
    ]
    for by in SCORES:
        lines += ["", f"{HEADINGS[by]}:", "", *table(runs, by)]
    return "\n".join(lines) + "\n"


def table(runs: Sequence[Run], by: str) -> list[str]:
    """One table: all variations of a scene, by one code."""
    names = SCORES[by]
    heads = ["variation", "policy", "seeds", *(_head(name) for name in names)]
    heads += [f"Δ{name}" for name in names if name != "S"]
    if by == "theirs":
        heads += [
            f"decision [ms]: {name}" for name in ("median", "longest of an episode", "longest")
        ]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for variation in dict.fromkeys(run.variation for run in runs):
        group = [run for run in runs if run.variation == variation]
        own = [run for run in group if run.policy in OWN]
        lines += [row(run, (own or group)[0], by) for run in group]
    return lines


def row(run: Run, base: Run, by: str) -> str:
    """One line of a table."""
    cells = [run.variation.replace("_", " "), f"`{run.policy}`", ranges(run.episodes)]
    names = SCORES[by]
    for name in names:
        cells.append(shown(estimate(list(run.values(f"{by}_{name}").values())), name))
    for name in names:
        if name != "S":
            mine = run.values(f"{by}_{name}")
            other = base.values(f"{by}_{name}")
            gaps = [mine[seed] - other[seed] for seed in sorted(mine.keys() & other.keys())]
            cells.append("" if run is base or not gaps else shown(estimate(gaps), name, "+"))
    if by == "theirs":
        medians, longest = (list(run.values(name).values()) for name in WAITS)
        cells += [f"{np.median(medians):.2g}", f"{np.median(longest):.0f}", f"{max(longest):.0f}"]
    return "| " + " | ".join(cells) + " |"


def shown(value: Estimate, name: str, sign: str = "") -> str:
    """A mean with its interval."""
    form = f"{sign}.3g" if name == "work" else f"{sign}.3f"
    return f"{value.mean:{form}} [{value.low:{form}}, {value.high:{form}}]"


def write(page: Path, text: str, command: str) -> None:
    """Put the tables of a command between its marks in a page, or at its end."""
    begin = f"<!-- tables of {command} -->"
    block = f"{begin}\n{text}{END}\n"
    old = page.read_text(encoding="utf-8") if page.is_file() else ""
    before, mark, rest = old.partition(begin)
    after = rest.partition(END)[2].removeprefix("\n") if mark else ""
    page.write_text(before + block + after, encoding="utf-8")


def _head(name: str) -> str:
    return "work [kg m]" if name == "work" else name


def ranges(seeds: Iterable[int]) -> str:
    """Seeds as ranges."""
    found: list[list[int]] = []
    for seed in sorted(seeds):
        if found and seed == found[-1][1] + 1:
            found[-1][1] = seed
        else:
            found.append([seed, seed])
    return ", ".join(f"{low} to {high}" if high > low else str(low) for low, high in found) or "-"
