"""Results of runs that never were, as many as one likes."""

from __future__ import annotations

import numpy as np

from pushplan.evaluation import ResultRow, Results


def many_rows(count: int, policies: int = 5) -> Results:
    """A run of so many rows, as no scenario was ever run."""
    rng = np.random.default_rng(0)
    rows = []
    for index in range(count):
        policy, scenario = index % policies, index // policies
        setting, seed = f"suite-{scenario % 4}", scenario // 4
        failed = rng.random() < 0.01
        metrics = {"E_nav": rng.uniform(0.5, 1.0), "I_nav": rng.uniform(0.7, 1.0)}
        row = ResultRow(
            policy=f"policy-{policy}",
            task="maze",
            simulator="pymunk",
            scenario=f"{setting}-{seed}",
            seed=seed,
            status="crashed" if failed else "done",
            reason="goal",
            success=not failed,
            metrics={"E_nav": 0.0} if failed else metrics,
            wall_time_s=rng.exponential(),
            job=f"{index:032x}",
        )
        rows.append(row)
    return Results(tuple(sorted(rows, key=lambda row: (row.policy, row.scenario))))
