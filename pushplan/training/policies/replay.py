"""What a learner remembers."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.world import InvalidInputError
from pushplan.world.checks import integer


class ReplayBuffer:
    """The last decisions, in arrays; images stay 8-bit."""

    def __init__(self, size: int, shape: tuple[int, ...], dtype: Any = np.uint8) -> None:
        self.size = integer("size", size, low=1)
        self.count, self.position = 0, 0
        self.seen = np.zeros((size, *shape), dtype)
        self.next = np.zeros((size, *shape), dtype)
        self.actions = np.zeros(size, np.int64)
        self.rewards = np.zeros(size, np.float32)
        self.discounts = np.zeros(size, np.float32)

    def __len__(self) -> int:
        return self.count

    def add(
        self,
        seen: NDArray[Any],
        action: int,
        reward: float,
        following: NDArray[Any],
        discount: float,
    ) -> None:
        """Remember a decision, and forget the oldest if there are too many.

        Args:
            seen: before it.
            action: number of the pixel.
            reward: of it, and of those after it that are looked ahead.
            following: what was seen after them.
            discount: of the value of that; 0 where the task was over then, not only cut off.
        """
        i = self.position
        self.seen[i], self.next[i] = seen, following
        self.actions[i], self.rewards[i], self.discounts[i] = action, reward, discount
        self.position = (i + 1) % self.size
        self.count = min(self.count + 1, self.size)

    def sample(self, count: int, rng: np.random.Generator) -> tuple[NDArray[Any], ...]:
        """Some decisions: seen, actions, rewards, following, discounts.

        Raises:
            InvalidInputError: if there are none yet.
        """
        if not self.count:
            raise InvalidInputError("the replay buffer is empty")
        chosen = rng.integers(self.count, size=count)
        arrays = (self.seen, self.actions, self.rewards, self.next, self.discounts)
        return tuple(array[chosen] for array in arrays)

    def state(self) -> dict[str, Any]:
        """Arrays and numbers from which `restore` makes the buffer again."""
        used = slice(0, self.count)
        return {
            "count": self.count,
            "position": self.position,
            **{name: getattr(self, name)[used] for name in _ARRAYS},
        }

    def restore(self, state: Any) -> None:
        """Take over what `state` gave."""
        self.count, self.position = int(state["count"]), int(state["position"])
        for name in _ARRAYS:
            getattr(self, name)[: self.count] = np.asarray(state[name])


class Lookahead:
    """Decisions of an episode whose rewards are still added up."""

    def __init__(self, memory: ReplayBuffer, discount: float, decisions: int) -> None:
        self._memory, self._discount, self._decisions = memory, discount, decisions
        self._open: deque[tuple[NDArray[Any], int, float]] = deque()

    def add(self, seen: NDArray[Any], action: int, reward: float) -> None:
        """A decision and what it brought."""
        self._open.append((seen, action, reward))

    def settle(self, following: NDArray[Any], terminated: bool, *, last: bool) -> None:
        """Hand over what has been looked ahead far enough; at the end of an episode everything."""
        while self._open and (last or len(self._open) >= self._decisions):
            rewards = [reward for _, _, reward in self._open]
            total = sum(self._discount**k * reward for k, reward in enumerate(rewards))
            left = 0.0 if terminated else self._discount ** len(rewards)
            seen, action, _ = self._open.popleft()
            self._memory.add(seen, action, total, following, left)


_ARRAYS = ("seen", "next", "actions", "rewards", "discounts")
