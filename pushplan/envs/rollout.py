"""The simulator, run ahead from a snapshot, as an interaction model: slow, and the reference."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from pushplan.envs.registry import SIMULATORS
from pushplan.envs.simulators.base import Materials, Simulator
from pushplan.imports.on_demand import look_up
from pushplan.interaction.interaction_model import Interaction
from pushplan.world import World


class RolloutInteraction:
    """Interaction model that asks a simulator what sweeping the robot along a path does.

    Args:
        simulator: name of the simulator.
        materials: friction and rolling; those of the task that is planned for. Objects grip
            nothing by default.
    """

    def __init__(self, simulator: str = "pymunk", materials: Materials | None = None) -> None:
        engine: type[Simulator] = look_up("simulator", SIMULATORS, simulator)
        self._simulator = engine()
        self._materials = materials or Materials()

    def sweep(self, world: World, path: ArrayLike) -> Interaction:
        """Predict the motion of every object along (N, 3) robot poses x, y [m], theta [rad].

        Raises:
            InvalidInputError: if the path is not (N, 3), empty, or not finite.
        """
        self._simulator.build(world, self._materials)
        return self._simulator.follow(path)

    def sweep_many(self, world: World, paths: Sequence[ArrayLike]) -> list[Interaction]:
        """Do as `sweep` for each of several paths; the scene is built once for all of them."""
        simulator = self._simulator
        simulator.build(world, self._materials)
        start = simulator.save()
        found = []
        for path in paths:
            simulator.restore(start)
            found.append(simulator.follow(path))
        return found
