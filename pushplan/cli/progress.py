"""Progress of a batch of jobs: a bar on a terminal, else lines for a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from pushplan.cli.common import duration

if TYPE_CHECKING:
    from pushplan.evaluation import ResultRow

    Progress = Callable[[int, int, ResultRow | None], None]

_LINE_EVERY_S = 10.0


@contextmanager
def progress_of(out: str | None = None) -> Iterator[Progress]:
    """Show how many jobs are done; after Ctrl-C what is kept.

    Args:
        out: the run directory, if it is kept.
    """
    finished = 0
    try:
        with ExitStack() as running:
            show: Progress = _Lines()
            if sys.stderr.isatty():
                show = _bar(running)

            def update(done: int, total: int, row: ResultRow | None) -> None:
                nonlocal finished
                show(done, total, row)
                finished = done

            yield update
    except KeyboardInterrupt:
        if out is not None:
            sys.stderr.write(_stopped(finished, out))
        raise


def _stopped(finished: int, out: str) -> str:
    if not finished:
        return "stopped before an episode was finished\n"
    episodes = f"{finished} finished episodes are"
    if finished == 1:
        episodes = "1 finished episode is"
    return (
        f"stopped: {episodes} kept in {out}; the same command goes on with the others, "
        f"and 'pushplan report {out}' makes the tables of those that are there\n"
    )


def _bar(running: ExitStack) -> Progress:
    """A bar that appears with the first update."""
    from rich import progress as rich
    from rich.console import Console

    columns = (
        rich.BarColumn(),
        rich.MofNCompleteColumn(),
        rich.TimeElapsedColumn(),
        rich.TextColumn("so far,"),
        rich.TimeRemainingColumn(),
        rich.TextColumn("left {task.description}"),
    )
    terminal = Console(stderr=True)
    bar = rich.Progress(*columns, console=terminal, transient=True, refresh_per_second=4)
    failed = 0

    def update(done: int, total: int, row: ResultRow | None) -> None:
        nonlocal failed
        failed += row is not None and row.failed
        text = f"[red]{failed} failed" if failed else ""
        if not bar.task_ids:
            bar.add_task("", total=total)
        bar.update(bar.task_ids[0], completed=done, total=total, description=text)
        if not bar.live.is_started:
            running.enter_context(bar)

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
            self._began = now
            self._there = done
            if done:
                sys.stderr.write(f"{done} of {total} episodes are there already\n")
            return
        if done == total or now >= self._next:
            self._next = now + _LINE_EVERY_S
            rate = (done - self._there) / max(now - self._began, 1e-3)
            left = ""
            if done < total:
                left = f", about {duration((total - done) / rate)} left"
            sys.stderr.write(f"{done} of {total} episodes, {60.0 * rate:.3g} a minute{left}\n")
