"""The tracking problem against the same problem put up and solved in other ways."""

from __future__ import annotations

import math
from types import SimpleNamespace

import casadi
import numpy as np
import osqp
import pytest
from conftest import make_robot, make_u_maze
from scipy.optimize import minimize
from scipy.sparse import csc_matrix
from test_tracking_controllers import FLOOR, arc_plan

from pushplan.control import MpcConfig, MpcTracker
from pushplan.core import control as core

CURVATURE = 0.4
CENTRE = np.array([0.0, 1.0 / CURVATURE])
SIZE, SPEED, TURN = 0.8, 0.3, 0.5


LENGTHS = np.arange(0.0, 12.0, 0.1)


def circle_track() -> core.ReferencePath:
    """A left turn of radius 1 / CURVATURE from the origin."""
    angle = LENGTHS * CURVATURE
    poses = np.column_stack([np.sin(angle) / CURVATURE, (1.0 - np.cos(angle)) / CURVATURE, angle])
    return core.ReferencePath(poses, LENGTHS, np.full(len(LENGTHS), SPEED))


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
@pytest.mark.parametrize("seed", range(2))
def test_the_assembled_problem_is_the_linearised_one(seed, optimise):
    rng = np.random.default_rng(seed)
    tune, count = tuning(optimise_speed=optimise), 8
    n = 2 * count if optimise else count
    pose = np.array([0.3, 0.0, 0.1]) + rng.uniform(-0.3, 0.3, 3)
    steps = np.full(count, 0.4)
    steps[0] = 0.1
    nominal = np.column_stack([np.full(count, SPEED), SPEED * CURVATURE * np.ones(count)])
    nominal[:, 1] += rng.uniform(-0.1, 0.1, count)
    if optimise:  # the price of turning is taken about the nominal speed: keep it where that is v
        nominal[:, 0] = SPEED
    z = nominal[:, 1] / TURN
    z = np.concatenate([z, nominal[:, 0] / SPEED]) if optimise else z
    hessian, gradient = np.empty((n, n)), np.empty(n)
    last = rng.uniform(-0.2, 0.2)
    twist = np.array([SPEED, last])
    place = (pose, 0.3, twist, steps, nominal.copy())
    weights = core.Tuning(**vars(tune))
    core.TrackingAssembly(n).assemble(circle_track(), weights, *place, hessian, gradient)
    residuals, jacobian = reference(count, tune)(z, pose, last, steps)
    expected = jacobian.T @ jacobian
    slope = (jacobian.T @ residuals).ravel()
    assert hessian == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    assert hessian @ z + gradient == pytest.approx(slope, abs=2e-3 * np.abs(slope).max())


def test_repeated_it_solves_the_nonlinear_problem():
    robot = make_robot(max_speed=SPEED, max_turn_rate=TURN)
    world = make_u_maze(static=FLOOR, robot=robot, robot_pose=[0, 0, 0])
    plan = arc_plan(world, [(11.0, CURVATURE)])
    world = world.moved(robot_pose=[0.2, 0.35, -0.3])
    config = MpcConfig(horizon=10, first_iterations=30, period=0.4)
    tracker = MpcTracker(config)
    twist = tracker.command(world, plan)
    size = robot.circumscribed_radius
    tune = tuning(
        size=size,
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
        np.zeros(10),
        bounds=[(-1, 1)] * 10,
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": 2000, "ftol": 1e-13, "gtol": 1e-9},
    )
    assert twist.angular / TURN == pytest.approx(best.x[0], abs=5e-3)


def random_problem(rng, blocks: int, horizon: int):
    """P of full rank, q, and bounds that hold some of the inputs and changes."""
    n = blocks * horizon
    factor = rng.normal(size=(n + 4, n)) * np.exp(rng.uniform(-2, 1, n))
    hessian = factor.T @ factor / n + 0.01 * np.eye(n)
    gradient = 3.0 * rng.normal(size=n)
    low, high = -np.ones(2 * n), np.ones(2 * n)
    low[n:], high[n:] = -rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.5)
    return hessian, gradient, low, high


class Program:
    """`QuadraticProgram` of the core with the solution out."""

    def __init__(self, blocks, horizon, tolerance=1e-6):
        settings = core.SolverSettings(tolerance, 2000, 1, 1)
        firsts = np.arange(blocks) * horizon
        self.core = core.QuadraticProgram(blocks * horizon, horizon, firsts, settings)

    def solve(self, hessian, gradient, low, high, start):
        x = start.copy()
        return x if self.core.solve(hessian, gradient, low, high, x) else None


