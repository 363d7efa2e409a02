"""`Experiment`: several suites, policies with parameters, and what is measured, as one file."""

from __future__ import annotations

import itertools
import math
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pushplan.evaluation.batch import Progress, run_batch
from pushplan.evaluation.compatibility import UnusablePolicyError, incompatibility
from pushplan.evaluation.jobs import Job, JobSettings
from pushplan.evaluation.policies import PolicySpec, parse_policies, parse_policy
from pushplan.evaluation.results import Results
from pushplan.evaluation.rows import ResultRow
from pushplan.metrics import metric_function
from pushplan.world import Deadline, InvalidInputError, SchemaError
from pushplan.world.checks import expect, integer, known_keys, number
from pushplan.world.errors import short
from pushplan.world.safe_files import read_data

SCHEMA = "pushplan-experiment/1"
"""Name and version of the file format; files of another version are refused."""
EPISODES = 20
MOST_POLICIES = 1000

_KEYS = ("schema", "name", "suites", "policies", "episodes", "seed", "metrics", "timeout_s")
_MORE = ("observation", "latency_factor", "memory_limit_mb")
_POLICY = ("policy", "label", "parameters", "sweep", "deadline_s")
_SUITE = ("suite", "scenarios", "episodes", "seed", "variations")


@dataclass(frozen=True)
class ScenarioSet:
    """Scenarios that belong together.

    Args:
        name: of the suite, or of the file.
        version: of the suite; 1 for a file.
        scenarios: what is run.
    """

    name: str
    version: int
    scenarios: tuple[Any, ...]


@dataclass(frozen=True)
class Experiment:
    """Every policy on every scenario that it is made for.

    Args:
        name: what the report is called.
        suites: the scenarios.
        policies: each with its parameters, under a label of its own.
        settings: what all jobs share.
        metrics: beside those that every run has: names of `pushplan.metrics`, or functions as
            ``"module:function"`` or ``"file.py:function"``.
        memory_limit_mb: private memory of a worker at which allocations fail [MB].
        skipped: (suite, policy label) -> why that pair is not run.

    Raises:
        InvalidInputError: if there is nothing to run, or two policies share a label.
        UnknownNameError: if there is no such metric.
        UnusablePolicyError: if a policy cannot be made, or fits no suite.
    """

    name: str
    suites: tuple[ScenarioSet, ...]
    policies: tuple[PolicySpec, ...]
    settings: JobSettings = field(default_factory=JobSettings)
    metrics: tuple[str, ...] = ()
    memory_limit_mb: float | None = None
    skipped: Mapping[tuple[str, str], str] = field(init=False)

    def __post_init__(self) -> None:
        expect("settings", self.settings, JobSettings)
        if not self.suites:
            raise InvalidInputError("an experiment needs at least one suite")
        for metric in self.metrics:
            metric_function(metric)
        object.__setattr__(self, "policies", tuple(parse_policies(self.policies)))
        object.__setattr__(self, "skipped", self._misfits())

    @classmethod
    def load(cls, path: str | Path) -> Experiment:
        """Read a YAML file; files that it names are looked for beside it.

        Raises:
            SchemaError: if it is missing, not YAML, or off the schema.
            UnknownNameError: if there is no suite, policy, parameter, variation or metric of a
                name.
            UnusablePolicyError: as the class.
        """
        return cls.from_dict(read_data(path, "experiment file"), Path(path).parent)

    @classmethod
    def from_dict(cls, data: object, folder: Path = Path()) -> Experiment:
        """Read plain values, as in a file of that folder; errors as `load`."""
        known_keys("experiment", data, (*_KEYS, *_MORE), ("schema", "suites", "policies"))
        assert isinstance(data, Mapping)
        if data["schema"] != SCHEMA:
            raise SchemaError(f"this pushplan reads schema {SCHEMA!r}, got {short(data['schema'])}")
        episodes = integer("episodes", data.get("episodes", EPISODES), low=1)
        seed = integer("seed", data.get("seed", 0), low=0)
        names = ("timeout_s", "observation", "latency_factor")
        metrics = _texts("metrics", data.get("metrics", ()))
        return cls(
            str(data.get("name", "experiment")),
            tuple(_suite(one, episodes, seed, folder) for one in _list("suites", data["suites"])),
            tuple(
                itertools.chain.from_iterable(
                    _policies(one, folder) for one in _list("policies", data["policies"])
                )
            ),
            JobSettings(**{name: data[name] for name in names if name in data}),
            tuple(_beside(metric, folder) for metric in metrics),
            data.get("memory_limit_mb"),
        )

    @property
    def jobs(self) -> list[Job]:
        """What is run: the policies of a scenario close together."""
        return [
            Job(spec, scenario)
            for suite in self.suites
            for scenario in suite.scenarios
            for spec in self.policies
            if (suite.name, spec.label) not in self.skipped
        ]

    def run(
        self,
        out: str | Path | None = None,
        *,
        workers: int | None = None,
        retry_failed: bool = False,
        progress: Progress | None = None,
    ) -> Results:
        """Run what has not been run yet in the run directory ``out``; see `run_batch`.

        Suites, policies and episodes may be added to an experiment that was run before.

        Args:
            out: run directory; if None only the rows are kept, and traces are dropped.
            workers: processes, all cores by default; 0 runs in this process.
            retry_failed: run jobs again whose row says that they failed.
            progress: told of every row.

        Returns:
            The rows of this experiment.
        """
        jobs = self.jobs
        with tempfile.TemporaryDirectory(prefix="pushplan-") as temporary:
            folder = Path(temporary if out is None else out)
            run_batch(
                jobs,
                out=folder,
                workers=workers,
                settings=self.settings,
                memory_limit_mb=self.memory_limit_mb,
                retry_failed=retry_failed,
                about={"suite": self.name},
                progress=progress,
            )
            found = Results.load(folder)
        wanted = {job.id for job in jobs}
        return Results(
            tuple(row for row in found.rows if _id(row) in wanted),
            found.about,
            None if out is None else folder,
        )

    def _misfits(self) -> dict[tuple[str, str], str]:
        """Make each policy once for each kind of scene; what fits nowhere is refused."""
        known: dict[tuple[str, str], str | None] = {}
        found = {}
        for spec in self.policies:
            for suite in self.suites:
                starts = {Job(spec, scenario).title: scenario for scenario in suite.scenarios}
                for title, scenario in starts.items():
                    if (spec.label, title) not in known:
                        reason = incompatibility(spec, scenario, self.settings)
                        known[spec.label, title] = reason
                    if (reason := known[spec.label, title]) is not None:
                        found[suite.name, spec.label] = reason
            reasons = [found.get((suite.name, spec.label)) for suite in self.suites]
            if all(reasons):
                raise UnusablePolicyError(f"policy {spec.label!r} fits no suite: {reasons[0]}")
        return found


