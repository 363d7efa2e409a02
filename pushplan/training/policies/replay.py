"""What a learner remembers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.world import InvalidInputError
from pushplan.world.checks import integer


class ReplayBuffer:
    """The last decisions, in arrays; images stay 8-bit.

    Args:
        size: how many.
        shape: of an observation.
        dtype: of an observation.
    """

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


_ARRAYS = ("seen", "next", "actions", "rewards", "discounts")
