"""One row of the results: what became of one job."""

from __future__ import annotations

import csv
import enum
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.envs.registry import goal_kind
from pushplan.errors import one_line, short
from pushplan.files.safe_files import read_bytes
from pushplan.metrics import METRICS, Role, compute, metric_names
from pushplan.world import Episode

REASON_LENGTH = 300
"""A reason in the results is cut to this many characters; the detail file has all of it."""


def clean_reason(reason: object) -> str:
    """A reason as it is stored: one line of printable text without addresses of objects."""
    text = re.sub(r"0x[0-9a-fA-F]{6,}", "0x...", one_line(str(reason)))
    if len(text) <= REASON_LENGTH:
        return text
    return text[: REASON_LENGTH - 3] + "..."


def instant() -> str:
    """The time now, ISO 8601, UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def moment(text: object) -> datetime:
    """The time that `instant` wrote.

    Raises:
        ValueError: if it wrote no such text.
    """
    if not isinstance(text, str) or not _INSTANT.fullmatch(text):
        raise ValueError(f"{short(text)} is no time as runs write it")
    return datetime.fromisoformat(text)


def csv_text(header: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    """Lines under a header; floats are written so that they read back the same."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(lines)
    return buffer.getvalue()


class Status(enum.StrEnum):
    """Ways in which a job ends. Only `DONE` means that the episode ran to its own end."""

    DONE = "done"
    """The episode ended by the rules of its task, with or without success."""
    POLICY_ERROR = "policy_error"
    """The policy raised an exception or could not be made."""
    INVALID_ACTION = "invalid_action"
    """The policy returned an action that is not finite or has the wrong shape or type."""
    TIMEOUT = "timeout"
    """The job took longer than the wall-clock limit of an episode."""
    OUT_OF_MEMORY = "out_of_memory"
    """An allocation failed."""
    CRASHED = "crashed"
    """The worker process died."""
    ENV_ERROR = "env_error"
    """The environment raised an exception."""


@dataclass(frozen=True)
class ResultRow:
    """One line of ``results.csv``; None is an empty field.

    Each registered metric (`pushplan.metrics.METRICS`) that is a column is an attribute, such as
    ``row.E_nav``: its value, or None where it has none.

    Attributes:
        policy: label of the policy.
        task: name of the task.
        simulator: name of the simulator.
        scenario: key of the scenario.
        seed: seed of the scenario.
        status: a value of `Status`.
        reason: why the episode ended; for a failed job what went wrong.
        success: the task's goal was reached.
        metrics: values by name; a metric without a value is left out.
        wall_time_s: time that the episode took [s].
        plan_calls: planning calls; empty for a policy that keeps no log of them.
        plan_time_median_s: of the planning calls [s].
        plan_time_p99_s: of the planning calls [s].
        plan_time_max_s: of the planning calls [s].
        decision_time_median_s: wall-clock time from world to action, without simulation, in the
            steps in which something was decided [s]: making the observation, if the policy asks
            for one, and the policy's own call.
        decision_time_mean_s: the same, over all steps [s].
        decision_time_max_s: the slowest step [s].
        began: when the job began (ISO 8601, UTC); empty if its process died.
        host: name of the machine that ran it.
        job: content hash of everything that the result depends on, see `job_identity`.
        trace: content hash of the recorded episode, which names its file; empty if none was kept.
        pool: setting that the row is counted in instead of its own; no column.
    """

    policy: str
    task: str
    simulator: str
    scenario: str
    seed: int
    status: str
    reason: str
    success: bool
    metrics: Mapping[str, float] = field(default_factory=dict, hash=False)
    wall_time_s: float | None = None
    plan_calls: int | None = None
    plan_time_median_s: float | None = None
    plan_time_p99_s: float | None = None
    plan_time_max_s: float | None = None
    decision_time_median_s: float | None = None
    decision_time_mean_s: float | None = None
    decision_time_max_s: float | None = None
    began: str = ""
    host: str = ""
    job: str = ""
    trace: str = ""
    pool: str = ""

    def __getattr__(self, name: str) -> float | None:
        if name not in METRICS:
            raise AttributeError(f"a ResultRow has no column {name!r}")
        return self.metrics.get(name)

    @classmethod
    def from_columns(cls, values: Mapping[str, Any]) -> ResultRow:
        """The row with these values by column."""
        metrics = {n: v for n, v in values.items() if n in METRICS and n not in _OWN}
        rest = {n: v for n, v in values.items() if n not in metrics}
        return cls(**rest, metrics={n: v for n, v in metrics.items() if v is not None})

    def by_column(self) -> dict[str, Any]:
        """The values by column of ``results.csv``."""
        return {name: getattr(self, name) for name in columns()}

    @property
    def setting(self) -> str:
        """Group in which episodes are averaged: the suite, or the scenario without its seed."""
        return self.pool or setting_of(self.scenario, self.seed)

    @property
    def trace_file(self) -> str | None:
        """Path of the recorded episode in a run directory; None if none was kept."""
        return f"episodes/{self.trace}.npz" if self.trace else None

    @property
    def detail_file(self) -> str:
        """Path of the traceback of a failed job in a run directory, if one was kept."""
        return f"failures/{self.job}.txt"

    @property
    def failed(self) -> bool:
        """True if the job ended otherwise than by the rules of its task."""
        return self.status != Status.DONE


