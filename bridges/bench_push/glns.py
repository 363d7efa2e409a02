"""The solver of pushplan, called as the original calls GLNS, which is written in Julia.

python glns.py FILE.gtsp -output=tour.txt
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from pushplan.gtsp import read_gtsp, solve_gtsp
from pushplan.world import MaxIterations


def main() -> None:
    """Solve a file and write the tour in the format of GLNS: its numbers in the eighth line."""
    file = sys.argv[1]
    output = sys.argv[2].removeprefix("-output=")
    began = time.perf_counter()
    instance = read_gtsp(file)
    stop = MaxIterations(20_000)
    rng = np.random.default_rng(0)
    tour = solve_gtsp(instance.costs, instance.clusters, stop=stop, rng=rng)
    nodes = [int(node) + 1 for node in tour.nodes]
    lines = [f"Problem Instance : {Path(file).name}", *["-"] * 5, f"Cost : {tour.cost}"]
    lines += [f"Tour Ordering : {nodes}", f"Solution Found : {time.perf_counter() - began:.3f}"]
    Path(output).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
