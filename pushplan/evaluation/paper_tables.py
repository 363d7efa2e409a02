"""Tables that set our results beside those of the Bench-Push paper."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

import pushplan
from pushplan.evaluation.published import ENOUGH, SETTINGS, PublishedRow, PublishedTable, Score
from pushplan.evaluation.results import Results
from pushplan.evaluation.rows import ResultRow
from pushplan.evaluation.statistics import Estimate, estimate, wilson
from pushplan.evaluation.summary import policies_of, values_of
from pushplan.evaluation.tables import Table
from pushplan.learned.onnx_policy import read_specification
from pushplan.metrics import Role, metric_names
from pushplan.world import InvalidInputError

_POINT = "E_nav to goal point"
_ABOVE = " ▲"


def preface(results: Results, command: str = "") -> str:
    """What stands above the tables of a document."""
    seeds = sorted({row.seed for row in results.rows})
    span = f"seeds {seeds[0]} to {seeds[-1]}" if seeds else "no episodes"
    made = f"Written by `{command}` on" if command else "Written on"
    machine = f"{os.cpu_count()}-core {platform.machine()}, Python {platform.python_version()}"
    return f"""\
# Beside the Bench-Push paper

{made} {date.today().isoformat()} ({machine}, pushplan {pushplan.__version__}), {span} of \
each suite. `pushplan/evaluation/data/bench_push.yaml` holds the numbers of the paper and where \
they stand in it.

