"""`NetworkPolicy`: a function from observation to output, with its specification, as a policy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.learned.outputs import BadOutputError
from pushplan.learned.specification import Specification
from pushplan.observation import ObservationBuilder
from pushplan.world import InvalidInputError, World
from pushplan.world.checks import FloatArray

Function = Callable[[NDArray[Any]], NDArray[Any]]
"""From one observation, without batch axis, to the output for it."""


class NetworkPolicy:
    """Asks a network what to do, and holds each decision for as long as it was trained to.

    Args:
        function: the network.
        specification: what it sees and what its output means.
        label: what errors call it.
    """

    def __init__(
        self, function: Function, specification: Specification, label: str = "policy"
    ) -> None:
        self.specification = specification
        self.label = label
        self._function = function
        self._left = 0
        self._action: FloatArray = np.zeros(0)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.label!r})"

    @property
    def observation(self) -> ObservationBuilder:
        """What an environment has to observe for it."""
        return self.specification.observation

    @property
    def actions(self) -> tuple[str, ...]:
        """The action mode that it needs."""
        return (self.specification.action.mode,)

    def check_environment(self, env: Any, scenario: Any = None) -> None:
        """Refuse an environment that it was not made for.

        Raises:
            InvalidInputError: naming both sides.
        """
        self.specification.check_environment(env, self.label, scenario)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode.

        Raises:
            InvalidInputError: if the robot is another one than the network was made for.
        """
        self._left = 0
        if self.specification.robot is None:
            return
        if (difference := self.specification.robot.difference(world.robot)) is not None:
            raise InvalidInputError(f"policy {self.label!r} was made for {difference}")

    def act(self, world: World, observation: Any = None) -> FloatArray:
        """The action for this step.

        Args:
            world: the snapshot.
            observation: what the environment observed; made from ``world`` if None.

        Raises:
            InvalidInputError: if the observation has another shape or type.
            BadOutputError: if the network gives something that is no action.
        """
        if self._left == 0:
            seen = self.observation.observe(world) if observation is None else observation
            self._check(seen)
            try:
                action = self.specification.action.read(self._function(seen))
            except BadOutputError as error:
                raise BadOutputError(f"policy {self.label!r}: {error}") from None
            self._action = action.astype(np.float64)
            self._left = self.specification.action.repeat
        self._left -= 1
        return self._action

    def _check(self, seen: Any) -> None:
        shape, dtype = self.observation.shape, self.observation.dtype
        if isinstance(seen, np.ndarray) and seen.shape == shape and seen.dtype == dtype:
            return
        found = f"{getattr(seen, 'dtype', type(seen).__name__)} of shape {np.shape(seen)}"
        raise InvalidInputError(
            f"policy {self.label!r} was made for observations {dtype} of shape {shape}, "
            f"the environment gave {found}"
        )