_ROUNDING = 1e-6
_TEXT = re.compile(r"[^\x00-\x1f\x7f-\x9f\ud800-\udfff]{0,1000}")
"""Texts that may be shown on a terminal."""
_INSTANT = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", re.ASCII)
_FORMS = {
    # hashes that name files in a run directory
    "job": re.compile(r"[\w-]{0,64}", re.ASCII),
    "trace": re.compile("([0-9a-f]{32})?"),
}
_OWN = {item.name: str(item.type) for item in fields(ResultRow) if item.name != "pool"}
_TEXTS = tuple(name for name, kind in _OWN.items() if kind == "str")
_TIMES = tuple(name for name, kind in _OWN.items() if kind == "float | None")
TIMING_COLUMNS = (*_TIMES, "began", "host", "trace")
"""Columns that differ from run to run: times are in the recorded episodes too."""


def columns() -> tuple[str, ...]:
    """Names of the columns of ``results.csv``, in order: each metric that is one among them."""
    own = list(_OWN)
    at = own.index("metrics")
    shown = metric_names(Role.SCORE, Role.DETAIL, Role.FACT)
    return (*own[:at], *shown, *own[at + 1 :])


def column_type(name: str) -> str:
    """Type of the values of a column: ``"str"``, ``"bool"``, ``"int"`` or ``"float"``."""
    if name in _OWN:
        return _OWN[name].removesuffix(" | None")
    return "int" if METRICS[name].whole else "float"


def rows_csv(rows: Sequence[ResultRow], more: Mapping[str, Sequence[object]] | None = None) -> str:
    """The rows as CSV with a header, and further columns behind."""
    names = columns()
    more = more or {}
    lines = []
    for row, *rest in zip(rows, *more.values(), strict=True):
        values = [*(getattr(row, name) for name in names), *rest]
        lines.append([int(value) if isinstance(value, bool) else value for value in values])
    return csv_text([*names, *more], lines)


def setting_of(scenario: str, seed: int) -> str:
    """Return the group to average in: ``SUITE`` of the key ``SUITE/NAME-SEED``, else ``NAME``."""
    start = scenario.removesuffix(f"-{seed}")
    suite, _, name = start.rpartition("/")
    return suite or name


def csv_lines(path: Path) -> Iterator[dict[str, str]]:
    """The lines of a ``results.csv``, by column.

    Raises:
        SchemaError: if the file cannot be read.
        csv.Error: if it is no CSV.
    """
    text = read_bytes(path, "results").decode("utf-8", errors="replace")
    return csv.DictReader(io.StringIO(text, newline=""))


def row_from_texts(texts: Mapping[str, str | None]) -> ResultRow:
    """The row that a line of ``results.csv`` holds, by column.

    Raises:
        KeyError, TypeError, ValueError: if it can be none.
    """
    values: dict[str, Any] = {}
    for name in columns():
        text = texts.get(name) or ""
        kind = column_type(name)
        if kind == "str":
            values[name] = text
        elif kind == "bool":
            values[name] = {"1": True, "0": False}[text]
        elif not text:
            values[name] = None
        else:
            values[name] = int(text) if kind == "int" else float(text)
    return checked_row(ResultRow.from_columns(values))


