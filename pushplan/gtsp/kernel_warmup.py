"""Load the compiled kernels before the first call that has a deadline."""

from __future__ import annotations

import numpy as np

from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.solve import solve_gtsp
from pushplan.world.stop import MaxIterations


def warm_up_solver(proof: bool = True) -> None:
    """Solve a small instance in every way, so that later calls find compiled kernels.

    Args:
        proof: whether also with a lower bound.
    """
    costs = np.random.default_rng(0).random((14, 14))
    clusters = [range(2 * c, 2 * c + 2) for c in range(7)]
    solve_gtsp(costs, clusters)
    config = GtspConfig(method="search", lower_bound=proof)
    solve_gtsp(costs, clusters, stop=MaxIterations(50), config=config)
