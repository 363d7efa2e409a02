"""The tracking problem against the same problem put up and solved in other ways."""

from __future__ import annotations

import math
from types import SimpleNamespace

import casadi
import numpy as np
import pytest
from conftest import make_robot, make_u_maze
from scipy.optimize import minimize
from test_tracking_controllers import FLOOR, arc_plan

from pushplan.control import MpcConfig, MpcTracker

CURVATURE = 0.4
CENTRE = np.array([0.0, 1.0 / CURVATURE])
SIZE, SPEED, TURN = 0.8, 0.3, 0.5


def tuning(**changes: object) -> SimpleNamespace:
    fields: dict[str, object] = {
        "size": SIZE,
        "max_speed": SPEED,
        "max_turn_rate": TURN,
        "max_acceleration": math.inf,
        "stops": False,
        "optimise_speed": False,
        "heading_weight": 0.5,
        "turn_weight": 0.03,
        "smoothness": 0.004,
        "terminal": 4.0,
        "speed_weight": 0.2,
    }
    return SimpleNamespace(**{**fields, **changes})


def reference(count, tune):
    """The model and the cost on a circle in CasADi: square roots of terms, and their derivatives.

    A function of the inputs as fractions, the pose, the turn rate before and the steps.
    """
    z = casadi.SX.sym("z", 2 * count if tune.optimise_speed else count)
    pose, last, steps = (
        casadi.SX.sym("pose", 3),
        casadi.SX.sym("last"),
        casadi.SX.sym("steps", count),
    )
    unit = tune.size / tune.max_speed
    x, y, theta = pose[0], pose[1], pose[2]
    found = []
    before = last
    for k in range(count):
        turn = z[k] * TURN
        speed = z[count + k] * SPEED if tune.optimise_speed else SPEED
        part = steps[k] / 50
        for _ in range(50):  # many small steps instead of an exact arc
            x += speed * part * casadi.cos(theta + 0.5 * turn * part)
            y += speed * part * casadi.sin(theta + 0.5 * turn * part)
            theta += turn * part
        offset = 1.0 / CURVATURE - casadi.hypot(x - CENTRE[0], y - CENTRE[1])
        off = theta - casadi.atan2(y - CENTRE[1], x - CENTRE[0]) - math.pi / 2
        error = casadi.atan2(casadi.sin(off), casadi.cos(off))
        tau = steps[k] / unit
        weight = tau * (tune.terminal if k == count - 1 else 1.0)
        found.append(casadi.sqrt(weight) * offset / tune.size)
        found.append(casadi.sqrt(weight * tune.heading_weight) * error)
        found.append(casadi.sqrt(tau * tune.turn_weight) * unit * (turn - SPEED * CURVATURE))
        found.append(casadi.sqrt(tune.smoothness / tau) * unit * (turn - before))
        if tune.optimise_speed:
            found.append(casadi.sqrt(tau * tune.speed_weight) * (z[count + k] - 1.0))
        before = turn
    residuals = casadi.vertcat(*found)
    made = casadi.Function("f", [z, pose, last, steps], [residuals, casadi.jacobian(residuals, z)])
    return lambda *at: [part.full() for part in made(*at)]


@pytest.mark.parametrize("optimise", [False, True])
def test_repeated_it_solves_the_nonlinear_problem(optimise):
    drive = "differential" if optimise else "constant_speed"
    robot = make_robot(drive=drive, max_speed=SPEED, max_turn_rate=TURN)
    world = make_u_maze(static=FLOOR, robot=robot, robot_pose=[0, 0, 0])
    plan = arc_plan(world, [(11.0, CURVATURE)])
    world = world.moved(robot_pose=[0.2, 0.35, -0.3])
    config = MpcConfig(horizon=10, first_iterations=30, period=0.4, optimise_speed=optimise)
    tracker = MpcTracker(config)
    twist = tracker.command(world, plan)
    size = robot.circumscribed_radius
    tune = tuning(
        size=size,
        optimise_speed=optimise,
        heading_weight=config.heading_weight,
        turn_weight=config.turn_weight,
        smoothness=config.smoothness,
        terminal=config.terminal,
    )
    steps = np.full(10, config.reach * size / SPEED / 10)
    steps[0] = 0.4

    model = reference(10, tune)

    def cost(z):
        residuals, jacobian = model(z, world.robot_pose, 0.0, steps)
        return float((residuals**2).sum()), 2.0 * (jacobian.T @ residuals).ravel()

    best = minimize(
        cost,
        np.concatenate([np.zeros(10), np.ones(10 * optimise)]),
        bounds=[(-1, 1)] * 10 + [(0, 1)] * (10 * optimise),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": 2000, "ftol": 1e-13, "gtol": 1e-9},
    )
    assert twist.angular / TURN == pytest.approx(best.x[0], abs=5e-3)
    if optimise:
        assert twist.linear / SPEED == pytest.approx(best.x[10], abs=5e-3)
