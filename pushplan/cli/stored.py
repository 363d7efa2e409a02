"""Commands on run directories: ``status``, ``merge``, ``rescore``, ``reproduce``, ``salvage``..."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from pushplan.cli.common import add_command, duration, say
from pushplan.cli.outputs import check_directory, check_file

_RUN = "run directory of 'pushplan bench' or 'pushplan experiment'"


def add(commands: Any) -> None:
    """Add the commands."""
    parser = add_command(
        commands, "status", "how far a run is", "  pushplan status runs/study\n", _status
    )
    parser.add_argument("directory", metavar="DIR", help=_RUN)
    examples = "  pushplan merge runs/study runs/part1 runs/part2\n"
    parser = add_command(commands, "merge", "join run directories", examples, _merge)
    parser.add_argument("out", metavar="OUT", help="run directory, new or not")
    parser.add_argument("directories", metavar="DIR", nargs="+", help="what is taken into it")
    examples = "  pushplan rescore runs/study\n  pushplan rescore runs/study --metrics my.py:jerk\n"
    parser = add_command(
        commands, "rescore", "metrics again from the stored episodes", examples, _rescore
    )
    parser.add_argument("directory", metavar="DIR", help=_RUN)
    parser.add_argument(
        "--metrics",
        metavar="A,B",
        default="",
        help="further ones: names ('pushplan list metrics'), 'module:function' or "
        "'file.py:function'",
    )
    examples = "  pushplan reproduce runs/study --job 3f2a91\n"
    parser = add_command(
        commands, "reproduce", "run a stored job again and compare", examples, _reproduce
    )
    parser.add_argument("directory", metavar="DIR", help=_RUN)
    parser.add_argument(
        "--job", metavar="ID", required=True, help="column 'job' of results.csv, or its beginning"
    )
    examples = "  pushplan salvage runs/torn runs/saved\n"
    parser = add_command(commands, "salvage", "save what a damaged run holds", examples, _salvage)
    parser.add_argument("directory", metavar="DIR", help="the damaged run directory")
    parser.add_argument("out", metavar="NEW", help="a folder without a run")
    examples = "  pushplan export runs/study study.parquet\n"
    parser = add_command(commands, "export", "all rows as CSV or Parquet", examples, _export)
    parser.add_argument("directory", metavar="DIR", help=_RUN)
    parser.add_argument("file", metavar="FILE", help="ends in .csv or .parquet")


def _status(options: argparse.Namespace) -> int:
    from pushplan.evaluation import run_status

    now = run_status(options.directory)
    states = {True: "running", False: "at rest", None: "running or not, there are no file locks"}
    say(f"{states[now.active]}: {now.done} of {now.jobs} jobs done")
    if now.per_minute:
        left = "" if now.left_s is None else f", about {duration(now.left_s)} left"
        say(f"{now.per_minute:.3g} a minute{left}")
    if now.failed:
        say(f"{now.failed} failed")
    for title, seconds in now.running:
        say(f"in hand for {duration(seconds)}: {title}")
    for title, seconds in now.slowest:
        say(f"took {duration(seconds)}: {title}")
    return 0


def _merge(options: argparse.Namespace) -> int:
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


def _rescore(options: argparse.Namespace) -> int:
    from pushplan.evaluation import Results, rescore
    from pushplan.evaluation.table_formats import text

    metrics = [name for name in options.metrics.split(",") if name]
    done = rescore(options.directory, metrics)
    say(f"{done.episodes} episodes scored, {len(done.changed)} rows changed")
    if done.unreadable:
        say(f"{len(done.unreadable)} episodes cannot be read: job {done.unreadable[0]} first")
    if metrics:
        say(text(Results.load(options.directory).measure(metrics)))
    return 1 if done.unreadable else 0


def _reproduce(options: argparse.Namespace) -> int:
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


def _salvage(options: argparse.Namespace) -> int:
    from pushplan.evaluation import salvage

    check_directory(options.out)
    found = salvage(options.directory, options.out)
    say(f"{found.rows} results saved in {options.out}, {found.from_csv} of them from results.csv")
    if found.without_episode:
        say(f"{len(found.without_episode)} without their episode: {found.without_episode[0]} ...")
    return 0


def _export(options: argparse.Namespace) -> int:
    from pushplan.evaluation import Results

    check_file(options.file, (".csv", ".parquet"))
    say(f"{Results.load(options.directory).export(options.file)} rows in {options.file}")
    return 0
