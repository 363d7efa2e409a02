"""How policies bring every object to its own place, and what their parts are good for.

    python -m benchmarks.accuracy.rearrangement --out RUN --suite rearrange-2d-8 --seeds 1000:1050
    python -m benchmarks.accuracy.rearrangement --out RUN --relopush FILE... [--count N]
    python -m benchmarks.accuracy.rearrangement --out RUN --ablation mpc|order [--suite NAME]

RUN is a run directory (two with `--ablation mpc`): what is in it is not run again, `--table` runs
nothing and prints what is there, also while another process runs. Use one for each question.

Times are processor time. A decision is a call of the policy, control included; the first call of an
episode is its first plan. Errors are those of all objects at the end, whether done or not. Pushes
and relocations are explained in docs/metrics.md. FILE holds instances of ReloPush, see the
variation `instances` of the task; the robot is the `racecar`.

With `--ablation mpc` a policy with `mpc: true` and one with `mpc: false` run on the same seeds in a
robot's loop under the same disturbances: friction of robot, objects and walls, and masses, off by a
factor of which the policy is not told, noise of all poses, and delay. With `--ablation order` the
orders `gtsp`, `nearest` and `random` run on the same seeds. Differences have bootstrap intervals of
95 %; lengths and counts are compared where both succeed.
"""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line, head, origin, percentiles, row, write
from benchmarks.scores.ship_work import ratio
from pushplan.envs import make
from pushplan.envs.tasks.variations import FRICTIONS
from pushplan.evaluation import Experiment, JobSettings, ResultRow, Results, parse_policy
from pushplan.evaluation.benchmark import suites_of
from pushplan.evaluation.run.policy_specs import PolicySpec
from pushplan.evaluation.statistics.estimates import estimate, wilson
from pushplan.evaluation.stress_testing import CONDITIONS, UNDISTURBED, Condition, stress
from pushplan.metrics import Pushing, pushing
from pushplan.metrics.manipulation import place_errors
from pushplan.scenarios import Scenario, Suite
from pushplan.world.checks import FloatArray

ORDERS = ("gtsp", "nearest", "random")
CONTROLLERS = {"mpc": True, "geometric": False}
FACTORS = (2.0, 0.5)
TIMEOUT_S = 3600.0
BLOCK = 4  # seeds after which the other controller has its turn, so that a table has pairs early

Key = tuple[str, int]


@dataclass(frozen=True)
class Measures:
    """What a recorded episode says beyond its row.

    Args:
        pushing: counts and lengths of pushes.
        errors: (N,) distances of the objects from their places at the end [m].
        turns: (N,) turns from their headings [rad].
        times: (S,) processor time of each call of the policy [s].
    """

    pushing: Pushing
    errors: FloatArray
    turns: FloatArray
    times: FloatArray


def main() -> None:
    """Run what is missing, and print a table."""
    parser = command_line(__doc__, workers=2)
    parser.add_argument("--out", type=Path, required=True, help="run directory")
    parser.add_argument("--suite", default="rearrange-2d-8", help="several with commas")
    parser.add_argument("--seeds", default="0:50", metavar="A:B", help="from A on, below B")
    parser.add_argument("--policy", default="gtsp-mpc", help="as for pushplan bench")
    parser.add_argument("--relopush", nargs="+", metavar="FILE", help="instances of ReloPush")
    parser.add_argument("--count", type=int, help="instances of each file; all by default")
    parser.add_argument("--ablation", choices=("mpc", "order"), help="parts of gtsp-mpc")
    parser.add_argument("--table", action="store_true", help="run nothing")
    options = parser.parse_args()
    if not options.table:
        run(options)
    write(origin(), "")
    if options.ablation == "mpc":
        mpc_table({name: Results.load(options.out / name) for name in CONTROLLERS})
    elif options.ablation == "order":
        order_table(Results.load(options.out))
    elif options.relopush:
        relopush_table(Results.load(options.out))
    else:
        suite_table(Results.load(options.out))


def run(options: Namespace) -> None:
    """Run the episodes that are asked for."""
    spec = parse_policy(options.policy)
    if options.relopush:
        suites = [relopush_suite(Path(name), options.count) for name in options.relopush]
    else:
        first, end = map(int, options.seeds.split(":"))
        suites = list(suites_of(options.suite, end - first, first))
    if options.ablation == "mpc":
        for suite in suites:
            disturb(suite, spec, options.out, options.workers)
        return
    policies = [spec]
    if options.ablation == "order":
        policies = [variant(spec, order, order=order) for order in ORDERS]
    settings = JobSettings(timeout_s=TIMEOUT_S, clock="cpu")
    experiment = Experiment("rearrangement", tuple(suites), tuple(policies), settings)
    experiment.run(options.out, workers=options.workers)