class ProgramOfOsqp:
    """The same program for OSQP's package, set up and updated in the same way."""

    def __init__(self, blocks, horizon, tolerance=1e-6):
        n = blocks * horizon
        change = np.kron(np.eye(blocks), np.eye(horizon) - np.eye(horizon, k=-1))
        self.upper = np.tril_indices(n)[::-1]
        self.solver = osqp.OSQP()
        self.solver.setup(
            csc_matrix((np.ones(len(self.upper[0])), self.upper), shape=(n, n)),
            np.zeros(n),
            csc_matrix(np.vstack([np.eye(n), change])),
            -np.ones(2 * n),
            np.ones(2 * n),
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iter=2000,
            scaling=0,
            adaptive_rho_interval=20,
            check_termination=5,
            verbose=False,
        )

    def solve(self, hessian, gradient, low, high, start):
        scale = len(gradient) / float(np.trace(hessian))
        self.solver.update(q=scale * gradient, l=low, u=high, Px=scale * hessian[self.upper])
        self.solver.warm_start(x=start)
        return self.solver.solve(raise_error=False).x


@pytest.mark.parametrize(("blocks", "horizon"), [(1, 20), (2, 10), (2, 20)])
def test_the_solver_is_osqp(blocks, horizon):
    """Step for step: what takes other steps to the solution differs by the tolerance, 1e-6."""
    rng = np.random.default_rng(blocks * horizon)
    program = Program(blocks, horizon)
    reference = ProgramOfOsqp(blocks, horizon)
    start = np.zeros(blocks * horizon)
    for _ in range(20):
        problem = random_problem(rng, blocks, horizon)
        found = program.solve(*problem, start)
        expected = reference.solve(*problem, start)
        assert found == pytest.approx(expected, abs=1e-12)
        start = found


@pytest.mark.parametrize("blocks", [1, 2])
def test_the_solver_agrees_with_an_active_set_method(blocks):
    rng = np.random.default_rng(blocks)
    horizon = 12
    n = blocks * horizon
    program = Program(blocks, horizon, tolerance=1e-7)
    change = np.kron(np.eye(blocks), np.eye(horizon) - np.eye(horizon, k=-1))
    reference = casadi.conic(
        "reference",
        "daqp",
        {"h": casadi.Sparsity.dense(n, n), "a": casadi.Sparsity.dense(n, n)},
    )
    held = 0
    for _ in range(30):
        hessian, gradient, low, high = random_problem(rng, blocks, horizon)
        found = program.solve(hessian, gradient, low, high, np.zeros(n))
        answer = reference(
            h=hessian, g=gradient, a=change, lbx=low[:n], ubx=high[:n], lba=low[n:], uba=high[n:]
        )
        expected = np.array(answer["x"]).ravel()
        assert found == pytest.approx(expected, abs=2e-4)
        held += int((np.abs(np.abs(change @ expected) - np.abs(high[n:])) < 1e-6).sum())
    assert held > 20  # limits mattered


def test_what_cannot_be_met_has_no_solution():
    program = Program(1, 4)
    low, high = -np.ones(8), np.ones(8)
    free = program.solve(np.eye(4), np.ones(4), low, high, np.zeros(4))
    assert free == pytest.approx(-np.ones(4), abs=1e-5)
    low[4], high[4] = 2.0, 3.0  # the first input would have to jump beyond its bound
    assert program.solve(np.eye(4), np.ones(4), low, high, np.zeros(4)) is None
    low[4], high[4] = -1.0, 1.0
    again = program.solve(np.eye(4), np.ones(4), low, high, np.zeros(4))
    assert again == pytest.approx(free, abs=1e-5)


@pytest.mark.parametrize("along", [0.0, 0.37, 5.0, 11.8])
@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.3])
def test_places_and_errors_on_a_circle(along, offset):
    track = circle_track()
    angle = CURVATURE * along
    x, y = CENTRE + (1.0 / CURVATURE - offset) * np.array([math.sin(angle), -math.cos(angle)])
    place, index, share = track.locate(x, y, max(along - 1.0, 0.0), along + 1.0)
    found = track.errors(x, y, angle + 0.2, index, share)
    assert place == pytest.approx(along, abs=0.02)  # the foot is on a chord, not on the arc
    assert found[0] == pytest.approx(offset, abs=2e-3)
    assert found[1:] == pytest.approx((0.2, angle, CURVATURE), abs=0.01)


def test_past_the_end_the_path_goes_on_straight():
    track = circle_track()
    theta = CURVATURE * LENGTHS[-1]
    x, y = CENTRE + np.array([math.sin(theta), -math.cos(theta)]) / CURVATURE
    over = [x + 2.0 * math.cos(theta), y + 2.0 * math.sin(theta)]
    place, index, share = track.locate(*over, 11.0, 20.0)
    assert place == pytest.approx(LENGTHS[-1] + 2.0)
    assert track.errors(*over, theta, index, share)[:3] == pytest.approx((0.0, 0.0, theta))