def _id(row: ResultRow) -> tuple[str, str, int]:
    return row.policy, row.scenario, row.seed


def _list(what: str, value: object) -> Sequence[Any]:
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise SchemaError(f"{what} must be a list with at least one entry, got {short(value)}")
    return value


def _texts(what: str, value: object) -> Sequence[str]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise SchemaError(f"{what} must be a list of texts, got {short(value)}")
    return [expect(what, one, str) for one in value]


def _beside(source: str, folder: Path) -> str:
    """A text that may name a ``file.py`` beside the experiment file, made absolute."""
    label, equals, rest = source.rpartition("=")
    where, colon, name = rest.rpartition(":")
    if not where.endswith((".py", ".onnx", ".zip")) and not name.endswith((".onnx", ".zip")):
        return source
    prefix, colon_too, file = where.rpartition(":")
    if name.endswith((".onnx", ".zip")):  # onnx:FILE, sb3:FILE
        return f"{label}{equals}{where}{colon}{_path(name, folder)}"
    return f"{label}{equals}{prefix}{colon_too}{_path(file, folder)}{colon}{name}"


def _path(file: str, folder: Path) -> Path:
    path = Path(file).expanduser()
    return path if path.is_absolute() else (folder / path).resolve()


def _suite(given: object, episodes: int, seed: int, folder: Path) -> ScenarioSet:
    """Read an entry of ``suites``: a name, or a mapping."""
    from pushplan.scenarios import load_scenarios, suite

    entry = {"suite": given} if isinstance(given, str) else given
    known_keys("suite", entry, _SUITE, ())
    assert isinstance(entry, Mapping)
    if ("suite" in entry) == ("scenarios" in entry):
        raise SchemaError(
            "an entry of suites has either 'suite', a name, or 'scenarios', a file: "
            f"got {short(dict(entry))}"
        )
    if "scenarios" in entry:
        path = _path(expect("scenarios", entry["scenarios"], str), folder)
        found = ScenarioSet(path.stem, 1, load_scenarios(path))
    else:
        episodes = integer("episodes", entry.get("episodes", episodes), low=1)
        first = integer("seed", entry.get("seed", seed), low=0)
        named = suite(entry["suite"], episodes=episodes, first_seed=first)
        found = ScenarioSet(named.name, named.version, named.scenarios)
    changes = entry.get("variations", {})
    if not isinstance(changes, Mapping):
        raise SchemaError(f"variations must be a mapping, got {short(changes)}")
    scenarios = tuple(
        replace(one, variations={**one.variations, **changes}) for one in found.scenarios
    )
    words = ",".join(f"{key}={value}" for key, value in changes.items())
    return ScenarioSet(f"{found.name}[{words}]" if words else found.name, found.version, scenarios)


def _policies(given: object, folder: Path) -> Iterable[PolicySpec]:
    """Read an entry of ``policies``: a text, or a mapping; a sweep gives one for each value."""
    entry = {"policy": given} if isinstance(given, str) else given
    known_keys("policy", entry, _POLICY, ("policy",))
    assert isinstance(entry, Mapping)
    source = _beside(expect("policy", entry["policy"], str), folder)
    label = f"{entry['label']}=" if "label" in entry else ""
    spec = parse_policy(label + source)
    options = {**spec.options, **_mapping("parameters", entry.get("parameters", {}))}
    if "deadline_s" in entry:
        options["stop"] = Deadline(number("deadline_s", entry["deadline_s"], low=0.0))
    sweep = _mapping("sweep", entry.get("sweep", {}))
    values = [_list(f"sweep of {name}", given) for name, given in sweep.items()]
    if (count := math.prod(len(one) for one in values)) > MOST_POLICIES:
        raise SchemaError(f"a sweep may give {MOST_POLICIES} policies, this one gives {count}")
    for combination in itertools.product(*values):
        chosen = dict(zip(sweep, combination, strict=True))
        words = "".join(f"@{name}-{_word(value)}" for name, value in chosen.items())
        yield PolicySpec(f"{spec.label}{words}"[:64], spec.source, {**options, **chosen})


def _mapping(what: str, value: object) -> dict[str, Any]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise SchemaError(f"{what} must be a mapping from names to values, got {short(value)}")
    return dict(value)


def _word(value: object) -> str:
    text = f"{value:g}" if isinstance(value, int | float) else str(value)
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text)
