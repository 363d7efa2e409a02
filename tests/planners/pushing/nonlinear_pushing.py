"""`NonlinearPushingMpc`: the same problem, solved to the end by CasADi and IPOPT.

It says how much the quadratic program gives away, and takes a hundred times as long.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi
import numpy as np

from pushplan.control.mpc.tracker import track_of
from pushplan.core import pushing as core
from pushplan.planners.pushing.mpc import _SAFE_FRACTION, _WEIGHTS, PushingMpc, groups_of
from pushplan.world import Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, IntArray

FLUSH = 1e-9  # angle below which a box counts as lying on the bumper [rad]
SPEED_SMOOTHNESS = 0.1  # cost of a change of speed, against that of turn rate
_MOST_OFFSET, _MOST_GAP = 1.5, 2.0  # that the problem is solved for [half bumpers, L]
_LEAST_SPEED = 0.4  # of a push, as a fraction of the greatest
_SUBSTEPS = 2
_ROUNDS = 3  # how often the box's places on the path are looked up again
_SETTINGS: dict[str, Any] = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 150,
    "ipopt.tol": 1e-6,
    "ipopt.acceptable_tol": 1e-4,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_strategy": "adaptive",
    "print_time": False,
    "error_on_fail": False,
}


class NonlinearPushingMpc(PushingMpc):
    """`PushingMpc` that also solves each problem as it is, by an interior-point method.

    It starts from the solution of the quadratic program, which is what it drives.
    """

    _solver_of: tuple[Any, ...] | None = None
    _sent = np.zeros(2)  # the command before
    gain: tuple[float, float] = (0.0, 0.0)
    """Cost of the quadratic program's commands, and of the best ones, at the last call."""

    def _follow(self, world: World, plan: Plan) -> Twist:
        before = self._sent
        twist = super()._follow(world, plan)
        self._sent = np.array([twist.linear, twist.angular])
        if self.along < plan.arc_lengths[-1] - 1e-9:
            self._refine(world.robot, before)
        return twist

    def _refine(self, robot: RobotModel, last: FloatArray) -> None:
        """Compare commands (M, 2) of the solution with what IPOPT makes of them."""
        config, nominal = self.config, self._tracker.solution
        problem = Problem(self, robot, last)
        value = problem.cost(nominal)
        self.gain = (value, value)
        units = np.array([robot.max_speed, robot.max_turn_rate])
        low, high = bounds(robot, problem, last)
        solver, changes = self._nonlinear(problem, robot)
        n, count = 2 * config.moves, 5 * config.horizon
        for _ in range(_ROUNDS):
            states = problem.states(nominal)
            places = self._places(problem, robot, nominal, states)
            found = solver(
                x0=np.concatenate([(nominal / units).T.ravel(), states[1:, :5].ravel()]),
                p=np.concatenate([states[0, :5], problem.steps, last / units, places.ravel()]),
                lbx=np.concatenate([low[:n], np.full(count, -np.inf)]),
                ubx=np.concatenate([high[:n], np.full(count, np.inf)]),
                lbg=np.concatenate([np.zeros(count), low[n : n + changes]]),
                ubg=np.concatenate([np.zeros(count), high[n : n + changes]]),
            )
            z = np.asarray(found["x"]).ravel()[:n]
            if not np.isfinite(z).all():
                break
            z = np.clip(z, low[:n], high[:n])
            nominal = np.ascontiguousarray(z.reshape(2, -1).T * units)
            cost = problem.cost(nominal)
            self.gain = (value, min(cost, self.gain[1]))

    def _nonlinear(self, problem: Problem, robot: RobotModel) -> tuple[Any, int]:
        """The solver, and its number of constraints on changes of commands."""
        key = (self._tracker.face, self._plan, robot, self.config)
        if self._solver_of is None or self._solver_of[0] != key:
            made = nonlinear_problem(
                problem.contact, problem.weights, robot, problem.groups, self.config.moves
            )
            rates = (robot.max_acceleration, robot.max_turn_acceleration)
            changes = self.config.moves * int(np.isfinite(rates).sum())
            self._solver_of = (key, made, changes)
        return self._solver_of[1], self._solver_of[2]

    def _places(
        self, problem: Problem, robot: RobotModel, nominal: FloatArray, states: FloatArray
    ) -> FloatArray:
        """(N, 6) of each step: path x, y, heading, curvature; wanted speed and turn rate."""
        contact, plan, steps = problem.contact, self._plan, problem.steps
        track, rows, place = track_of(plan), [], self.along
        at = contact.box_pose(states[0])
        _, index, fraction = track.locate(at[0], at[1], place, place)
        curvature = track.errors(at[0], at[1], states[0, 2], index, fraction)[3]
        for k, dt in enumerate(steps.tolist()):
            wanted = min(float(plan.speeds[index]), robot.max_speed)
            wanted = min(wanted, max(float(plan.arc_lengths[-1]) - place, 0.0) / dt)
            turn = min(max(wanted * curvature, -robot.max_turn_rate), robot.max_turn_rate)
            v = float(nominal[problem.groups[k], 0])
            at = contact.box_pose(states[k + 1])
            theta = states[k + 1, 2] + states[k + 1, 4]
            place, index, fraction = track.locate(at[0], at[1], place, place + 2.0 * v * dt + 1e-9)
            lateral, _, heading, curvature = track.errors(at[0], at[1], theta, index, fraction)
            foot = [at[0] + lateral * np.sin(heading), at[1] - lateral * np.cos(heading)]
            rows.append([*foot, heading, curvature, wanted, turn])
        return np.array(rows)


