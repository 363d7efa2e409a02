"""Compiled operator splitting for a small dense quadratic program.

The algorithm of OSQP (Stellato, Banjac, Goulart, Bemporad and Boyd, Math. Program. Comput. 12(4),
2020), without scaling and polishing: the same iterates, step sizes and tests of termination as its
release 1.1 has. The constraints are bounds of the variables and of the changes between one and the
next, so that products with their matrix are loops, and the linear system is the reduced one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.world.checks import FloatArray, IntArray

RHO = 0.1
"""First step size of the operator splitting; adapted after fixed numbers of iterations."""
_SIGMA, _ALPHA = 1e-6, 1.6
_RHO_LOW, _RHO_HIGH, _RHO_FACTOR = 1e-6, 1e6, 5.0
_STIFF, _EQUAL = 1e3, 1e-4  # rho of equalities over that of others, and what counts as one
_RHO_INTERVAL, _CHECK_INTERVAL = 20, 5
_INFEASIBLE = 1e-4
_DEAD, _TINY = 1e-15, 1e-30


class QpMemory(NamedTuple):
    """A program over n variables in blocks of M, its state from call to call, and scratch."""

    moves: int  # M
    tolerance: float  # Absolute and relative
    iterations: int  # Most
    blocks: IntArray  # (B,) first variable of each block whose changes are bounded
    hessian: FloatArray  # (n, n) P
    gradient: FloatArray  # (n,) q
    low: FloatArray  # (n + B M,) bounds of the variables, then of their changes
    high: FloatArray
    x: FloatArray  # (n,) start, and solution
    y: FloatArray  # (n + B M,) multipliers, kept
    rho: FloatArray  # (1,) step size, kept
    factor: FloatArray  # (n, n) Cholesky factor, its diagonal inverted, in both halves
    wide: FloatArray  # (5, n + B M) scratch: z, weights of rows, z before, A x, change of y
    narrow: FloatArray  # (3, n) scratch: right side, P x, Aᵀ y


def qp_memory(
    count: int, moves: int, blocks: IntArray, tolerance: float, iterations: int
) -> QpMemory:
    """Memory for a program of ``count`` variables."""
    rows = count + len(blocks) * moves
    return QpMemory(
        moves,
        tolerance,
        iterations,
        blocks,
        np.zeros((count, count)),
        np.zeros(count),
        -np.ones(rows),
        np.ones(rows),
        np.zeros(count),
        np.zeros(rows),
        np.full(1, RHO),
        np.zeros((count, count)),
        np.zeros((5, rows)),
        np.zeros((3, count)),
    )


@kernel
def solve_program(memory: QpMemory) -> bool:
    """Minimise 1/2 xᵀPx + qᵀx within the bounds from ``x``, in place; False if it is not solved."""
    n, rows = memory.x.shape[0], memory.y.shape[0]
    x, y, low, high = memory.x, memory.y, memory.low, memory.high
    z, weights, before, ahead = memory.wide[0], memory.wide[1], memory.wide[2], memory.wide[3]
    change, side = memory.wide[4], memory.narrow[0]
    trace = 0.0
    for i in range(n):
        trace += memory.hessian[i, i]
    if not (trace > 0.0 and np.isfinite(trace)):
        return False
    scale = n / trace  # so that the step size suits any horizon
    for i in range(n):
        memory.gradient[i] *= scale
        for j in range(n):
            memory.hessian[i, j] *= scale
    _factorise(memory)
    _constrain(memory, x, z)
    solved, blocked = False, False
    for iteration in range(1, memory.iterations + 1):
        for r in range(rows):
            before[r] = z[r]
            change[r] = weights[r] * z[r] - y[r]
        _transpose(memory, change, side)
        for i in range(n):
            side[i] += _SIGMA * x[i] - memory.gradient[i]
        _back_substitute(memory, side)
        _constrain(memory, side, ahead)
        for i in range(n):
            x[i] = _ALPHA * side[i] + (1.0 - _ALPHA) * x[i]
        for r in range(rows):
            relaxed = _ALPHA * ahead[r] + (1.0 - _ALPHA) * before[r]
            z[r] = min(max(relaxed + y[r] / weights[r], low[r]), high[r])
            change[r] = weights[r] * (relaxed - z[r])
            y[r] += change[r]
        if iteration % _CHECK_INTERVAL == 0 or iteration == memory.iterations:
            primal, dual, solved = _residuals(memory)
            if solved:
                break
            blocked = primal >= 0.0 and _is_infeasible(memory, _INFEASIBLE)
            if blocked:
                break
            if iteration % _RHO_INTERVAL == 0:
                _adapt(memory, abs(primal), dual)
    finite = True
    for i in range(n):
        finite = finite and np.isfinite(x[i])
    if not finite or blocked or (not solved and _is_infeasible(memory, 10.0 * _INFEASIBLE)):
        y[:] = 0.0
    if not finite:
        memory.rho[0] = RHO
    return solved and finite


@kernel
def _constrain(memory: QpMemory, x: FloatArray, out: FloatArray) -> None:
    """Fill A x: the variables, then their changes."""
    n, moves = x.shape[0], memory.moves
    for i in range(n):
        out[i] = x[i]
    for b in range(memory.blocks.shape[0]):
        first, row = memory.blocks[b], n + b * moves
        out[row] = x[first]
        for i in range(1, moves):
            out[row + i] = x[first + i] - x[first + i - 1]


@kernel
def _transpose(memory: QpMemory, y: FloatArray, out: FloatArray) -> None:
    """Fill Aᵀ y."""
    n, moves = out.shape[0], memory.moves
    for i in range(n):
        out[i] = y[i]
    for b in range(memory.blocks.shape[0]):
        first, row = memory.blocks[b], n + b * moves
        for i in range(moves - 1):
            out[first + i] += y[row + i] - y[row + i + 1]
        out[first + moves - 1] += y[row + moves - 1]


@kernel
def _factorise(memory: QpMemory) -> None:
    """Set the weights of the constraints, and factorise P + σ I + Aᵀ diag(weights) A."""
    factor, weights, rho = memory.factor, memory.wide[1], memory.rho[0]
    n, moves = memory.x.shape[0], memory.moves
    for r in range(memory.y.shape[0]):
        weights[r] = rho * (_STIFF if memory.high[r] - memory.low[r] < _EQUAL else 1.0)
    for i in range(n):
        for j in range(i, n):
            factor[i, j] = memory.hessian[i, j]
        factor[i, i] += _SIGMA + weights[i]
    for b in range(memory.blocks.shape[0]):
        first, row = memory.blocks[b], n + b * moves
        for i in range(moves):
            factor[first + i, first + i] += weights[row + i]
            if i > 0:
                factor[first + i - 1, first + i - 1] += weights[row + i]
                factor[first + i - 1, first + i] -= weights[row + i]
    for k in range(n):  # the factor Lᵀ, row by row, in the upper half
        top = factor[k]
        top[k] = 1.0 / np.sqrt(top[k])
        for j in range(k + 1, n):
            top[j] *= top[k]
        for i in range(k + 1, n):
            part, target = top[i], factor[i]
            for j in range(i, n):
                target[j] -= part * top[j]
    for i in range(n):
        for j in range(i):
            factor[i, j] = factor[j, i]


@kernel
def _back_substitute(memory: QpMemory, side: FloatArray) -> None:
    """Solve the factorised system in place."""
    factor, n = memory.factor, side.shape[0]
    for k in range(n):
        row = factor[k]
        side[k] *= row[k]
        part = side[k]
        for i in range(k + 1, n):
            side[i] -= row[i] * part
    for back in range(n):
        k = n - 1 - back
        row = factor[k]
        side[k] *= row[k]
        part = side[k]
        for i in range(k):
            side[i] -= row[i] * part


@kernel
def _residuals(memory: QpMemory) -> tuple[float, float, bool]:
    """Primal residual (negative where small enough) and dual one over their sizes; if both do."""
    n, rows, tolerance = memory.x.shape[0], memory.y.shape[0], memory.tolerance
    x, y, z, ax = memory.x, memory.y, memory.wide[0], memory.wide[3]
    pulls, forces = memory.narrow[1], memory.narrow[2]
    _constrain(memory, x, ax)
    _transpose(memory, y, forces)
    primal, size, support = 0.0, 0.0, 0.0
    for r in range(rows):
        primal = max(primal, abs(ax[r] - z[r]))
        size = max(size, abs(z[r]), abs(ax[r]))
        if y[r] >= _DEAD:
            support += memory.high[r] * y[r]
        elif y[r] <= -_DEAD:
            support += memory.low[r] * y[r]
    dual, strength, quadratic, linear = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        row, total = memory.hessian[i], 0.0
        for j in range(n):
            total += row[j] * x[j]
        pulls[i] = total
        q = memory.gradient[i]
        dual = max(dual, abs(q + total + forces[i]))
        strength = max(strength, abs(q), abs(total), abs(forces[i]))
        quadratic += total * x[i]
        linear += q * x[i]
    gap = quadratic + linear + support
    largest = max(abs(quadratic), abs(linear), abs(support))
    feasible = primal < tolerance + tolerance * size
    optimal = dual < tolerance + tolerance * strength
    closed = abs(gap) < tolerance + tolerance * largest
    share = primal / (size + _TINY)
    return -share if feasible else share, dual / (strength + _TINY), feasible and optimal and closed


@kernel
def _is_infeasible(memory: QpMemory, tolerance: float) -> bool:
    """Whether the last change of the multipliers proves that no point keeps all bounds."""
    change, side = memory.wide[4], memory.narrow[0]
    size, support = 0.0, 0.0
    for r in range(memory.y.shape[0]):
        size = max(size, abs(change[r]))
        support += change[r] * (memory.high[r] if change[r] > 0.0 else memory.low[r])
    if not (size > _TINY and support < 0.0):
        return False
    _transpose(memory, change, side)
    greatest = 0.0
    for i in range(side.shape[0]):
        greatest = max(greatest, abs(side[i]))
    return greatest < tolerance * size


@kernel
def _adapt(memory: QpMemory, primal: float, dual: float) -> None:
    """Take another step size where the residuals are far from balanced."""
    rho = memory.rho[0]
    better = _RHO_HIGH
    if dual > 0.0:
        better = min(max(rho * np.sqrt(primal / dual), _RHO_LOW), _RHO_HIGH)
    if better > rho * _RHO_FACTOR or better < rho / _RHO_FACTOR:
        memory.rho[0] = better
        _factorise(memory)
