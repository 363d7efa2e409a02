"""One call of the kinodynamic planner."""

from __future__ import annotations

import numpy as np

from pushplan.motion.path_improver import Candidate, PathImprover
from pushplan.motion.random_tree.tree_paths import TreePaths
from pushplan.world import PlanStatus


class KinodynamicSearch:
    """One planning call: trees, and shortcutting of their paths."""

    def __init__(
        self,
        improver: PathImprover,  # keeps the best path
    ) -> None:
        self.improver, self.trees = improver, TreePaths(improver)

    def run(self) -> PlanStatus | None:
        """Search until the stop rule fires; None where there is no plan by then."""
        improver, trees = self.improver, self.trees
        status = improver.begin()
        if status is not None:
            return status
        while not improver.stopped():
            self._one_round()
            if trees.sealed:
                return PlanStatus.GOAL_UNREACHABLE
            if not improver.solved:
                trees.relax()
        return PlanStatus.SOLVED if improver.solved else None

    def _one_round(self) -> None:
        """A path around the objects and one among them; the cheaper is worked out further."""
        improver, config = self.improver, self.improver.config
        cheaper: Candidate | None = None
        for weight, budget in (
            (np.inf, config.avoid_iterations),
            (config.push_weight, config.tree_iterations),
        ):
            if improver.stopped():
                return
            candidate = self.trees.grow(weight, budget)
            if candidate is None:
                continue
            improver.shortcut(candidate)
            if cheaper is None or candidate.cost < cheaper.cost:
                cheaper = candidate
        while cheaper is not None and not improver.stopped():
            before = cheaper.cost
            improver.shortcut(cheaper)
            if cheaper.cost > (1.0 - config.least_gain) * before:
                return