class Problem:
    """The problem of the present call, put up from what the tracker tells."""

    def __init__(self, mpc: PushingMpc, robot: RobotModel, last: FloatArray) -> None:
        config, tracker = mpc.config, mpc._tracker
        model = mpc.model
        self.contact, self.steps = model.contact, tracker.steps
        self.groups = groups_of(config.horizon, config.moves)
        curvature = config.margin * model.stable_curvature()
        limited = model.stable_curvature() * model.reach > 0.02
        self.weights = SimpleNamespace(
            length=model.reach,
            max_speed=robot.max_speed,
            half=model.bumper.half,
            curvature=curvature if limited else -1.0,
            safe=_SAFE_FRACTION,
            **{name: getattr(config, name) for name in _WEIGHTS},
        )
        self._start = tracker.state_in_effect
        far = _MOST_OFFSET * model.bumper.half
        self._start[3] = min(max(self._start[3], -far), far)
        self._start[5] = min(self._start[5], _MOST_GAP * model.reach)
        self._core = core.PushingProblem(
            self.contact,
            mpc._track,
            core.PushWeights(**vars(self.weights)),
            self._start,
            mpc.along,
            last,
            np.array([robot.max_speed, robot.max_turn_rate]),
            self.steps,
            self.groups,
        )
        self._assembly = core.PushAssembly(config.horizon, config.moves)

    def cost(self, nominal: FloatArray) -> float:
        """Of commands (M, 2)."""
        n = nominal.size
        return self._assembly.assemble(self._core, nominal, np.empty((n, n)), np.empty(n))

    def states(self, nominal: FloatArray) -> FloatArray:
        """(N + 1, 6) under commands (M, 2)."""
        count = len(self.steps)
        states, motions = np.empty((count + 1, 6)), np.empty((count, 6))
        twists = nominal[self.groups]
        self.contact.roll_out(self._start, twists, self.steps, states, motions)
        return states


