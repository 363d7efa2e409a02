"""Parameters of the predictive tracker."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world import InvalidInputError
from pushplan.world.checks import integer, number


@dataclass(frozen=True)
class MpcConfig:
    """Parameters of `MpcTracker`. R is the robot's circumscribed radius, T = R / max_speed.

    The cost is the integral over time, in units of T, of offset² + ``heading_weight`` heading² +
    ``turn_weight`` (turn rate less that of the path)² + ``smoothness`` (change of turn rate)²,
    with offsets in R, turn rates in 1 / T and their changes in 1 / T².

    Args:
        horizon: N, steps that are looked ahead.
        reach: how far they reach at full speed [R]; the steps are equally long, but never shorter
            than the control period, and the first is the control period itself.
        heading_weight: cost of a heading error [1/rad²].
        turn_weight: cost of turning otherwise than the path does.
        smoothness: cost of changing the turn rate; more is calmer under noise and slower to
            return to the path.
        terminal: factor on the cost of the last step's errors, for what comes after it.
        optimise_speed: let a differential drive depart from the plan's speed.
        speed_weight: cost of doing so, per square of the fraction of ``max_speed``.
        iterations: quadratic programs solved in each call; 1 is the real-time iteration.
        first_iterations: those of the first call on a plan, which has no solution to start from.
        delay: known time between a command and its effect [s]; the pose is predicted over it.
        period: time for which the first command is held [s]; later ones are held for as long as
            the clock of the world shows.
        tolerance: of the solver, absolute and relative.
        solver_iterations: after which the solver gives up.
    """

    horizon: int = 20
    reach: float = 3.0
    heading_weight: float = 0.5
    turn_weight: float = 0.02
    smoothness: float = 0.001
    terminal: float = 4.0
    optimise_speed: bool = False
    speed_weight: float = 0.2
    iterations: int = 1
    first_iterations: int = 4
    delay: float = 0.0
    period: float = 0.1
    tolerance: float = 1e-6
    solver_iterations: int = 2000

    def __post_init__(self) -> None:
        integer("horizon", self.horizon, low=2, high=100)
        for name in ("reach", "smoothness", "speed_weight", "period", "tolerance"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        for name in ("heading_weight", "turn_weight", "delay"):
            number(name, getattr(self, name), low=0.0)
        number("terminal", self.terminal, low=1.0)
        if not isinstance(self.optimise_speed, bool):
            raise InvalidInputError(
                f"optimise_speed must be True or False, got {self.optimise_speed!r}"
            )
        for name in ("iterations", "first_iterations", "solver_iterations"):
            integer(name, getattr(self, name), low=1)
