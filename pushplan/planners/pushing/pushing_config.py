"""Parameters of the pushing controllers."""

from __future__ import annotations

from dataclasses import dataclass, field

from pushplan.planners.pushing.parameters import PushParameters
from pushplan.world.checks import expect, integer, number


@dataclass(frozen=True)
class PushingConfig:
    """Parameters of `PushingMpc`.

    L is the distance from the robot's axle to the centre of the box on its bumper, T = L / speed.
    The cost is the integral over time, in units of T, of the squares below, with the box's
    distance from its path in L and turn rates in 1 / T.

    Args:
        horizon: N, steps that are looked ahead.
        moves: commands that are chosen freely; each but the first holds for some steps. At most
            ``horizon``.
        reach: how far the steps reach at full speed [L]; they are equally long, but never shorter
            than the control period, and the first is the control period itself.
        heading: cost of a wrong direction of the push [1/rad²].
        offset: cost of the box's offset, per square of the fraction of half the bumper.
        rim: cost of an offset beyond ``safe``, the same.
        safe: fraction of half the bumper within which an offset costs no more than ``offset``.
        angle: cost of a box that does not lie on the bumper [1/rad²].
        grip: cost of a curvature beyond ``margin`` times the stable one.
        margin: fraction of the stable curvature that is used; light boxes in MuJoCo need 0.6
            to 0.7.
        turn: cost of turning otherwise than the path does.
        speed: cost of another speed than the path's, per square, as a fraction of ``max_speed``.
        smoothness: cost of changing speed and turn rate.
        terminal: factor on the cost of the last step.
        parameters: friction.
        delay: known time between a command and its effect [s].
        period: time for which the first command is held [s]; later ones are held for as long as
            the clock of the world shows.
        observer_gain: fraction by which a new pose corrects the predicted one; 1 where poses are
            exact, about 0.3 where they are off by some percent of the box.
        clearance: least distance of robot and box from static things [R, the robot's
            circumscribed radius]; what is nearer comes no nearer.
        iterations: quadratic programs solved in each call; 1 is the real-time iteration.
        first_iterations: those of the first call on a path.
        tolerance: of the solver, absolute and relative.
        solver_iterations: after which the solver gives up.
    """

    horizon: int = 20
    moves: int = 10
    reach: float = 3.0
    heading: float = 0.2
    offset: float = 0.02
    rim: float = 4.0
    safe: float = 0.6
    angle: float = 0.1
    grip: float = 0.03
    margin: float = 0.7
    turn: float = 0.02
    speed: float = 1.0
    smoothness: float = 0.01
    terminal: float = 3.0
    parameters: PushParameters = field(default_factory=PushParameters)
    delay: float = 0.0
    period: float = 0.1
    observer_gain: float = 1.0
    clearance: float = 0.02
    iterations: int = 1
    first_iterations: int = 4
    tolerance: float = 1e-5
    solver_iterations: int = 1000

    def __post_init__(self) -> None:
        integer("horizon", self.horizon, low=2, high=200)
        integer("moves", self.moves, low=2, high=self.horizon)
        for name in ("reach", "smoothness", "speed", "period", "tolerance"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        for name in ("heading", "offset", "rim", "angle", "grip", "turn", "delay", "clearance"):
            number(name, getattr(self, name), low=0.0)
        number("safe", self.safe, low=0.0, high=1.0)
        number("margin", self.margin, low=0.0, high=1.0, open_low=True)
        number("terminal", self.terminal, low=1.0)
        number("observer_gain", self.observer_gain, low=0.0, high=1.0, open_low=True)
        expect("parameters", self.parameters, PushParameters)
        for name in ("iterations", "first_iterations", "solver_iterations"):
            integer(name, getattr(self, name), low=1)
