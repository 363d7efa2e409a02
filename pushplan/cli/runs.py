"""``pushplan runs``: commands on run directories."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict

from pushplan.cli.common import duration, say, say_json
from pushplan.cli.output_files import check_directory, check_file

_NO_LOSS = "success<-0.0,E_nav<-0.0,I_nav<-0.0,S_manip<-0.0,E_manip<-0.0,I_manip<-0.0"
"""Rules of 'compare' that judge without closing a gate."""


def say_status(options: argparse.Namespace) -> int:
    """Say how far a run is, and what takes long."""
    from pushplan.evaluation import run_status

    now = run_status(options.directory)
    states = {True: "running", False: "at rest", None: "running or not, there are no file locks"}
    say(f"{states[now.active]}: {now.done} of {now.jobs} jobs done")
    if now.per_minute:
        left = ""
        if now.left_s is not None:
            left = f", about {duration(now.left_s)} left"
        say(f"{now.per_minute:.3g} a minute{left}")
    if now.failed:
        say(f"{now.failed} failed")
    for title, seconds in now.running:
        say(f"in hand for {duration(seconds)}: {title}")
    for title, seconds in now.slowest:
        say(f"took {duration(seconds)}: {title}")
    return 0


def compare_runs(options: argparse.Namespace) -> int:
    """Judge, print the verdicts."""
    from pushplan import evaluation
    from pushplan.evaluation.report.comparing import verdict_table
    from pushplan.evaluation.report.table_formats import text

    verdicts = evaluation.compare_runs(options.old, options.new, options.fail_on or _NO_LOSS)
    if options.json:
        say_json([{**asdict(one), "rule": str(one.rule)} for one in verdicts])
    else:
        for setting in dict.fromkeys(one.setting for one in verdicts):
            say(setting)
            say(text([verdict_table([one for one in verdicts if one.setting == setting])]))
    if options.fail_on is None:
        return 0
    bad = [v for v in verdicts if v.failed or (options.strict and v.verdict == "unclear")]
    return 1 if bad else 0


def merge_runs(options: argparse.Namespace) -> int:
    """Take the results of run directories into one."""
    from pushplan.evaluation import merge

    check_directory(options.out)
    found = merge(options.out, options.directories)
    say(f"{found.added} results taken into {options.out}, {found.known} were there already")
    if found.differing:
        say(
            f"{len(found.differing)} of these differ, {found.differing[0]} first: kept as they were"
        )
    if found.incomplete:
        say(f"{len(found.incomplete)} left out for damaged episodes: {found.incomplete[0]} ...")
    return 1 if found.incomplete else 0


def rescore_run(options: argparse.Namespace) -> int:
    """Compute the metrics of stored episodes again."""
    from pushplan.evaluation import Results, rescore
    from pushplan.evaluation.report.table_formats import text

    metrics = [name for name in options.metrics.split(",") if name]
    done = rescore(options.directory, metrics)
    say(f"{done.episodes} episodes scored, {len(done.changed)} rows changed")
    if done.unreadable:
        say(f"{len(done.unreadable)} episodes cannot be read: job {done.unreadable[0]} first")
    if metrics:
        say(text(Results.load(options.directory).measure(metrics)))
    return 1 if done.unreadable else 0


def reproduce_job(options: argparse.Namespace) -> int:
    """Run a stored job again; 1 if it ends differently."""
    from pushplan.evaluation import reproduce

    found = reproduce(options.directory, options.job)
    row = found.stored
    say(f"{row.policy} on {row.scenario}: {row.status} ({row.reason})")
    if found.changed:
        say(f"changed since: {found.changed}")
    if found.same:
        say("the same to the byte, times aside")
        return 0
    sys.stderr.write(f"pushplan: not the same: {', '.join(found.differing)}\n")
    return 1


def salvage_run(options: argparse.Namespace) -> int:
    """Save what a damaged run directory holds."""
    from pushplan.evaluation import salvage

    check_directory(options.out)
    found = salvage(options.directory, options.out)
    say(f"{found.rows} results saved in {options.out}, {found.from_csv} of them from results.csv")
    if found.without_episode:
        say(f"{len(found.without_episode)} without their episode: {found.without_episode[0]} ...")
    return 0


def export_rows(options: argparse.Namespace) -> int:
    """Write all rows of a run into one file."""
    from pushplan.evaluation import Results

    check_file(options.file, (".csv", ".parquet"))
    say(f"{Results.load(options.directory).export(options.file)} rows in {options.file}")
    return 0
