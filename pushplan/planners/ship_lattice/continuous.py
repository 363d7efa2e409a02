"""Optimising a path in continuous space under the turn limit, with CasADi and IPOPT.

After the optimisation stage of AUTO-IceNav (arXiv 2411.17155): states x, y, heading, control
curvature, free total length; length plus a smooth cost field plus a cost of changes of curvature.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi
import numpy as np

from pushplan.motion.dubins import along_arc
from pushplan.world.checks import FloatArray

_CURVATURE_WEIGHT = 0.05
"""Cost of a change of curvature by that of the tightest turn [entries of the field]."""


class CostField(NamedTuple):
    """Cost of driving a metre through a place, on a grid in the frame of a lattice."""

    first: FloatArray  # (2,) place of entry (0, 0) [m]
    spacing: float  # between entries [m]
    values: FloatArray  # (rows, columns) [m/m]


def cost_field(
    sums: FloatArray,  # flattened sums of each column of the map before each row
    stride: int,  # entries of a column
    cells: int,  # of the map in an entry of the field, along both axes
    cell: float,  # side of a cell [m]
    hull: int,  # beam of the hull [cells]
    origin: FloatArray,  # (2,) row and column of the frame's origin on the map
) -> CostField:
    """The cost of a metre with the hull's beam, smoothed, from the sums of a `PoseLattice`."""
    table = np.diff(sums.reshape(-1, stride), axis=1).T  # (rows, columns)
    rows, columns = (n // cells for n in table.shape)
    blocks = table[: rows * cells, : columns * cells].reshape(rows, cells, columns, cells)
    density = blocks.sum(axis=(1, 3)) / (cells * cell) ** 2  # [m/m²]
    reach = max(1, round(0.5 * hull / cells))
    kernel = np.convolve(np.ones(2 * reach + 1), [0.25, 0.5, 0.25])
    kernel *= hull * cell / kernel.sum()
    along = np.array([0.25, 0.5, 0.25])
    values = np.apply_along_axis(np.convolve, 1, density, kernel, mode="same")
    values = np.apply_along_axis(np.convolve, 0, values, along, mode="same")
    first = ((cells - 1) / 2.0 - origin) * cell
    return CostField(first, cells * cell, np.ascontiguousarray(values))


def _solver(field: CostField, start: FloatArray, radius: float, count: int, limit: int) -> Any:
    """IPOPT for paths of ``count`` arcs, in units of the field's grid.

    The cost is the cubic B-spline whose coefficients are the values of the field, which smooths
    them once more and takes no time to make.
    """
    rows, columns = field.values.shape
    knots = [list(np.arange(-2.0, n + 2.0)) for n in (rows, columns)]
    cost = casadi.Function.bspline("cost", knots, field.values.ravel(order="F").tolist(), [3, 3])
    curvature, length = casadi.SX.sym("curvature", count), casadi.SX.sym("length")
    step = length / count
    state: Any = casadi.DM(start)
    states = []
    for i in range(count):
        half = state[2] + 0.5 * step * curvature[i]  # the midpoint rule
        state = casadi.vertcat(
            state[0] + step * casadi.cos(half),
            state[1] + step * casadi.sin(half),
            state[2] + step * curvature[i],
        )
        states.append(state)
    drive = casadi.Function("drive", [casadi.vertcat(curvature, length)], [casadi.horzcat(*states)])
    chosen = casadi.MX.sym("chosen", count + 1)
    driven = drive(chosen)
    values = cost.map(count)(driven[:2, :])
    changes = _CURVATURE_WEIGHT * radius**2 * casadi.sumsqr(casadi.diff(chosen[:count]))
    problem: Any = {
        "x": chosen,
        "f": chosen[count] * (1.0 + casadi.sum2(values) / count) + changes,
        "g": casadi.vertcat(driven[0, count - 1], driven[1, :].T),
    }
    quiet: dict[str, Any] = {"print_level": 0, "max_iter": limit, "tol": 1e-3, "sb": "yes"}
    quiet["hessian_approximation"] = "limited-memory"
    options: Any = {"ipopt": quiet, "print_time": False}
    return casadi.nlpsol("refine", "ipopt", problem, options)


def refine(
    field: CostField,  # what a metre costs
    arcs: FloatArray,  # (E, 2) length [m] and curvature [1/m] of the path to start from
    heading: float,  # of the robot in the frame of the field [rad]; its place is the origin
    *,
    radius: float,  # least turning radius [m]
    goal: float,  # how far ahead the path ends [m]
    sides: tuple[float, float],  # least and greatest place across [m]
    iterations: int,  # of the solver at most
) -> FloatArray | None:
    """Arcs of a cheaper path, or None where the solver finds none.

    Returns:
        (N, 2) lengths [m] and curvatures [1/m], within the turn limit.
    """
    unit = field.spacing
    total = float(arcs[:, 0].sum())
    count = int(np.clip(np.ceil(total / (0.35 * radius)), 8, 60))
    ends = np.cumsum(arcs[:, 0])
    middles = (np.arange(count) + 0.5) * total / count
    curvatures = arcs[np.minimum(np.searchsorted(ends, middles), len(arcs) - 1), 1]
    start = -field.first / unit
    most = unit / radius
    at = np.concatenate([start, [heading]])
    low = np.concatenate([np.full(count, -most), [0.5 * goal / unit]])
    high = np.concatenate([np.full(count, most), [3.0 * total / unit]])
    line = start[0] + goal / unit
    side = start[1] + np.array(sides) / unit
    try:
        solver = _solver(field, at, radius / unit, count, iterations)
        answer = solver(
            x0=np.concatenate([curvatures * unit, [total / unit]]),
            lbx=low,
            ubx=high,
            lbg=np.concatenate([[line], np.full(count, side[0])]),
            ubg=np.concatenate([[line], np.full(count, side[1])]),
        )
    except RuntimeError:
        return None
    if solver.stats()["return_status"] not in (
        "Solve_Succeeded",
        "Solved_To_Acceptable_Level",
        "Maximum_Iterations_Exceeded",
    ):
        return None
    chosen = np.asarray(answer["x"]).ravel()
    if not np.isfinite(chosen).all():
        return None
    curvature = np.clip(chosen[:count], -most, most) / unit
    lengths = np.full(count, chosen[count] * unit / count)
    made = np.column_stack([lengths, curvature])
    # rounding and an early end may leave it short of the line: drive straight on
    pose = np.array([0.0, 0.0, heading])
    for length, turn in made:
        along_arc(pose.copy(), length, turn, pose)
    short = max(goal - pose[0], 0.0) / max(np.cos(pose[2]), 0.2)
    return np.concatenate([made, [[short + 0.1 * unit, 0.0]]])