def variant(spec: PolicySpec, label: str, **changes: object) -> PolicySpec:
    """The policy with another label and other settings."""
    return replace(spec, label=label, options={**spec.options, **changes})


def relopush_suite(path: Path, count: int | None) -> Suite:
    """The first instances of a file."""
    if count is None:
        count = len(json.loads(path.read_text()))
    each = {"instances": str(path.resolve()), "robot": "racecar"}
    scenarios = (
        Scenario("rearrange", variations={**each, "instance": i}, seed=i, name=f"{path.stem}/{i}")
        for i in range(count)
    )
    return Suite(path.stem, 1, tuple(scenarios))


def disturb(suite: Suite, spec: PolicySpec, out: Path, workers: int) -> None:
    """Run both controllers under all disturbances."""
    wanted = conditions(suite.scenarios[0])
    for i in range(0, len(suite), BLOCK):
        block = replace(suite, scenarios=suite.scenarios[i : i + BLOCK])
        for name, mpc in CONTROLLERS.items():
            stress(
                variant(spec, name, mpc=mpc),
                block,
                conditions=wanted,
                workers=workers,
                out=out / name,
                timeout_s=TIMEOUT_S,
            )


def conditions(scenario: Scenario) -> dict[str, Condition]:
    """Disturbances by name; factors of friction are those on what the task's preset has."""
    materials = make(scenario, observation="state").task.materials
    found = {name: CONDITIONS[name] for name in (UNDISTURBED, "noise-2cm-3deg", "delay-100ms")}
    for factor in FACTORS:
        frictions = {
            name: factor * getattr(materials, field)
            for name, field in FRICTIONS.items()
            if name != "ground_friction"
        }
        masses = {"mass_scale": factor, "parameters": "unknown"}
        found[f"friction-x{factor:g}"] = Condition(variations=frictions)
        found[f"mass-x{factor:g}"] = Condition(variations=masses)
    return found


def measured(results: Results, rows: Sequence[ResultRow]) -> dict[Key, Measures]:
    """The measures of each episode that ran to its own end, by scenario and seed."""
    found = {}
    for one in rows:
        episode = None if one.failed else results.episode(one)
        if episode is not None:
            errors, turns = place_errors(episode)
            found[key(one)] = Measures(pushing(episode), errors, turns, episode.act_times_s)
    return found


def key(one: ResultRow) -> Key:
    """Scenario and seed."""
    return one.scenario, one.seed


def groups(results: Results) -> Iterable[tuple[str, str, list[ResultRow], list[Measures]]]:
    """Title of a setting, policy, rows, and measures of those that did not fail."""
    for setting, title in results.titles.items():
        for policy in results.policies_in(setting):
            rows = [one for one in results.rows_of(setting) if one.policy == policy]
            yield title, f"`{policy}`", rows, list(measured(results, rows).values())


def suite_table(results: Results) -> None:
    """Print scores, errors, pushes and times of decisions."""
    head(
        "scenarios",
        "policy",
        "episodes",
        "success",
        *("S", "E", "I"),
        "position error [mm], median / worst",
        "heading error [°], median / worst",
        "pushes",
        "relocations",
        "decision [ms of CPU], median / p95 / worst",
    )
    for title, policy, rows, found in groups(results):
        row(
            title,
            policy,
            len(rows),
            rate(rows),
            *(
                mean(getattr(one, name) for one in rows)
                for name in ("S_manip", "E_manip", "I_manip")
            ),
            spread([1e3 * one.errors for one in found], (50, 100)),
            spread([np.degrees(one.turns) for one in found], (50, 100)),
            mean(one.pushing.pushes for one in found),
            mean(one.pushing.relocations for one in found),
            spread([1e3 * one.times for one in found], (50, 95, 100)),
        )


def relopush_table(results: Results) -> None:
    """Print success, planning times and lengths on instances of ReloPush."""
    head(
        "instances",
        "policy",
        "count",
        "success",
        "first plan [s of CPU], median / worst",
        "all decisions [s of CPU], median / worst",
        "pushing [m]",
        "transit [m]",
        "pushes",
        "relocations",
    )
    for title, policy, rows, found in groups(results):
        row(
            title,
            policy,
            len(rows),
            rate(rows),
            spread([one.times[:1] for one in found], (50, 100), 3),
            spread([[one.times.sum()] for one in found], (50, 100), 3),
            mean(one.pushing.pushing_distance_m for one in found),
            mean(one.pushing.transit_distance_m for one in found),
            mean(one.pushing.pushes for one in found),
            mean(one.pushing.relocations for one in found),
        )


