"""Metrics of stored episodes, without running them again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pushplan.evaluation.store.provenance import package_digest
from pushplan.evaluation.store.rows import scored_row
from pushplan.evaluation.store.run_directory import RunDirectory, remove_report
from pushplan.evaluation.store.source_digests import counted, read_digests, source_digest
from pushplan.imports.observed_reads import Reads, kept, observing
from pushplan.metrics import compute, metric_function
from pushplan.world import Episode, SchemaError


@dataclass(frozen=True)
class Rescored:
    """Result of `rescore`.

    Attributes:
        episodes: how many recorded episodes were scored.
        changed: jobs whose columns are others now.
        unreadable: jobs whose episode is missing or damaged; their rows are as they were.
    """

    episodes: int
    changed: tuple[str, ...]
    unreadable: tuple[str, ...]


def rescore(path: str | Path, metrics: Sequence[str] = (), *, columns: bool = True) -> Rescored:
    """Compute the columns of a run again from its recorded episodes, and further metrics.

    Args:
        path: run directory.
        metrics: further ones, kept beside the rows: names of `pushplan.metrics`, or functions as
            ``"module:function"`` or ``"file.py:function"``. One that is there already is computed
            again if its file, or what it has read, has changed.
        columns: compute the columns again, too.

    Raises:
        UnknownNameError: if there is no such metric.
        InvalidInputError: if another process writes there.
    """
    wanted = {metric_label(metric): metric for metric in metrics}
    sources = {}  # versions of the metrics: a hash of the file of each, or of our code
    for label, metric in wanted.items():
        metric_function(metric)
        sources[label] = source_digest(metric.rpartition(":")[0]) or package_digest()
    changed: list[str] = []
    unreadable: list[str] = []
    scored = 0
    with RunDirectory(path, new=False) as store:
        for stored in store.results():
            known = {metric: str(source) for metric, source, _ in stored.measured}
            missing = [one for one in wanted if not _holds(known.get(one, ""), sources[one])]
            row = stored.row
            if row.trace_file is None or row.failed or not (columns or missing):
                continue
            try:
                episode = Episode.load(store.path / row.trace_file)
            except SchemaError:
                unreadable.append(row.job)
                continue
            scored += 1
            if not known.keys().isdisjoint(missing):  # it may show what they were
                remove_report(store.path)
            new = scored_row(row, episode, row.plan_calls) if columns else row
            if new != row:
                changed.append(row.job)
                store.add(new, spec=stored.spec, show=stored.current)
            reads: Reads = {}
            with observing(reads):
                values = compute(episode, [wanted[label] for label in missing])
            names = {*kept, *reads} - counted
            store.measure(
                (row.job, label, _with_reads(sources[label], names), values.get(wanted[label]))
                for label in missing
            )
        store.note("metrics", list({**dict.fromkeys(store.about().get("metrics", [])), **wanted}))
        store.write_csv()
    return Rescored(scored, tuple(changed), tuple(unreadable))


def _with_reads(source: str, names: Iterable[str]) -> str:
    """The version of a metric, and below it a hash and the name of each thing that it has read."""
    read = read_digests(names, "").items()
    return "\n".join([source, *(f"{digest} {name}" for name, digest in read)])


def _holds(stored: str, source: str) -> bool:
    names = [line.partition(" ")[2] for line in stored.split("\n")[1:]]
    return stored == _with_reads(source, names)


def metric_label(metric: str) -> str:
    """Return the name of a metric in results: its own, or that of a file without its folder."""
    where, colon, name = metric.rpartition(":")
    if not where.endswith(".py"):
        return metric
    return f"{Path(where).name}{colon}{name}"
