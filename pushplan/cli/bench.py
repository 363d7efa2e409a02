"""``pushplan bench``: compare policies on a suite."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from pushplan.cli import paper
from pushplan.cli.common import (
    add_command,
    add_latency,
    add_run_options,
    add_trust,
    batch_options,
    duration,
    positive,
    say,
    whole,
)
from pushplan.cli.kernel_progress import kernel_progress

if TYPE_CHECKING:
    from pushplan.evaluation import ResultRow, Results

    _Progress = Callable[[int, int, ResultRow | None], None]

_EXAMPLES = """\
  pushplan bench maze-2d-5 --policies straight,kinodynamic-rrt --episodes 20 --out runs/first
  pushplan bench maze-2d-5 --policies straight,my_planner.py:MyPlanner --out runs/mine
  pushplan bench maze-2d-10 --policies fast=my_planner.py:fast,slow=my_planner.py:slow
  pushplan bench paper --only maze,ship_ice --episodes 20

'paper' is every policy on the suites of the Bench-Push paper's tables, its numbers beside ours.

A run that was interrupted or killed continues when the same command is given again.
"""
_LINE_EVERY_S = 10.0


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "bench", "compare policies on a suite", _EXAMPLES, run)
    parser.add_argument("suite", metavar="SUITE,...", help="see 'pushplan list suites'; or 'paper'")
    parser.add_argument(
        "--policies",
        metavar="A,B",
        help="names ('pushplan list policies'), 'onnx:FILE', 'sb3:FILE', 'file.py:Class' or "
        "'module:Class' of a policy or a planner, each with 'label=' in front if wanted "
        "(paper: all that come with pushplan by default)",
    )
    parser.add_argument(
        "--episodes", type=whole(1), metavar="N", help="default: the suite's own; paper: 100 each"
    )
    parser.add_argument("--out", metavar="DIR", help="run directory (default: runs/SUITE)")
    parser.add_argument(
        "--seed", type=whole(0), default=0, metavar="FIRST", help="seed of the first scenario"
    )
    parser.add_argument(
        "--timeout",
        type=positive,
        default=300.0,
        metavar="S",
        help="wall-clock limit of an episode [s] (default %(default)g)",
    )
    parser.add_argument(
        "--observation",
        choices=("auto", "image", "state"),
        default="auto",
        help="what the environment observes; auto: what the policy asks for, else state",
    )
    parser.add_argument(
        "--memory",
        type=positive,
        default=4000.0,
        metavar="MB",
        help="memory of a worker beyond which its episode fails (default %(default)g)",
    )
    add_latency(parser)
    add_trust(parser)
    add_run_options(parser)
    paper.add_options(parser)
    parser.set_defaults(usage=parser.print_usage)


def run(options: argparse.Namespace) -> int:
    """Run the batch, print the table, write plots and page."""
    from pushplan.cli.report import show
    from pushplan.evaluation import UnusablePolicyError

    if (wrong := paper.check(options)) is not None:
        options.usage(sys.stderr)
        return _refuse(wrong)
    out = options.out or os.path.join("runs", options.suite)
    comparison = None
    with progress_of(options.policies or "") as progress:
        try:
            if options.suite == paper.SUITE:
                comparison = paper.compare(options, out, progress)
                results = comparison.results
            else:
                results = _results(options, out, progress)
        except UnusablePolicyError as error:
            return _refuse(str(error))
        except KeyboardInterrupt:
            sys.stderr.write(f"stopped; the same command continues the run in {out}\n")
            raise
    if comparison is None:
        show(results)
    else:
        paper.show(comparison, out, options.markdown)
    failed = sum(row.failed for row in results.rows)
    if failed:
        say(f"{failed} of {len(results.rows)} jobs failed: see the page, or status and reason in ")
        say(f"{os.path.join(out, 'results.csv')}")
    return 0


def _results(options: argparse.Namespace, out: str, progress: _Progress) -> Results:
    from pushplan.evaluation import bench

    return bench(
        options.suite,
        options.policies,
        episodes=options.episodes,
        out=out,
        observation=options.observation,
        latency_factor=options.latency,
        progress=progress,
        **batch_options(options),
    )


def _refuse(message: str) -> int:
    sys.stderr.write(f"pushplan: {' '.join(message.split())}\n")
    return 2


@contextmanager
def progress_of(policies: str) -> Iterator[_Progress]:
    """Kernels while they are compiled; then a bar where there is a terminal, else lines."""
    with ExitStack() as running, ExitStack() as compiling:
        compiling.enter_context(kernel_progress(*policies.split(",")))
        show = _bar(running) if sys.stderr.isatty() else _Lines()

        def update(done: int, total: int, row: ResultRow | None) -> None:
            compiling.close()
            show(done, total, row)

        yield update


def _bar(running: ExitStack) -> _Progress:
    """A bar that appears with the first update."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("so far,"),
        TimeRemainingColumn(),
        TextColumn("left {task.description}"),
    )
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    task = bar.add_task("", total=None)
    failed = 0

    def update(done: int, total: int, row: ResultRow | None) -> None:
        nonlocal failed
        if not bar.live.is_started:
            running.enter_context(bar)
        failed += row is not None and row.failed
        text = f"[red]{failed} failed" if failed else ""
        bar.update(task, completed=done, total=total, description=text)

    return update


class _Lines:
    """Progress for a log file."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._next = self._began + _LINE_EVERY_S
        self._there = 0

    def __call__(self, done: int, total: int, row: ResultRow | None) -> None:
        now = time.monotonic()
        if row is None:
            self._began, self._there = now, done
            if done:
                sys.stderr.write(f"{done} of {total} episodes are there already\n")
        elif done == total or now >= self._next:
            self._next = now + _LINE_EVERY_S
            rate = (done - self._there) / max(now - self._began, 1e-3)
            left = f", about {duration((total - done) / rate)} left" if done < total else ""
            sys.stderr.write(f"{done} of {total} episodes, {60.0 * rate:.3g} a minute{left}\n")
