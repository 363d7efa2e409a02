"""What a learner remembers."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ReplayBuffer:
    """The last decisions, in arrays; images stay 8-bit."""

    def __init__(self, size: int, shape: tuple[int, ...]) -> None:
        self.size = size
        self.count, self.position = 0, 0
        self.arrays: dict[str, NDArray[Any]] = {
            "seen": np.zeros((size, *shape), np.uint8),
            "actions": np.zeros(size, np.int64),
            "rewards": np.zeros(size, np.float32),
            "next": np.zeros((size, *shape), np.uint8),
            "discounts": np.zeros(size, np.float32),
        }

    def add(self, *decision: Any) -> None:
        """Remember a decision, and forget the oldest if there are too many.

        Args:
            decision: what was seen before it; the number of its pixel; its reward, with those that
                are looked ahead; what was seen after them; the discount of the value of that, 0
                where the task was over then, not only cut off.
        """
        for array, value in zip(self.arrays.values(), decision, strict=True):
            array[self.position] = value
        self.position = (self.position + 1) % self.size
        self.count = min(self.count + 1, self.size)

    def sample(self, count: int, rng: np.random.Generator) -> tuple[NDArray[Any], ...]:
        """Some decisions: seen, actions, rewards, seen after them, discounts."""
        chosen = rng.integers(self.count, size=count)
        return tuple(array[chosen] for array in self.arrays.values())

    def state(self) -> dict[str, Any]:
        """Arrays and numbers from which `restore` makes the buffer again."""
        used = {name: array[: self.count] for name, array in self.arrays.items()}
        return {"count": self.count, "position": self.position, **used}

    def restore(self, state: Any) -> None:
        """Take over what `state` gave."""
        self.count, self.position = int(state["count"]), int(state["position"])
        for name, array in self.arrays.items():
            array[: self.count] = np.asarray(state[name])


class Lookahead:
    """Decisions of an episode whose rewards are still added up."""

    def __init__(self, memory: ReplayBuffer, discount: float, decisions: int) -> None:
        self._memory, self._discount, self._decisions = memory, discount, decisions
        self._open: deque[tuple[NDArray[Any], int, float]] = deque()

    def add(
        self,
        seen: NDArray[Any],
        action: int,
        reward: float,
        following: NDArray[Any],
        *,
        terminated: bool,
        last: bool,
    ) -> None:
        """A decision and what it brought; hands over what has been looked ahead far enough.

        Args:
            seen: before it.
            action: number of the pixel.
            reward: of it.
            following: what was seen after it.
            terminated: whether the task was over then.
            last: whether the episode was, which hands over everything.
        """
        self._open.append((seen, action, reward))
        while self._open and (last or len(self._open) >= self._decisions):
            rewards = [one for _, _, one in self._open]
            total = sum(self._discount**k * one for k, one in enumerate(rewards))
            left = 0.0 if terminated else self._discount ** len(rewards)
            first, chosen, _ = self._open.popleft()
            self._memory.add(first, chosen, total, following, left)
