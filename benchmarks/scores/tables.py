"""Tables of ``docs`` that are made of stored episodes.

    python -m benchmarks.scores.tables                        # write them into the pages
    python -m benchmarks.scores.tables --check                # say which differ from the episodes
    python -m benchmarks.scores.tables --take runs/mppi mppi  # store a run's episodes, then write

    python -m benchmarks.scores.tables --show maze "columns: success, E, I, plan"  # whole tables
    python -m benchmarks.scores.tables --show runs/mine "columns: success, E, I"  # of any run

``benchmarks/experiments/NAME.yaml`` says what runs, for ``pushplan experiment``, and ``NAME.csv``
beside it has one line for each episode. A table of a page stands between two comments::

    <!-- table: NAME; columns: success, E, I, plan -->
    <!-- end of the table -->

``suites: area-* maze-2d-10`` and ``policies: straight push-aware`` leave the others out.
``differences: POLICY`` gives paired differences of that policy to the others instead, for success,
E and I.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import zip_longest
from pathlib import Path
from textwrap import fill

import numpy as np

from benchmarks.reporting import command_line, write
from benchmarks.scores.stored_episodes import StoredEpisode, read, take
from pushplan.evaluation import ResultRow, Results
from pushplan.evaluation.report.tables import heading, milliseconds
from pushplan.evaluation.statistics.estimates import Estimate, estimate, wilson
from pushplan.evaluation.statistics.summary import paired_differences, values_of
from pushplan.files.safe_files import known_keys
from pushplan.metrics import METRICS, Role
from pushplan.world import InvalidInputError, PushplanError, UnknownNameError

ROOT = Path(__file__).parents[2]
EXPERIMENTS = Path("benchmarks/experiments")
END = "<!-- end of the table -->"
WIDTH = 160  # of a line of text
_TABLE = re.compile(rf"(<!-- table: (.*?) -->\n)(.*?){END}", re.DOTALL)
SCORES = {
    "S": ("S_manip",),
    "E": ("E_nav", "E_manip"),
    "I": ("I_nav", "I_manip"),
    "path": ("path_length_m",),
    "work": ("interaction_work_kg_m",),
}
"""Column of a table -> metrics, of which an episode has one at most."""
TIMES = {"plan": ("planning call [ms]", "plan_time"), "step": ("step [ms]", "decision_time")}


@dataclass(frozen=True)
class Wanted:
    """What a page asks for: the text of the comment before a table."""

    name: str  # of the experiment file
    columns: tuple[str, ...]
    suites: tuple[str, ...]  # patterns
    policies: tuple[str, ...]  # patterns
    differences: str  # a policy; empty for scores

    @classmethod
    def parse(cls, text: str) -> Wanted:
        """Read ``"NAME; KEY: VALUE; ..."``."""
        name, *rest = (part.strip() for part in text.split(";"))
        given = dict(part.partition(":")[::2] for part in rest)
        fields = {key.strip(): value.strip() for key, value in given.items()}
        known_keys("table", fields, ("columns", "suites", "policies", "differences"), ())
        columns = fields.get("columns", "success, E, I").split(",")
        return cls(
            name,
            tuple(word.strip() for word in columns),
            tuple(fields.get("suites", "*").split()),
            tuple(fields.get("policies", "*").split()),
            fields.get("differences", ""),
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Take, write or check; 1 if a page differs or something is wrong."""
    parser = command_line(__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if a page differs")
    parser.add_argument("--take", nargs=2, metavar=("RUN", "NAME"), help="store a run's episodes")
    shown = ("RUN", "TABLE")
    parser.add_argument("--show", nargs=2, metavar=shown, help="print a table of a run or NAME")
    parser.add_argument("--root", type=Path, default=ROOT, help="folder with docs and benchmarks")
    given = parser.parse_args(arguments)
    if given.check and given.take:
        parser.error("--check writes nothing, so it cannot --take")
    try:
        if given.show:
            run, text = given.show
            wanted = Wanted.parse(f"{run}; {text}")
            stored = given.root / EXPERIMENTS / f"{run}.csv"
            if stored.is_file():
                rows = [one.row for one in _chosen(wanted, read(stored))]
            else:
                rows = Results.load(run).rows
            write(markdown(rows, wanted))
            return 0
        if given.take:
            run, name = given.take
            write(take(Path(run), given.root / EXPERIMENTS / f"{name}.yaml"))
        differences = [
            line
            for page in sorted((given.root / "docs").glob("*.md"))
            for line in renewed(page, given.root, write=not given.check)
        ]
    except PushplanError as error:
        write(str(error))
        return 1
    for line in differences:
        write(line)
    if given.check and differences:
        write("python -m benchmarks.scores.tables writes what the stored episodes give")
    return 1 if given.check and differences else 0


def renewed(page: Path, root: Path, *, write: bool) -> list[str]:
    """Make the tables of a page again; a line for each that is another now."""
    old = page.read_text(encoding="utf-8")
    name = page.relative_to(root)
    changes = []
    if not old.count("<!-- table:") == old.count(END) == len(_TABLE.findall(old)):
        raise InvalidInputError(f"{name}: every '<!-- table: NAME -->' needs a '{END}' behind it")

    def made(found: re.Match[str]) -> str:
        try:
            wanted = Wanted.parse(found[2])
            episodes = read(root / EXPERIMENTS / f"{wanted.name}.csv")
            new = table(wanted, episodes)
        except PushplanError as error:
            raise InvalidInputError(f"{name}, table {found[2]!r}: {error}") from error
        if new != found[3]:
            changes.append(f"{name}, table {found[2]!r}: {_first_difference(found[3], new)}")
        return f"{found[1]}{new}{END}"

    text = _TABLE.sub(made, old)
    if write and text != old:
        page.write_text(text, encoding="utf-8")
    return changes


def _first_difference(old: str, new: str) -> str:
    pairs = zip_longest(old.splitlines(True), new.splitlines(True), fillvalue="")
    differing = [pair for pair in pairs if pair[0] != pair[1]]
    (here, stored) = differing[0]
    more = len(differing) - 1
    return f"{here!r}, by the stored episodes {stored!r}" + (f" and {more} more" if more else "")


def table(wanted: Wanted, episodes: Sequence[StoredEpisode]) -> str:
    """A table with the line above that says where it comes from, as Markdown."""
    chosen = _chosen(wanted, episodes)
    rows = [one.row for one in chosen]
    note = ""
    if wanted.differences:
        note = " Paired differences on the same scenarios: mean with its 95 % bootstrap interval."
    elif TIMES.keys() & set(wanted.columns):
        note = " Times are the median over episodes of each one's median, and the longest."
    above = fill(f"{_origin(wanted, chosen)}{note}", WIDTH, break_on_hyphens=False)
    return f"\n{above}\n\n{markdown(rows, wanted)}\n"  # an empty line ends a table


def _chosen(wanted: Wanted, episodes: Sequence[StoredEpisode]) -> list[StoredEpisode]:
    """Episodes of the suites and policies of a table, each of which must name some."""
    suites = dict.fromkeys(one.row.setting for one in episodes)
    policies = dict.fromkeys(one.row.policy for one in episodes)
    for kind, patterns, names in (
        ("suite", wanted.suites, suites),
        ("policy", wanted.policies, policies),
    ):
        for pattern in patterns:
            if not any(fnmatchcase(name, pattern) for name in names):
                raise UnknownNameError(f"{kind} of the stored episodes", pattern, tuple(names))
    return [
        one
        for one in episodes
        if any(fnmatchcase(one.row.setting, pattern) for pattern in wanted.suites)
        and any(fnmatchcase(one.row.policy, pattern) for pattern in wanted.policies)
    ]


def markdown(rows: Sequence[ResultRow], wanted: Wanted) -> str:
    """A table of rows."""
    cells = _difference_cells if wanted.differences else _score_cells
    headings, lines = cells(rows, wanted)
    body = [headings, ("---",) * len(headings), *lines]
    return "".join(f"| {' | '.join(line)} |\n" for line in body)


def _origin(wanted: Wanted, episodes: Sequence[StoredEpisode]) -> str:
    """Command, seeds, date, version and machine."""
    file = EXPERIMENTS / wanted.name
    seeds = sorted({one.row.seed for one in episodes})
    dates = sorted({one.date for one in episodes})
    loads = sorted(round(float(one.load)) for one in episodes if one.load)
    load = f", load {_span(loads)} at the start" if loads else ""
    return (
        f"`pushplan experiment {file}.yaml`, seeds {_span(seeds)}, {_span(dates)}, "
        f"pushplan {', '.join(dict.fromkeys(one.pushplan for one in episodes))}, "
        f"{', '.join(dict.fromkeys(one.machine for one in episodes))}{load} "
        f"([every episode](../{file}.csv))."
    )


def _span(values: Sequence[object]) -> str:
    """The first and the last of sorted values."""
    return " to ".join(dict.fromkeys((str(values[0]), str(values[-1]))))


def _score_cells(
    rows: Sequence[ResultRow], wanted: Wanted
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings, and a line for each suite and policy."""
    shown = [_column(word) for word in wanted.columns]
    lines = []
    for suite, mine in _by(rows, lambda row: row.setting).items():
        for place, (policy, its) in enumerate(_by(mine, lambda row: row.policy).items()):
            failed = sum(row.failed for row in its)
            count = f"{len(its)}, {failed} failed" if failed else f"{len(its)}"
            name = "" if place else f"`{suite}`"
            lines.append((name, f"`{policy}`", count, *(cell(its) for _, cell in shown)))
    return ("suite", "policy", "episodes", *(title for title, _ in shown)), lines


def _difference_cells(
    rows: Sequence[ResultRow], wanted: Wanted
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings, and a line for each suite and other policy."""
    policies = list(dict.fromkeys(row.policy for row in rows))
    if wanted.differences not in policies:
        raise UnknownNameError("policy of the stored episodes", wanted.differences, policies)
    order = sorted(policies, key=lambda label: label == wanted.differences)  # it is the second
    names = {"success": ("success",), "E": SCORES["E"], "I": SCORES["I"]}
    metric = {name: title for title, metrics in names.items() for name in metrics}
    found: dict[tuple[str, str], dict[str, str]] = {}
    for pair in paired_differences(rows, order, "all"):
        if pair.second == wanted.differences and pair.metric in metric:
            cells = found.setdefault((pair.setting, pair.first), {})
            cells[metric[pair.metric]] = _mean(pair.difference, pair.metric, "+")
    lines = []
    suite = ""
    for (setting, other), cells in found.items():
        name = "" if setting == suite else f"`{setting}`"
        suite = setting
        lines.append((name, f"`{other}`", *(cells.get(title, "") for title in names)))
    return ("suite", f"`{wanted.differences}` minus", *names), lines


def _by(rows: Sequence[ResultRow], key: Callable[[ResultRow], str]) -> dict[str, list[ResultRow]]:
    """Rows in groups, in the order of the first of each."""
    groups: dict[str, list[ResultRow]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def _column(word: str) -> tuple[str, Callable[[Sequence[ResultRow]], str]]:
    """Heading of a column, and what makes a cell of episodes."""
    if word == "success":
        return word, _success
    if word in TIMES:
        title, name = TIMES[word]
        return title, lambda rows: _times(rows, name)
    if word not in SCORES and word not in METRICS:
        raise UnknownNameError("column", word, ("success", *SCORES, *TIMES, *METRICS))
    metrics = SCORES.get(word, (word,))
    title = word if len(word) == 1 else heading(metrics[0])
    return title, lambda rows: _score(rows, metrics)


def _success(rows: Sequence[ResultRow]) -> str:
    rate = wilson(sum(row.success for row in rows), len(rows))
    return f"{rate.fraction:.2f} [{rate.low:.2f}, {rate.high:.2f}]"


def _score(rows: Sequence[ResultRow], metrics: Sequence[str]) -> str:
    for name in metrics:
        if values := values_of(rows, name):
            return _mean(estimate(values), name)
    return ""


def _mean(value: Estimate, metric: str, sign: str = "") -> str:
    if value.low == value.high == 0.0:
        return "0"
    known = METRICS[metric]
    form = sign + (".3g" if known.role in (Role.DETAIL, Role.FACT) else f".{known.digits}f")
    interval = f" [{value.low:{form}}, {value.high:{form}}]" if value.count > 1 else ""
    return f"{value.mean:{form}}{interval}"


def _times(rows: Sequence[ResultRow], name: str) -> str:
    medians, longest = (values_of(rows, f"{name}_{kind}_s") for kind in ("median", "max"))
    if not medians:
        return ""
    return f"{milliseconds(float(np.median(medians)))}, {milliseconds(max(longest))}"


if __name__ == "__main__":
    sys.exit(main())
