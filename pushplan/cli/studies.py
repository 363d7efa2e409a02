"""``pushplan bench``, ``experiment``, ``stress`` and ``demo``: commands that run jobs."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pushplan.cli.common import duration, has_screen, say, say_without_deadline, start_of_task, tell
from pushplan.cli.output_files import check_directory
from pushplan.cli.progress import progress_of

if TYPE_CHECKING:
    from pushplan.evaluation import Experiment
    from pushplan.evaluation.experiment import Cost

SHOWN = {
    "namo-2d-one-box": "namo",
    "ship-ice-2d-10": "skeleton",
    "area-clearing-2d-10-clear-small": "greedy",
}
"""Suite -> the policy that is shown in its first start: quick ones."""
_MOST_WORKERS = 3
BYTES_PER_MB = 1e6
BYTES_PER_GB = 1e9


def bench(options: argparse.Namespace) -> int:
    """Run the batch, print the table, write plots and page."""
    from pushplan.evaluation.benchmark import bench_experiment
    from pushplan.evaluation.experiment_file import EPISODES
    from pushplan.scenarios.suite import seeds_of
    from pushplan.world import InvalidInputError

    if options.policies is None:  # the parser would say so before it names a misspelt option
        raise InvalidInputError(
            "the following arguments are required: --policies; see 'pushplan bench --help'"
        )
    suite = options.suite
    if (start := start_of_task(options)) is not None:
        suite = seeds_of(start, options.episodes or EPISODES)
    experiment = bench_experiment(
        suite,
        options.policies,
        episodes=options.episodes,
        observation=options.observation,
        latency_factor=options.latency,
        deadline_s=options.deadline,
        seed=options.seed,
        timeout_s=options.timeout,
        memory_limit_mb=options.memory,
    )
    if options.deadline is not None:
        say_without_deadline(experiment.policies)
    out = options.out or os.path.join("runs", experiment.name)
    check_directory(out)
    return _run(experiment, out, options)


def experiment(options: argparse.Namespace) -> int:
    """Check the file, run its jobs, print the tables, write plots and page."""
    from pushplan.evaluation import Experiment

    found = Experiment.load(options.file)
    jobs = found.jobs
    said = sys.stderr if options.json else sys.stdout
    for (title, label), why in found.skipped.items():
        said.write(f"left out: {label} in {title}: {why}\n")
    if options.check and not options.json:
        for suite in found.suites:
            scenario = suite.scenarios[0]
            labels = [job.policy.label for job in jobs if job.scenario == scenario]
            say(f"{suite.name}: {len(suite.scenarios)} scenarios, {', '.join(labels)}")
    out = options.out or os.path.join("runs", Path(options.file).stem)
    check_directory(out)
    return _run(found, out, options)


def stress(options: argparse.Namespace) -> int:
    """Run the test, print the score sheet."""
    from pushplan import evaluation
    from pushplan.evaluation.report.table_formats import markdown, text

    check_directory(options.out)
    with progress_of(options.out) as progress:
        sheet = evaluation.stress(
            options.policy,
            options.suite,
            conditions=options.conditions,
            episodes=options.episodes,
            seed=options.seed,
            rate=options.rate,
            planning_time=options.planning_time,
            workers=options.workers,
            out=options.out,
            timeout_s=options.timeout,
            progress=progress,
        )
    table = sheet.table()
    if options.out is not None:
        from pushplan.files.output_files import write_atomic

        write_atomic(Path(options.out) / "stress.md", markdown([table]).encode())
    tell(options, sheet, text([table]).rstrip(), table.note)
    return 1 if sheet.missed else 0


def _run(experiment: Experiment, out: str, options: argparse.Namespace) -> int:
    """Say what the jobs will cost; unless only that was asked for, run them and show the results.

    Args:
        experiment: what to run.
        out: run directory.
        options: with the shared options "jobs" and "tables".
    """
    from pushplan.cli.report import exit_code, show, show_json

    names = ("workers", "retry_failed", "any_version", "shard")
    chosen = {name: getattr(options, name) for name in names}
    count = options.workers or 1
    workers = f"{count} worker{'s' if count > 1 else ''}"
    if options.dask:
        workers = "a cluster"
    cost = experiment.cost(out, **chosen)
    lines = _cost_lines(cost, workers, out)
    if options.check:
        tell(options, cost, *lines)
        return 0
    sys.stderr.write("".join(f"{line}\n" for line in lines))
    with progress_of(out) as progress:
        results = experiment.run(out, progress=progress, dask=options.dask, **chosen)
    if options.json:
        show_json(results, options)
    else:
        show(results, options)
    return exit_code(results)


def _cost_lines(cost: Cost, workers: str, out: str) -> list[str]:
    """Jobs, time and disk in words."""
    if not cost.new:
        return [f"{cost.jobs} jobs, all done"]
    most = ""
    if cost.most_s is not None:
        most = f"; at most {duration(cost.most_s)}, by the time limit"
    time = "their time is not known before the first ones are done"
    if cost.seconds is not None:
        time = f"about {duration(cost.seconds)} of episodes, by {cost.stored} stored ones"
    lines = [
        f"{cost.jobs} jobs, {cost.new} to run on {workers}: {time}{most}",
        f"about {_megabytes(cost.size)} in {out}, {_megabytes(cost.free)} are free",
    ]
    if cost.size > cost.free:
        lines.append(f"the disk of {out} has too little room for that")
    return lines


def _megabytes(size: float) -> str:
    if size >= BYTES_PER_GB:
        return f"{size / BYTES_PER_GB:.3g} GB"
    return f"{size / BYTES_PER_MB:.2g} MB"


def demo(options: argparse.Namespace) -> int:
    """Run the episodes, say how they ended, write the page and open it."""
    import webbrowser

    from pushplan.cli.report import exit_code
    from pushplan.evaluation import Job, Results, parse_policy, run_batch
    from pushplan.imports.on_demand import need
    from pushplan.scenarios import suite

    check_directory(options.out)
    for library in ("gymnasium", "pymunk", "rich", "jinja2", "matplotlib"):
        need(library)  # before the work, not after it
    jobs = [
        Job(parse_policy(policy), scenario)
        for name, policy in SHOWN.items()
        for scenario in suite(name, episodes=1).scenarios
    ]
    say(f"{len(SHOWN)} episodes:")
    with progress_of(options.out) as progress:
        workers = min(os.cpu_count() or 1, _MOST_WORKERS)
        about = {"suite": "demo"}
        run_batch(jobs, out=options.out, workers=workers, about=about, progress=progress)
    results = Results.load(options.out)
    page = results.report()
    for row in results.rows:
        how = "success" if row.success else row.reason
        if row.interaction_work_kg_m is not None:  # a job that failed has none
            how += f", work {row.interaction_work_kg_m:.3g} kg m"
        say(f"  {row.policy} in {row.task}: {how}")
    say(f"page: {page}")
    if not options.no_open and sys.stdout.isatty() and has_screen():  # no browser in the terminal
        webbrowser.open(page.absolute().as_uri())
    return exit_code(results)