def mpc_table(runs: Mapping[str, Results]) -> None:
    """Print what both controllers do under each disturbance, and the differences."""
    names = " / ".join(runs)
    titles = ("success", "S", "pushes", "pushing [m]")
    head(
        "disturbance",
        "pairs",
        *(title for name in titles for title in (f"{name}, {names}", "difference")),
    )
    first, second = runs.values()
    for label in first.policies:
        one, two = ({key(r): r for r in run.rows if r.policy == label} for run in (first, second))
        both = sorted(one.keys() & two.keys())
        if not both:
            continue
        scores = [[(r.success, r.S_manip) for r in (one[k], two[k])] for k in both]
        done = [k for k in both if one[k].success and two[k].success]
        found = [
            measured(run, [rows[k] for k in done]) for run, rows in ((first, one), (second, two))
        ]
        efforts = [
            [(m.pushing.pushes, m.pushing.pushing_distance_m) for m in (mine[k] for mine in found)]
            for k in done
        ]
        cells = []
        for pairs in (scores, efforts):
            for column in np.array(pairs, float).reshape(-1, 2, 2).transpose(2, 0, 1):
                cells.append(
                    " / ".join(f"{value:.3f}" for value in column.mean(axis=0)) if pairs else ""
                )
                cells.append(difference(column))
        row(label, len(both), *cells)


def order_table(results: Results) -> None:
    """Print what each order does, and the first one beside the others."""
    head("order", "episodes", "success", "S", "transit [m]", "pushing [m]", "pushes", "relocations")
    of = {name: [one for one in results.rows if one.policy == name] for name in ORDERS}
    found = {name: measured(results, rows) for name, rows in of.items()}
    for name in ORDERS:
        mine = [one.pushing for one in found[name].values()]
        row(
            f"`{name}`",
            len(of[name]),
            rate(of[name]),
            mean(one.S_manip for one in of[name]),
            mean(one.transit_distance_m for one in mine),
            mean(one.pushing_distance_m for one in mine),
            mean(one.pushes for one in mine),
            mean(one.relocations for one in mine),
        )
    write("")
    head(
        f"`{ORDERS[0]}` beside",
        *("pairs", "success", "both succeed", "transit, ratio", "transit [m]", "relocations"),
    )
    success = {name: {key(one): one.success for one in rows} for name, rows in of.items()}
    mine = ORDERS[0]
    for other in ORDERS[1:]:
        pairs = sorted(success[mine].keys() & success[other].keys())
        both = [k for k in pairs if success[mine][k] and success[other][k]]
        transit, moved = (
            [{k: getattr(found[name][k].pushing, field) for k in both} for name in (mine, other)]
            for field in ("transit_distance_m", "relocations")
        )
        row(
            f"`{other}`",
            len(pairs),
            difference([(success[mine][k], success[other][k]) for k in pairs]),
            len(both),
            ratio(*transit),
            difference(list(zip(*(one.values() for one in transit), strict=True))),
            difference(list(zip(*(one.values() for one in moved), strict=True))),
        )


def rate(rows: Sequence[ResultRow]) -> str:
    """Fraction of successes with its Wilson interval; failed jobs count as none."""
    found = wilson(sum(one.success for one in rows), len(rows))
    failed = sum(one.failed for one in rows)
    note = f", {failed} failed" if failed else ""
    return f"{found.fraction:.2f} ({found.low:.2f}-{found.high:.2f}){note}"


def mean(values: Iterable[float | None]) -> str:
    """The mean of those that there are."""
    known = [value for value in values if value is not None]
    return f"{np.mean(known):.3f}" if known else ""


def spread(values: Sequence[Iterable[float]], at: Sequence[float], digits: int = 1) -> str:
    """Percentiles of all values of some episodes."""
    every = [value for one in values for value in one]
    return " / ".join(percentiles(every, at, digits)) if every else ""


def difference(pairs: Sequence[Sequence[float]] | FloatArray) -> str:
    """Mean of first minus second, with its interval."""
    if not len(pairs):
        return ""
    gaps = np.asarray(pairs, float)
    found = estimate(gaps[:, 0] - gaps[:, 1])
    interval = f" ({found.low:+.3f} to {found.high:+.3f})" if found.count > 1 else ""
    return f"{found.mean:+.3f}{interval}"


if __name__ == "__main__":
    main()