def checked_row(row: ResultRow) -> ResultRow:
    """The row with a clean reason, if its values can be those of one.

    Raises:
        KeyError, TypeError, ValueError: if a value is of another type or out of range.
    """
    if not isinstance(row.metrics, Mapping):
        raise TypeError(f"metrics is {row.metrics!r:.60}")
    for name in _TEXTS:
        text = getattr(row, name)
        if type(text) not in (str, Status):
            raise TypeError(f"{name} is {text!r:.60}")
        if not _FORMS.get(name, _TEXT).fullmatch(text):
            raise ValueError(f"{name} is {text!r:.60}")
    Status(row.status)
    if row.began:
        moment(row.began)
    if type(row.success) is not bool or type(row.seed) is not int or abs(row.seed) >= 2**63:
        raise TypeError(f"success is {row.success!r:.60} and seed {row.seed!r:.60}")
    for name in (*_TIMES, "plan_calls"):
        value = getattr(row, name)
        if value is not None and not 0.0 <= _number(name, value) < math.inf:
            raise ValueError(f"{name} is {value!r:.60}")
    for name, value in row.metrics.items():
        low = METRICS[name].low
        high = METRICS[name].high
        if not low - _ROUNDING <= _number(name, value) <= high + _ROUNDING or math.isinf(value):
            raise ValueError(f"{name} is {value:.6g}, not between {low:g} and {high:g}")
    return replace(row, reason=clean_reason(row.reason), host=clean_reason(row.host)[:64])


def _number(name: str, value: object) -> float:
    # the database keeps whole numbers of 64 bits
    if type(value) not in (int, float) or (type(value) is int and abs(value) >= 2**63):
        raise TypeError(f"{name} is {short(value)}")
    return value  # type: ignore[return-value]


def blank_row(policy: str, scenario: Any, status: Status, reason: str) -> ResultRow:
    """The row of a job of which nothing was recorded."""
    kind = goal_kind(str(scenario.task), scenario.to_dict().get("variations"))
    zeroed = {
        name: metric.if_failed
        for name, metric in METRICS.items()
        if metric.if_failed is not None and metric.goal in (kind, None)
    }
    return ResultRow(
        policy=policy,
        task=str(scenario.task).rpartition(":")[2],
        simulator=str(scenario.simulator),
        scenario=str(scenario.key),
        seed=int(scenario.seed),
        status=str(status),
        reason=reason,
        success=False,
        metrics=zeroed,
    )


def scored_row(row: ResultRow, episode: Episode, plan_calls: int | None) -> ResultRow:
    """``row`` with everything that a recorded episode says.

    Args:
        row: who ran what, and how it ended.
        episode: what was recorded, up to the failure if there was one.
        plan_calls: how many planning calls the policy logged; None if it keeps no log.
    """
    # what a policy did until it failed says nothing about its scores
    shown = metric_names(Role.SCORE, Role.DETAIL, Role.FACT)
    names = [name for name in shown if METRICS[name].until_failure or not row.failed]
    found = {
        name: int(value) if METRICS[name].whole else value
        for name, value in compute(episode, names).items()
    }
    times: dict[str, float] = {}
    calls = episode.plan_times_s
    decisions = episode.act_times_s
    if plan_calls is not None and len(calls):
        times["plan_time_median_s"] = float(np.median(calls))
        times["plan_time_p99_s"] = float(np.percentile(calls, 99.0))
        times["plan_time_max_s"] = float(calls.max())
    if len(decisions):
        held = episode.about.get("held_for", 1)
        times["decision_time_median_s"] = float(np.median(decisions[::held]))
        times["decision_time_mean_s"] = float(decisions.mean())
        times["decision_time_max_s"] = float(decisions.max())
    return replace(
        row,
        success=episode.success and not row.failed,
        metrics={**row.metrics, **found},
        plan_calls=plan_calls,
        **times,  # type: ignore[arg-type]
    )
