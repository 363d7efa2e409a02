"""Tables that set the results of a run beside those of the Bench-Push paper.

    pushplan experiment examples/paper.yaml --out runs/paper
    python bridges/bench_push/paper.py runs/paper [--markdown comparison.md]

Any run will do that holds suites of that file: ``pushplan bench maze-2d-3 --policies ...`` too.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import sys
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from published import ENOUGH, SETTINGS, PublishedRow, PublishedTable, Score, published_tables

import pushplan
from pushplan.evaluation import Results
from pushplan.evaluation.report.table_formats import markdown, text
from pushplan.evaluation.report.tables import Table
from pushplan.evaluation.run.policy_specs import parse_policy
from pushplan.evaluation.statistics.estimates import Estimate, estimate, wilson
from pushplan.evaluation.statistics.summary import policies_of, values_of
from pushplan.evaluation.store.rows import ResultRow, setting_of
from pushplan.files.output_files import write_atomic
from pushplan.learned.onnx_policy import read_specification
from pushplan.metrics import Role, compute, metric_names
from pushplan.scenarios import suite
from pushplan.world import InvalidInputError, PushplanError

TO_GOAL_POINT = "E_nav_to_goal_point"
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
each suite. `bridges/bench_push/published.yaml` holds the numbers of the paper and where \
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
    """Policies that beat the paper's best result in every score."""
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
    points: Mapping[tuple[str, str, int], float],
    training: Mapping[str, str],
) -> Table:
    """One table.

    Args:
        table: what the paper says.
        rows: ours, of the suite that mirrors it.
        policies: labels in the order of the rows.
        points: (policy, scenario, seed) -> E_nav with l0* to the goal's centre.
        training: label -> what the training of a network took.
    """
    names = _columns(table, rows)
    headings = ("policy", "runs", "success", *names, "time a step [ms]", "training")
    cells = [_published_cells(row, names) for row in table.rows]
    for label in policies_of(rows, policies):
        mine = [row for row in rows if row.policy == label]
        to_point = [points[key] for row in mine if (key := _key(row)) in points]
        scores = _our_scores(table, mine, names, to_point)
        cells.append((*_counts(label, mine), *scores, _decision(mine), training[label]))
    title = f"{table.title} (`{table.suite}`)"
    return Table(title, headings, tuple(cells), _note(table))


def _columns(table: PublishedTable, rows: Sequence[ResultRow]) -> list[str]:
    names = [n for n in metric_names(Role.SCORE) if values_of(rows, n) or table.best(n) is not None]
    if table.task == "maze":  # the goal is a disc: l0* has two conventions
        names.insert(names.index("E_nav") + 1, _POINT)
    return names


def _key(row: ResultRow) -> tuple[str, str, int]:
    return row.policy, row.scenario, row.seed


def _note(table: PublishedTable) -> str:
    parts = [f"source of the paper's rows: {table.source}", *table.notes]
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


def beside(results: Results, command: str = "") -> list[Table]:
    """An overview, then a table for each suite of the paper that a run holds.

    Raises:
        InvalidInputError: if the run holds none of them.
    """
    found = []
    for table in published_tables():
        first = suite(table.suite, episodes=1).scenarios[0]
        setting = setting_of(first.key, first.seed)
        rows = [row for row in results.rows if row.setting == setting]
        if rows:
            found.append((table, rows))
    if not found:
        valid = ", ".join(table.suite for table in published_tables())
        raise InvalidInputError(f"the run holds no suite of the paper (valid: {valid})")
    training = {label: training_of(label) for label in results.policies}
    points = to_goal_point(results)
    tables = [paper_table(table, rows, results.policies, points, training) for table, rows in found]
    return [overview([table for table, _ in found], [rows for _, rows in found]), *tables]


def to_goal_point(results: Results) -> dict[tuple[str, str, int], float]:
    """E_nav in the paper's convention, from the stored episodes; 0 for a job that failed."""
    values = {}
    for row in results.rows:
        if row.E_nav is None:
            continue
        episode = results.episode(row) if row.success else None
        if not row.success:
            values[_key(row)] = 0.0
        elif episode is not None:
            values[_key(row)] = compute(episode, [TO_GOAL_POINT])[TO_GOAL_POINT]
    return values


def training_of(label: str) -> str:
    """What the training of a policy took; ``"none"`` where it is not a network."""
    try:
        network = parse_policy(label).network
    except PushplanError:  # a label of the user's own
        return "none"
    return "none" if network is None else training_cost(network)


def main() -> int:
    """Print the tables of a run directory."""
    parser = argparse.ArgumentParser(description="A run beside the tables of the Bench-Push paper.")
    parser.add_argument("run", help="run directory")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write a document")
    options = parser.parse_args()
    try:
        results = Results.load(options.run)
        tables = beside(results)
        if options.markdown is not None:
            command = f"python bridges/bench_push/paper.py {options.run}"
            document = f"{preface(results, command)}\n{markdown(tables)}"
            write_atomic(options.markdown, document.encode())
    except (PushplanError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    print(text(tables, 160))
    return 0


if __name__ == "__main__":
    sys.exit(main())