def bounds(robot: RobotModel, problem: Problem, last: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds of the 2 M variables, and of those changes that the robot limits, in units."""
    moves = problem.groups[-1] + 1
    units = (robot.max_speed, robot.max_turn_rate)
    rates = (robot.max_acceleration, robot.max_turn_acceleration)
    low, high = [-np.ones(2 * moves)], [np.ones(2 * moves)]
    reaches = [rate / unit * problem.steps[0] for rate, unit in zip(rates, units, strict=True)]
    least = _LEAST_SPEED * min(1.0, units[1] * problem.weights.length / units[0])
    low[0][:moves] = min(least, last[0] / units[0] + reaches[0])
    for reach, before in zip(reaches, last / units, strict=True):
        if np.isfinite(reach):
            first = np.eye(1, moves)[0] * before
            low.append(first - reach)
            high.append(first + reach)
    return np.concatenate(low), np.concatenate(high)


def nonlinear_problem(
    contact: core.BoxContact,
    weights: SimpleNamespace,
    robot: RobotModel,
    groups: IntArray,
    moves: int,
) -> Any:
    """The problem of `assemble` with its states as variables, for CasADi's IPOPT."""
    count = len(groups)
    z = casadi.SX.sym("z", 2 * moves)
    x = casadi.SX.sym("x", 5, count)
    start, steps = casadi.SX.sym("start", 5), casadi.SX.sym("steps", count)
    last, places = casadi.SX.sym("last", 2), casadi.SX.sym("places", 6, count)
    units = (robot.max_speed, robot.max_turn_rate)
    rate = units[1] * weights.length / weights.max_speed
    cost: Any = 0.0
    defects = []
    for k in range(count):
        g = int(groups[k])
        v, w = z[g] * units[0], z[moves + g] * units[1]
        before = start if k == 0 else x[:, k - 1]
        defects.append(x[:, k] - step(contact, before, v, w, steps[k]))
        tau = steps[k] * weights.max_speed / weights.length
        factor = tau * (weights.terminal if k == count - 1 else 1.0)
        cost += 0.5 * factor * _step_cost(contact, weights, x[:, k], places[:, k], v, w)
        cost += 0.5 * tau * weights.speed * (z[g] - places[4, k] / units[0]) ** 2
        turn = places[5, k] / units[1]
        cost += 0.5 * tau * weights.turn * rate**2 * (z[moves + g] - turn) ** 2
        if k == 0 or groups[k - 1] != g:
            old = (last[0], last[1]) if g == 0 else (z[g - 1], z[moves + g - 1])
            calm = 0.5 * weights.smoothness / casadi.fmax(tau, 0.05)
            cost += calm * (
                SPEED_SMOOTHNESS * (z[g] - old[0]) ** 2 + rate**2 * (z[moves + g] - old[1]) ** 2
            )
    changes = []
    for kind, limit in enumerate((robot.max_acceleration, robot.max_turn_acceleration)):
        if np.isfinite(limit):
            part = z[kind * moves : (kind + 1) * moves]
            changes.append(part - casadi.vertcat(0.0, part[:-1]))
    problem = {
        "x": casadi.vertcat(z, casadi.vec(x)),
        "p": casadi.vertcat(start, steps, last, casadi.vec(places)),
        "f": cost,
        "g": casadi.vertcat(*defects, *changes),
    }
    return casadi.nlpsol("push", "ipopt", problem, _SETTINGS)


def _step_cost(
    contact: core.BoxContact, weights: SimpleNamespace, x: Any, place: Any, v: Any, w: Any
) -> Any:
    """Squares of the residuals of one step, see `residuals`."""
    ahead = _standoff(contact, x[3], x[4])[0]
    c, s = casadi.cos(x[2]), casadi.sin(x[2])
    dx, dy = x[0] + c * ahead - s * x[3] - place[0], x[1] + s * ahead + c * x[3] - place[1]
    cp, sp = casadi.cos(place[2]), casadi.sin(place[2])
    along = cp * dx + sp * dy
    lateral = cp * dy - sp * dx - 0.5 * place[3] * along**2
    error = x[2] + x[4] - place[2] - place[3] * along
    turns = casadi.floor((error + np.pi) / (2.0 * np.pi))
    error = error - 2.0 * np.pi * turns
    fraction = x[3] / weights.half
    beyond = casadi.fmax(casadi.fabs(fraction) - weights.safe, 0.0)
    cost = (lateral / weights.length) ** 2 + weights.heading * error**2
    cost += weights.offset * fraction**2 + weights.rim * beyond**2
    cost += weights.angle * (x[4] - _flush(contact, x[3])) ** 2
    if weights.curvature >= 0.0:
        over = casadi.fmax(casadi.fabs(w) - weights.curvature * v, 0.0)
        cost += weights.grip * (over * weights.length / weights.max_speed) ** 2
    return cost


def step(
    contact: core.BoxContact, x: Any, v: Any, w: Any, dt: Any, substeps: int = _SUBSTEPS
) -> Any:
    """`advance` of a box in contact, as an expression: (5,) state after ``dt``."""
    h = dt / substeps
    for _ in range(substeps):
        offset, angle = x[3], x[4]
        vn, vt, omega = _velocity(contact, offset, angle, v, w, h)
        ahead = _standoff(contact, offset, angle)[0]
        c, s = casadi.cos(angle), casadi.sin(angle)
        half = 0.5 * w * h
        chord = v * h * (1.0 - half**2 / 6.0 + half**4 / 120.0)
        slid = offset + h * (vn * s + vt * c - w * ahead)
        turned = angle + h * (omega - w)
        if contact.curvature >= 0.0:  # lies on the bumper before the step is over
            flush = _flush(contact, slid)
            before = angle - _flush(contact, offset)
            over = casadi.logic_and(casadi.fabs(before) > FLUSH, before * (turned - flush) < 0.0)
            turned = casadi.if_else(over, flush, turned)
        x = casadi.vertcat(
            x[0] + chord * casadi.cos(x[2] + half),
            x[1] + chord * casadi.sin(x[2] + half),
            x[2] + w * h,
            slid,
            turned,
        )
    return x


def _line(contact: core.BoxContact, offset: Any) -> tuple[Any, Any]:
    low = casadi.fmax(contact.low, -contact.half - offset)
    return low, casadi.fmin(contact.high, contact.half - offset)


def _flush(contact: core.BoxContact, offset: Any) -> Any:
    if contact.curvature <= 0.0:
        return 0.0
    low, high = _line(contact, offset)
    return (
        -contact.curvature
        * (offset + 0.5 * (low + high))
        / (1.0 - contact.curvature * contact.depth)
    )


def _standoff(contact: core.BoxContact, offset: Any, angle: Any) -> tuple[Any, Any]:
    c, s = casadi.cos(angle), casadi.sin(angle)
    low, high = _line(contact, offset)
    middle = 0.5 * (low + high)
    if contact.curvature < 0.0:
        middle = (-s / (c * contact.curvature) - offset + contact.depth * s) / c
        middle = casadi.fmin(casadi.fmax(middle, low), high)
    best: Any = None
    at: Any = None
    for y in (low, middle, high):
        lateral = offset - contact.depth * s + y * c
        x = contact.front + 0.5 * contact.curvature * lateral**2 + contact.depth * c + y * s
        if best is None:
            best, at = x, y
        else:
            ahead = x > best + 1e-12
            best, at = casadi.if_else(ahead, x, best), casadi.if_else(ahead, y, at)
    return best, at


def _corner(
    contact: core.BoxContact, y: Any, tilt: Any, un: Any, ut: Any, w: Any
) -> tuple[Any, Any, Any]:
    px, square = -contact.depth, contact.spread**2
    cn, ct = un - w * y, ut + w * px
    total = square + px**2 + y**2
    vn = ((square + px**2) * cn + px * y * ct) / total
    vt = (px * y * cn + (square + y**2) * ct) / total
    nx, ny = casadi.cos(tilt), casadi.sin(tilt)
    press, shear = vn * nx + vt * ny, vt * nx - vn * ny
    ratio = contact.friction * casadi.if_else(shear > 0.0, 1.0, -1.0)
    fx, fy = nx - ratio * ny, ny + ratio * nx
    arm, lever = px * fy - y * fx, px * ny - y * nx
    push = (cn * nx + ct * ny) / casadi.fmax(1.0 + arm * lever / square, 0.05)
    sticks = casadi.logic_and(press > 0.0, casadi.fabs(shear) <= contact.friction * press)
    pushed = cn * nx + ct * ny > 0.0
    found = []
    for stuck, slid in (
        (vn, push * fx),
        (vt, push * fy),
        ((px * vt - y * vn) / square, push * arm / square),
    ):
        found.append(casadi.if_else(pushed, casadi.if_else(sticks, stuck, slid), 0.0))
    return found[0], found[1], found[2]


def _velocity(
    contact: core.BoxContact, offset: Any, angle: Any, v: Any, w: Any, dt: Any
) -> tuple[Any, Any, Any]:
    """`BoxContact.velocity` as expressions."""
    ahead, touch = _standoff(contact, offset, angle)
    c, s = casadi.cos(angle), casadi.sin(angle)
    ux, uy = v - w * offset, w * ahead
    un, ut = c * ux + s * uy, c * uy - s * ux
    if contact.curvature < 0.0:
        return _corner(contact, touch, 0.0, un, ut, w)
    low, high = _line(contact, offset)
    curvature, a, square = contact.curvature, contact.depth, contact.spread**2
    slope, grip = -curvature / (1.0 - curvature * a), 1.0 - curvature * a
    closing = w - (angle - _flush(contact, offset)) / dt
    normal = un + (closing - w) * touch
    pressed = casadi.fmax(normal, 0.0)
    shear = ut * grip - curvature * square * closing
    slips = casadi.fabs(shear) > contact.friction * pressed
    ratio = contact.friction * casadi.if_else(shear > 0.0, 1.0, -1.0)
    slid = (ratio * pressed + curvature * square * (closing - slope * ut)) / (
        grip - curvature * square * slope
    )
    vt = casadi.if_else(slips, slid, ut)
    omega = casadi.if_else(slips, closing + slope * (slid - ut), closing)
    moment = -(square * omega + a * vt)  # centre of pressure times normal force
    above = casadi.if_else(normal > 1e-12, moment > high * normal, omega < 0.0)
    below = casadi.if_else(normal > 1e-12, moment < low * normal, omega >= 0.0)
    y = casadi.if_else(above, high, low)
    end = casadi.if_else(above, contact.high, contact.low)
    lateral = offset - a * s + y * c
    tilt = casadi.if_else(casadi.fabs(y - end) < 1e-12, -curvature * lateral - angle, 0.0)
    point = _corner(contact, y, tilt, un, ut, w)
    off_line = casadi.logic_or(above, below)
    line = (normal, vt, omega)
    found = [casadi.if_else(off_line, p, q) for p, q in zip(point, line, strict=True)]
    return found[0], found[1], found[2]