- **Rows**: the policies of the paper come first, in its simulator and by its metrics (mean ± \
standard deviation, or medians read off its plots). Ours follow, on the suite that the heading \
names: mean ± standard deviation with the 95 % bootstrap interval of the mean, success with \
Wilson's interval. All policies of ours get the same scenarios, which no network saw in training \
or validation.
- **▲**: above the best of the paper in simulation, with the whole interval, or with the median \
where the paper's value is a median. S counts if it equals the best. I counts only for policies, \
ours and the paper's, that succeed in nine of ten episodes or bring nine of ten boxes home.
- **E_nav**: the paper's l₀\\* ends at the goal's centre, so its values stand under *E_nav to goal \
point*. Its code finds l₀\\* on a grid whose diagonal steps cost 1, which shortens it. In the 2D \
maze its E_nav is 4 to 7 % below ours on the same trajectory, measured inside the original \
environment ([how](bench-push.md)). In the 3D testbed it lies between our two columns on most \
starts. Both columns are compared with the paper's ([conventions](metrics.md)); a lead of less \
than 7 % in E_nav says nothing in the 2D maze.
- **time a step [ms]**: from world to action without simulation, which is the observation, if the \
policy uses one, and the policy's call. The first value is the median over episodes of the median \
step; the mean and the slowest step follow. A network that holds a decision for several steps \
counts in the median with the steps in which it decides. A planner's slowest step is the one in \
which it plans.
- **training**: decisions taken in training, and its duration, from the model card.
- Read the [scores](metrics.md) together: I is 1 for a robot that does nothing. The paper reports \
no success in navigation; here E_nav is 0 without success.
"""


def overview(tables: Sequence[PublishedTable], rows: Sequence[Sequence[ResultRow]]) -> Table:
    """Who of ours is above the best of the paper in every score at once."""
    cells = []
    for table, ours in zip(tables, rows, strict=True):
        best = {
            name: value
            for name in metric_names(Role.SCORE)
            if (value := table.best(name)) is not None
        }
        if not best:
            continue
        winners = []
        for label in policies_of(ours):
            mine = [row for row in ours if row.policy == label]
            found = {name: values_of(mine, name) for name in best}
            if all(found.values()) and all(
                _is_above(table, mine, name, estimate(values)) for name, values in found.items()
            ):
                winners.append(label)
        said = ", ".join(f"{name} {value:g}" for name, value in best.items())
        cells.append((table.suite, table.statistic, said, "\n".join(winners) or "none"))
    headings = ("suite", "of", "the paper's best of each score", "ours with ▲ in all of them")
    return Table("In short", headings, tuple(cells), "With E_nav, not E_nav to goal point")


def paper_table(
    table: PublishedTable,
    rows: Sequence[ResultRow],
    policies: Sequence[str],
    points: Mapping[str, Sequence[float]],
    training: Mapping[str, str],
    incompatible: Mapping[str, str],
) -> Table:
    """One table.

    Args:
        table: what the paper says.
        rows: ours, of the suite that mirrors it.
        policies: labels in the order of the rows.
        points: label -> E_nav of each episode with l0* to the goal's centre.
        training: label of a network -> what its training took.
        incompatible: label -> why a policy was not run here.
    """
    names = _columns(table, rows)
    headings = ("policy", "runs", "success", *names, "time a step [ms]", "training")
    cells = [_published_cells(row, names) for row in table.rows]
    for label in policies_of(rows, policies):
        mine = [row for row in rows if row.policy == label]
        scores = _our_scores(table, mine, names, points.get(label, ()))
        cells.append((*_counts(label, mine), *scores, _decision(mine), training.get(label, "none")))
    # a network of this task and preset is looked for here; what is for others fits on a line
    near = {
        label: why
        for label, why in incompatible.items()
        if label in training and not why.startswith(("made for task", "made for preset"))
    }
    blank = [""] * (len(headings) - 2)
    for label, why in near.items():
        cells.append((label, f"not run: {why}", *blank))
    return Table(
        f"{table.title} (`{table.suite}`)",
        headings,
        tuple(cells),
        _note(table, [label for label in incompatible if label not in near]),
    )


def _columns(table: PublishedTable, rows: Sequence[ResultRow]) -> list[str]:
    names = [n for n in metric_names(Role.SCORE) if values_of(rows, n) or table.best(n) is not None]
    if table.task == "maze":  # the goal is a disc: l0* has two conventions
        names.insert(names.index("E_nav") + 1, _POINT)
    return names


def _note(table: PublishedTable, others: Sequence[str]) -> str:
    parts = [f"source of the paper's rows: {table.source}", *table.notes]
    if others:
        parts.append(f"made for other tasks or presets: {', '.join(others)}")
    return ".\n".join(f"- {part[0].upper()}{part[1:]}" for part in parts)


def _published_cells(row: PublishedRow, names: Sequence[str]) -> tuple[str, ...]:
    def cell(name: str) -> str:
        # the paper measures to the goal's centre; our own convention it has not
        source = "E_nav" if name == _POINT else name
        hidden = name == "E_nav" and _POINT in names
        score = None if hidden else row.scores.get(source)
        return "" if score is None else _published(score)

    success = row.scores.get("success")
    return (
        f"{row.policy} ({SETTINGS[row.setting]})",
        "" if row.episodes is None else str(row.episodes),
        "" if success is None else f"{success.value:.2f}",
        *(cell(name) for name in names),
        "",
        "",
    )


def _published(score: Score) -> str:
    if score.sd is not None:
        return f"{score.value:.3f} ± {score.sd:.3f}"
    return f"median {f'{score.value:.3f}'.removesuffix('0')}"  # read off a plot


def _counts(label: str, rows: Sequence[ResultRow]) -> tuple[str, str, str]:
    failed = sum(row.failed for row in rows)
    rate = wilson(sum(row.success for row in rows), len(rows))
    return (
        label,
        str(len(rows)) + (f"\n{failed} failed" if failed else ""),
        f"{rate.fraction:.2f}\n[{rate.low:.2f}, {rate.high:.2f}]",
    )


def _our_scores(
    table: PublishedTable,
    rows: Sequence[ResultRow],
    names: Sequence[str],
    points: Sequence[float],
) -> list[str]:
    cells = []
    for name in names:
        values = list(points) if name == _POINT else values_of(rows, name)
        if not values:
            cells.append("")
            continue
        value = estimate(values)
        mark = _ABOVE if _is_above(table, rows, name, value) else ""
        interval = f"[{value.low:.3f}, {value.high:.3f}]"
        first = f"{value.mean:.3f} ± {value.sd:.3f}"
        if table.statistic == "median":
            cells.append(f"median {value.median:.3f}{mark}\n{first}\n{interval}")
        else:
            cells.append(f"{first}{mark}\n{interval}")
    return cells


def _is_above(table: PublishedTable, rows: Sequence[ResultRow], name: str, value: Estimate) -> bool:
    """Whether an estimate of ours counts as above the best that was published."""
    best = table.best("E_nav" if name == _POINT else name)
    middle = value.median if table.statistic == "median" else value.mean
    if best is None:
        return False
    if name == "S_manip":  # nothing is above 1
        return middle >= best
    if name.startswith("I_"):
        done = values_of(rows, "S_manip") or [float(row.success) for row in rows]
        if sum(done) < ENOUGH * len(rows):
            return False
    return (middle if table.statistic == "median" else value.low) > best


def _decision(rows: Sequence[ResultRow]) -> str:
    columns = [values_of(rows, f"decision_time_{kind}_s") for kind in ("median", "mean", "max")]
    if not all(columns):
        return ""
    median, mean = (estimate(column) for column in columns[:2])
    worst = max(columns[2])
    return f"{_ms(median.median)}\nmean {_ms(mean.mean)}\nmax {_ms(worst)}"


def _ms(seconds: float) -> str:
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"


def training_cost(network: Path) -> str:
    """What the training of a network took: by the model card beside it, else by the file itself."""
    card = network.with_suffix(".md")
    said = card.read_text("utf-8") if card.is_file() else ""
    found = re.search(r"^- ([\d,]+ \w+), ([\d.]+ h) of training", said, re.MULTILINE)
    if found:
        begin = re.findall(r"^- Begins with the weights of `(.+)`", said, re.MULTILINE)
        return "\n".join([*found.groups(), *(f"after {name}" for name in begin)])
    try:
        steps = read_specification(network).training.get("steps")
    except InvalidInputError:  # no ONNX file
        steps = None
    return f"{steps:,} steps" if isinstance(steps, int) else "unknown"
