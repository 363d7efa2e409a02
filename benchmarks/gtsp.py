"""The sequencing solver: exact times, proofs, and gaps on public instances, as Markdown.

    python benchmarks/gtsp.py FOLDER [--seeds 3] [--cpu] [--only exact proofs public]

FOLDER holds `*.gtsp` and `best_known.csv` (columns instance, nodes, clusters, best_known).
Push-like and unstructured instances are made here. Times are wall-clock; the load of the machine
is printed. With --cpu all of them, the budgets too, are of processor time, so that other programs
matter less: the solver has one thread.
"""

from __future__ import annotations

import argparse
import csv
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pushplan.gtsp import (
    GtspConfig,
    TourStatus,
    read_gtsp,
    solve_gtsp,
    warm_up_solver,
)
from pushplan.world import Deadline

FIRST_SEED = 3000
"""Settings were chosen on seeds from 1000 on."""
PARTS = ("exact", "proofs", "unstructured", "public", "large")
PROOF_SECONDS = 10.0
SEARCH_SHARE = 0.02
"""Of these seconds, for the search before the proof."""


def pushes(boxes: int, options: int, seed: int) -> tuple[np.ndarray, list[list[int]]]:
    """A robot in a 10 m square, boxes, straight pushes of each over the nearest edge on their way.

    Costs are the approach to the pushing pose, 1 for each metre of it, the push, 2 for each metre,
    and up to 0.5 for each push; going back to the start is free.
    """
    rng = np.random.default_rng(seed)
    box = rng.uniform(1.0, 9.0, (boxes, 1, 2))
    angle = rng.uniform(0.0, 2.0 * np.pi, (boxes, 1)) + np.arange(options) * 2.0 * np.pi / options
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    with np.errstate(divide="ignore"):
        out = np.where(way > 0.0, (10.0 - box) / way, -box / way).min(axis=-1)
    begin = np.concatenate([[[5.0, 5.0]], (box - 0.6 * way).reshape(-1, 2)])
    end = np.concatenate([[[5.0, 5.0]], (box + way * out[..., None]).reshape(-1, 2)])
    costs = np.linalg.norm(end[:, None] - begin[None], axis=-1)
    costs[:, 1:] += (2.0 * out + rng.uniform(0.0, 0.5, out.shape)).reshape(-1)
    costs[:, 0] = 0.0
    groups = [list(range(1 + b * options, 1 + (b + 1) * options)) for b in range(boxes)]
    return costs, [[0], *groups]


def timed(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def exact(seeds: int) -> None:
    print("| exact: boxes x 16 pushes and a start | median | lower quartile |\n|---|---|---|")
    for boxes in (10, 12, 13, 15):
        times = []
        for seed in range(FIRST_SEED, FIRST_SEED + max(seeds, 5)):
            costs, clusters = pushes(boxes, 16, seed)
            config = GtspConfig(method="exact")
            times.append(timed(lambda c=costs, g=clusters, k=config: solve_gtsp(c, g, config=k)))
        low, middle = np.percentile(times, (25, 50)) * 1e3
        print(f"| {boxes} | {middle:.0f} ms | {low:.0f} ms |", flush=True)


def proofs(seeds: int) -> None:
    """20 boxes: when the optimum was found, when it was proven."""
    found, proven, late, missed = [], [], 0, 0
    for seed in range(FIRST_SEED, FIRST_SEED + max(seeds, 20)):
        costs, clusters = pushes(20, 16, seed)
        config = GtspConfig(method="search", lower_bound=True, proof_fraction=1.0 - SEARCH_SHARE)
        tour = solve_gtsp(costs, clusters, stop=Deadline(PROOF_SECONDS), config=config)
        if tour.status is not TourStatus.OPTIMAL:
            missed += 1
            continue
        searched = SEARCH_SHARE * PROOF_SECONDS
        found.append(tour.stats.best_s)
        proven.append(tour.stats.wall_time_s - searched)
        late += tour.stats.best_s > searched + 0.02
    print("\n| 20 boxes x 16 pushes | median | lower quartile | worst |\n|---|---|---|---|")
    for name, times in (("optimum found after", found), ("certificate takes", proven)):
        if times:
            low, middle = np.percentile(times, (25, 50))
            print(f"| {name} | {middle:.3f} s | {low:.3f} s | {max(times):.2f} s |")
    print(
        f"\n{len(found)} proven within {PROOF_SECONDS:g} s, {missed} not; in {late} of them the "
        f"search of {SEARCH_SHARE * PROOF_SECONDS:.1f} s had missed the optimum.",
        flush=True,
    )


def unstructured(seeds: int) -> None:
    print("\n| 20 clusters x 16 nodes, costs 0-999 drawn at random | 1 s | 10 s |\n|---|---|---|")
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        costs = np.random.default_rng(seed).integers(0, 1000, (320, 320))
        clusters = [range(16 * c, 16 * c + 16) for c in range(20)]
        rows = [solve_gtsp(costs, clusters, stop=Deadline(s)).cost for s in (1.0, 10.0)]
        print(f"| seed {seed} | {rows[0]:g} | {rows[1]:g} |", flush=True)


def public(folder: Path, seeds: int) -> None:
    with (folder / "best_known.csv").open() as file:
        known = {row["instance"]: float(row["best_known"]) for row in csv.DictReader(file)}
    print("\n| instance | best known | gap at 1 s (mean, worst) | at 10 s (mean, worst) |")
    print("|---|---|---|---|")
    all_gaps: dict[float, list[float]] = {1.0: [], 10.0: []}
    for name, best in known.items():
        instance = read_gtsp(folder / f"{name}.gtsp")
        cells = []
        for seconds, gaps in all_gaps.items():
            own = []
            for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                rng = np.random.default_rng(seed)
                stop = Deadline(seconds)
                tour = solve_gtsp(instance.costs, instance.clusters, stop=stop, rng=rng)
                own.append(100.0 * (tour.cost / best - 1.0))
            gaps += own
            cells.append(f"{np.mean(own):.2f} %, {max(own):.2f} %")
        print(f"| {name} | {best:g} | {' | '.join(cells)} |", flush=True)
    means = [f"{np.mean(gaps):.3f} %, {max(gaps):.2f} %" for gaps in all_gaps.values()]
    print(f"| all | | {' | '.join(means)} |", flush=True)


def large() -> None:
    """Ten times 20 boxes, with 40 pushes each: 8001 nodes."""
    costs, clusters = pushes(200, 40, FIRST_SEED)
    print("\n| 200 boxes x 40 pushes | cost | wall time |\n|---|---|---|")
    for seconds in (1.0, 10.0):
        tour = solve_gtsp(costs, clusters, stop=Deadline(seconds))
        print(f"| {seconds:g} s | {tour.cost:.2f} | {tour.stats.wall_time_s:.3f} s |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--cpu", action="store_true", help="processor time instead of wall-clock")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    options = parser.parse_args()
    warm_up_solver()
    if options.cpu:
        time.perf_counter = time.process_time
    clock = "processor time" if options.cpu else "wall-clock time"
    print(f"Load of the machine at the start: {os.getloadavg()[0]:.1f}; {clock}\n", flush=True)
    parts: dict[str, Callable[[], None]] = {
        "exact": lambda: exact(options.seeds),
        "proofs": lambda: proofs(options.seeds),
        "unstructured": lambda: unstructured(options.seeds),
        "public": lambda: public(options.folder, options.seeds),
        "large": large,
    }
    for name in options.only:
        parts[name]()


if __name__ == "__main__":
    main()
