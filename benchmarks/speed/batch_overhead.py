"""What a batch costs beside its episodes, and what a second worker gains.

    python -m benchmarks.speed.batch_overhead [--jobs 10000] [--suite maze-2d-5] [--episodes 40]

The trivial jobs drive a robot of the tests for five steps: what they take in a worker is taken
off, what is left is sending, storing and noting. Memory is that of this process. The second table
runs a suite with one and with two workers, in turns, and prints the ratio of the wall times.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "evaluation"))
import itertools

from evaluation_doubles import HERE, LineScenario

from benchmarks.reporting import command_line, resident_mb
from pushplan.evaluation import Job, JobSettings, ResultRow, bench, parse_policies, run_batch


def main() -> None:
    """Measure, write both tables."""
    parser = command_line(__doc__, episodes=40)
    parser.add_argument("--jobs", type=int, default=10_000)
    parser.add_argument("--suite", default="maze-2d-5")
    parser.add_argument("--policy", default="push-aware")
    options = parser.parse_args()
    overhead(options.jobs)
    scaling(options.suite, options.policy, options.episodes)


def overhead(count: int) -> None:
    """Trivial jobs with two workers."""
    (spec,) = parse_policies([f"{HERE}:Ahead"])
    jobs = [Job(spec, LineScenario(seed)) for seed in range(count)]
    settings = JobSettings(make_env=f"{HERE}:make_env", timeout_s=30.0)
    memory: list[float] = []

    def note(done: int, total: int, row: ResultRow | None) -> None:
        if done in (total // 10, total // 2, total):
            memory.append(resident_mb())

    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        rows = run_batch(jobs, out=folder, workers=2, settings=settings, progress=note)
        took = time.perf_counter() - began
    inside = sum(row.wall_time_s or 0.0 for row in rows) / 2.0
    grown = ", ".join(f"{b - a:+.1f}" for a, b in itertools.pairwise(memory))
    print("| jobs | workers | wall | per job | of it in the episode | overhead | memory |")
    print("|---|---|---|---|---|---|---|")
    print(
        f"| {count:,} | 2 | {took:.1f} s | {1e3 * took / count:.2f} ms | "
        f"{1e3 * inside / count:.2f} ms | {1e3 * (took - inside) / count:.2f} ms | {grown} MB |\n",
        flush=True,
    )


def scaling(suite: str, policy: str, episodes: int) -> None:
    """One worker and two, in turns."""
    bench(suite, policy, episodes=2, workers=2)  # compiles
    took: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(3):
        for workers, times in took.items():
            began = time.perf_counter()
            bench(suite, policy, episodes=episodes, workers=workers)
            times.append(time.perf_counter() - began)
    one, two = (min(times) for times in took.values())
    print("| suite | policy | episodes | 1 worker | 2 workers | ratio |\n|---|---|---|---|---|---|")
    print(f"| {suite} | {policy} | {episodes} | {one:.1f} s | {two:.1f} s | {one / two:.2f} |")


if __name__ == "__main__":
    main()
