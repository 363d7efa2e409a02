"""Scores of episodes that figures in ``docs`` come from: one CSV file beside each experiment file.

A line is an episode. Its columns are those of ``results.csv`` that tables need, the suite in place
of the scenario (with the variations in which its scenarios differ), and where the episode comes
from. Numbers have 6 significant digits.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pushplan.evaluation import ResultRow, Results
from pushplan.evaluation.experiment_file import fields_of
from pushplan.evaluation.store.provenance import code_in_words
from pushplan.evaluation.store.rows import columns, csv_text, row_from_texts
from pushplan.files.output_files import write_atomic
from pushplan.files.safe_files import read_data
from pushplan.metrics import METRICS, Role, metric_names
from pushplan.scenarios import Suite
from pushplan.world import InvalidInputError

WHO = ("suite", "policy", "seed")
ORIGIN = ("date", "pushplan", "machine", "load")
_METRICS = (name for name in metric_names(*Role) if name != "success")
COLUMNS = (
    *(*WHO, "status", "reason", "success", *_METRICS),
    *("plan_calls", "plan_time_median_s", "plan_time_max_s"),
    *("decision_time_median_s", "decision_time_max_s", *ORIGIN),
)
"""In this order; one that no episode of a file has is left out of it."""
Texts = Mapping[str, str]


@dataclass(frozen=True)
class StoredEpisode:
    """One line of a file.

    Attributes:
        row: what tables are made of; its setting is the name of the suite, with the variations in
            which the scenarios of the suite differ.
        date: on which the episode ran (ISO 8601, UTC).
        pushplan: version and commit of the code.
        machine: cores and architecture.
        load: of the machine when the run began; empty if unknown.
    """

    row: ResultRow
    date: str
    pushplan: str
    machine: str
    load: str


def read(path: Path) -> list[StoredEpisode]:
    """The episodes of a file, in its order: that of the experiment file.

    Raises:
        InvalidInputError: if there is no such file, or a line is not one that `take` wrote.
    """
    episodes = []
    for number, texts in enumerate(_lines(path), start=2):
        try:
            scenario = f"{texts['suite']}-{int(texts['seed'])}"
            row = row_from_texts({**texts, "scenario": scenario})
            asked = [name for name in METRICS if name not in columns() and texts.get(name)]
            metrics = {**row.metrics, **{name: float(texts[name]) for name in asked}}
            origin = {name: texts[name] for name in ORIGIN}
        except (KeyError, TypeError, ValueError) as error:
            raise InvalidInputError(f"{path}, line {number} is no episode: {error}") from error
        episodes.append(StoredEpisode(replace(row, metrics=metrics), **origin))
    keys = [(one.row.setting, one.row.policy, one.row.seed) for one in episodes]
    if len(set(keys)) < len(keys):
        twice = next(key for key in keys if keys.count(key) > 1)
        raise InvalidInputError(f"{path} may have an episode once, it has {twice} again")
    return episodes


def take(run: Path, experiment: Path) -> str:
    """Store the episodes of a run directory that an experiment file names, beside that file.

    They replace those of the same suite, policy and seed; the other episodes stay, as far as the
    experiment file still names them.

    Returns:
        What is stored now, in words.

    Raises:
        InvalidInputError: if the run has none of these episodes.
        SchemaError: if a file is missing or off the schema.
    """
    fields = fields_of(read_data(experiment, "experiment file"), experiment.parent)
    labels = [policy.label for policy in fields["policies"]]
    names = {one.name: _names(one) for one in fields["suites"]}
    suites = {key: name for some in names.values() for key, name in some.items()}
    wanted = [
        (names[one.name][str(start.key)], label, str(start.seed))
        for one in fields["suites"]
        for label in fields["only"].get(one.name, labels)
        for start in one.scenarios
    ]
    results = Results.load(run)
    path = experiment.with_suffix(".csv")
    known = [row for row in results.rows if row.scenario in suites]
    found = _by_key([_texts(row, suites[row.scenario], results) for row in known])
    taken = found.keys() & set(wanted)
    if not taken:
        raise InvalidInputError(f"{run} has no episode that {experiment} names")
    every = {**_by_key(_lines(path) if path.is_file() else []), **found}
    kept = [every[key] for key in wanted if key in every]
    columns_used = [name for name in COLUMNS if any(texts.get(name) for texts in kept)]
    lines = [[texts.get(name, "") for name in columns_used] for texts in kept]
    write_atomic(path, csv_text(columns_used, lines).encode())
    return f"{path}: {len(taken)} episodes taken, {len(kept)} stored"


def _names(suite: Suite) -> dict[str, str]:
    """Scenario -> suite, with the variations in which its scenarios differ."""
    sets = [set(start.variations.items()) for start in suite.scenarios]
    shared = set.intersection(*sets)
    names = {}
    for start in suite.scenarios:
        own = [
            f"{name}={value}"
            for name, value in start.variations.items()
            if (name, value) not in shared
        ]
        names[str(start.key)] = suite.name + (f"[{','.join(own)}]" if own else "")
    return names


def _by_key(lines: Sequence[Texts]) -> dict[tuple[str, ...], Texts]:
    """Suite, policy and seed -> line."""
    return {tuple(texts[name] for name in WHO): texts for texts in lines}


def _lines(path: Path) -> list[Texts]:
    if not path.is_file():
        raise InvalidInputError(f"there are no stored episodes: no file {path}")
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _texts(row: ResultRow, suite: str, results: Results) -> Texts:
    """The line of a row."""
    # a row has no time if its process died
    run = [one for one in results.about["runs"] if one["began"] <= (row.began or "~")][-1]
    origin = {
        "date": (row.began or run["began"])[:10],
        "pushplan": code_in_words(run),
        "machine": f"{run['cores']}-core {run['machine']}",
        "load": run["load"],
    }
    values = {"suite": suite, **results.measured.get(row.job, {}), **origin}
    names = [name for name in COLUMNS if name not in values]
    return {name: _text(value) for name, value in values.items()} | {
        name: _text(getattr(row, name)) for name in names
    }


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
