"""Control sequences: knots in time, their interpolation, and random ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.world import Drive, RobotModel
from pushplan.world.checks import FloatArray

SPEED = 0
TURN = 1
"""Columns of controls: speed and turn rate, as fractions of the greatest ones."""


@dataclass(frozen=True, eq=False)
class ControlSequence:
    """Controls that change linearly from knot to knot.

    Args:
        begins: time of the first knot [s].
        horizon: time from the first to the last knot [s].
        knots: (M, 2) speed and turn rate at each, as fractions of the greatest ones.
    """

    begins: float
    horizon: float
    knots: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        """(T, 2) controls at times (T,) [s]; before and after, those of the first and last knot."""
        grid = self.begins + self.horizon * np.linspace(0.0, 1.0, len(self.knots))
        return np.column_stack([np.interp(times, grid, column) for column in self.knots.T])

    def later(self, time: float) -> ControlSequence:
        """The same from a later time on, with the last controls held beyond its end."""
        grid = time + self.horizon * np.linspace(0.0, 1.0, len(self.knots))
        return ControlSequence(time, self.horizon, self.at(grid))


def interpolation(steps: int, knots: int) -> FloatArray:
    """(H, M) matrix that gives the controls in the middle of each step from those at the knots."""
    places = (np.arange(steps) + 0.5) / steps * (knots - 1)
    left = np.minimum(places.astype(np.int64), knots - 2)
    rows = np.arange(steps)
    share = places - left
    matrix = np.zeros((steps, knots))
    matrix[rows, left] = 1.0 - share
    matrix[rows, left + 1] = share
    return matrix


def least_controls(robot: RobotModel) -> FloatArray:
    """(2,) the least speed and turn rate, as fractions of the greatest ones."""
    return np.array([robot.min_speed / robot.max_speed, -1.0])


def resting(
    robot: RobotModel, config: MppiConfig, begins: float, horizon: float
) -> ControlSequence:
    """Standing, or straight on where the robot cannot stand."""
    knots = np.zeros((config.knots, 2))
    knots[:, SPEED] = 0.0 if robot.can_stop else 1.0
    return ControlSequence(begins, horizon, knots)


def first_spread(robot: RobotModel, config: MppiConfig) -> FloatArray:
    """(M, 2) standard deviation of the noise at the knots."""
    spread = np.tile([config.speed_noise, config.turn_noise], (config.knots, 1))
    if robot.drive is Drive.CONSTANT_SPEED:
        spread[:, SPEED] = 0.0
    return spread


def draw(
    rng: np.random.Generator,
    mean: FloatArray,  # (M, 2) controls at the knots
    spread: FloatArray,  # (M, 2) standard deviation of the noise
    low: FloatArray,  # (2,) the least controls
    config: MppiConfig,
) -> FloatArray:
    """(S, M, 2) random knots: the mean itself, arcs of any curvature, and the mean with noise."""
    noise = rng.standard_normal((config.samples, *mean.shape))
    samples = np.clip(mean + spread * noise, low, 1.0)
    arcs = 1 + round(config.exploring * (config.samples - 1))
    constant = rng.uniform(low, 1.0, (config.samples, 1, 2))
    samples[1:arcs] = constant[1:arcs]
    samples[0] = mean
    return samples
