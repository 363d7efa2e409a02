"""`PushHistory`: which pushes have failed, and which objects have been relocated."""

from __future__ import annotations

import copy
import math
from collections import Counter

from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig

_FAILURE_COST = 3.0  # of a push, for each time that it has failed [circumscribed radii]
_RELOCATION_COST = 1.0
"""Of a relocation, for each one of its object since something was done [circumscribed radii]."""


class PushHistory:
    """What has been tried since something was done last, and what that adds to costs.

    Args:
        config: settings.
    """

    def __init__(self, config: RearrangementConfig) -> None:
        self._config = config
        self._failures: Counter[tuple[object, ...]] = Counter()
        self._relocations: Counter[int] = Counter()

    def copy(self) -> PushHistory:
        """As it is now, for a search that goes on beside driving."""
        other = copy.copy(self)
        other._failures, other._relocations = self._failures.copy(), self._relocations.copy()
        return other

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to forget."""
        return not (self._failures or self._relocations)

    @property
    def has_failures(self) -> bool:
        """Whether any push has failed."""
        return bool(self._failures)

    def failed_before(self, push: Push) -> bool:
        """Whether a push like this one has failed."""
        return signature(push) in self._failures

    def penalty(self, push: Push, size: float) -> float:
        """What is added to the cost of a push [m].

        Args:
            push: the push.
            size: circumscribed radius of the robot [m].
        """
        failures, config = self._failures[signature(push)], self._config
        relocations = self._relocations[push.target] if push.relocates else 0
        if failures >= config.max_failures or relocations >= config.max_relocations:
            return math.inf
        return (failures * _FAILURE_COST + relocations * _RELOCATION_COST) * size

    def count_failure(self, push: Push) -> None:
        """A push did not do what it was for, or was a relocation: another one comes next."""
        self._failures[signature(push)] += 1

    def count_relocation(self, push: Push) -> None:
        """An object was relocated: what has failed with it before may succeed from there."""
        self._relocations[push.target] += 1
        self._failures = Counter(
            {
                key: count
                for key, count in self._failures.items()
                if key[0] != push.target or key[1] == push.controller
            }
        )

    def count_progress(self) -> None:
        """Something was done, or has come back: what was ruled out is tried once more."""
        most = self._config.max_failures - 1
        self._failures = Counter({key: min(n, most) for key, n in self._failures.items()})
        self._relocations.clear()

    def forget_failures(self) -> None:
        """Try everything anew."""
        self._failures.clear()
