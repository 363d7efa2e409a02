"""Compiled step of the pushing controller: from the poses of robot and box to a command."""

from __future__ import annotations

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.control.mpc.horizon import (
    FAILED,
    KNOWN,
    MISSED,
    keep_solution,
    lay_steps,
    remember,
    send,
    set_bounds,
    shift_steps,
)
from pushplan.control.mpc.tracking_kernels import ReferencePath, locate
from pushplan.geometry.obstacles import Obstacles
from pushplan.planners.pushing.box_motion_kernels import box_pose
from pushplan.planners.pushing.clearance_kernels import free_fraction
from pushplan.planners.pushing.cost_kernels import PushingProblem, Weights
from pushplan.planners.pushing.problem_kernels import assemble
from pushplan.planners.pushing.push_observer_kernels import (
    ALONG,
    LATERAL,
    SEEN_AT,
    SLOWED,
    VALUE,
    PushingMemory,
    contact_now,
    estimate,
    take_face,
)
from pushplan.world.checks import FloatArray

_SEARCH_BACK = 0.5
_SEARCH_AHEAD = 2.0
"""Greatest move of the box's place, back or ahead, from one call to the next [L]."""
_LEAST_SPEED = 0.4
"""Least speed of a push that has not ended, as a fraction of the greatest, or of that at which the
robot can turn within the distance to the box."""
_CLEAR_PERIODS = 4.0
"""Periods for which a command must stay clear of static things, or it is driven more slowly."""
_MOST_OFFSET = 1.5
_MOST_GAP = 2.0
"""Greatest offset [half bumpers] and gap [L] that the problem is solved for."""
_LEAST_FRACTION = 0.5
_TURNS_TRIED = 6
"""Fraction of a command below which others are tried, and how many."""


@kernel
def observe_push(
    memory: PushingMemory,
    track: ReferencePath,
    pose: FloatArray,
    box: FloatArray,
    time: float,
    held: float,
) -> bool:
    """Estimate the state from poses (3,), and put up the program for when a command takes effect.

    Returns:
        False at the end of the path.
    """
    memory.told[SLOWED] = 1.0
    told = memory.told
    at = memory.box
    estimate(memory, pose, box, time)
    contact = contact_now(memory)
    size = contact.front + contact.depth
    box_pose(contact, memory.guess, at)
    low = max(told[ALONG] - _SEARCH_BACK * size, 0.0)
    along, index, _ = locate(track, at[0], at[1], low, told[ALONG] + _SEARCH_AHEAD * size)
    told[ALONG] = min(along, track.lengths[-1])
    path = track.poses[min(index, track.poses.shape[0] - 1)]
    told[LATERAL] = (at[1] - path[1]) * np.cos(path[2]) - (at[0] - path[0]) * np.sin(path[2])
    if not along < track.lengths[-1] - 1e-9:
        return False
    problem = problem_now(memory, track, held)
    _begin_commands(memory, held)
    memory.told[VALUE] = assemble(problem, memory.horizon.nominal, memory.assembly)
    return True


@kernel
def problem_now(memory: PushingMemory, track: ReferencePath, held: float) -> PushingProblem:
    """Lay the steps and the bounds, and put up the problem from the state in effect."""
    horizon = memory.horizon
    contact = contact_now(memory)
    base = memory.weights
    length = contact.front + contact.depth
    lay_steps(horizon, memory.reach * length / base.max_speed, held)
    set_bounds(horizon, horizon.steps[0], horizon.steps[0])
    # a push goes forwards; where the robot cannot be that fast yet it gets there as it can
    reach = horizon.limits.max_acceleration / base.max_speed * horizon.steps[0]
    least = _LEAST_SPEED * min(1.0, horizon.limits.max_turn_rate * length / base.max_speed)
    for i in range(horizon.program.moves):
        horizon.program.low[i] = min(least, horizon.last[0] / base.max_speed + reach)
    near = memory.near
    far = _MOST_OFFSET * contact.half
    copy_into(near, memory.guess)
    near[3] = min(max(near[3], -far), far)
    near[5] = min(near[5], _MOST_GAP * length)
    weights = Weights(
        length,
        base.max_speed,
        base.half,
        memory.faces.curvatures[memory.face[0]],
        base.heading,
        base.offset,
        base.rim,
        base.safe,
        base.angle,
        base.grip,
        base.turn,
        base.speed,
        base.smoothness,
        base.terminal,
    )
    return PushingProblem(
        contact,
        track,
        weights,
        near,
        memory.told[ALONG],
        horizon.last,
        horizon.units,
        horizon.steps,
        memory.groups,
    )


@kernel
def _begin_commands(memory: PushingMemory, held: float) -> None:
    """Set the nominal commands to the last solution, moved on, or to full speed straight on."""
    horizon = memory.horizon
    if horizon.counts[KNOWN] == 1:
        _shift(memory, held)
    else:
        for i in range(horizon.program.moves):
            horizon.nominal[i, 0] = memory.weights.max_speed
            horizon.nominal[i, 1] = 0.0


@kernel
def assemble_push(memory: PushingMemory, track: ReferencePath, held: float) -> None:
    """Put up the program about the nominal commands."""
    problem = problem_now(memory, track, held)
    memory.told[VALUE] = assemble(problem, memory.horizon.nominal, memory.assembly)


@kernel
def _shift(memory: PushingMemory, held: float) -> None:
    """Set the nominal commands to the last solution, moved on by the time since."""
    horizon = memory.horizon
    groups = memory.groups
    shift_steps(horizon, held)
    count = groups.shape[0]
    for k in range(count):
        if k == 0 or groups[k] != groups[k - 1]:
            g = groups[min(horizon.shifted[k], count - 1)]
            for j in range(2):
                horizon.nominal[groups[k], j] = horizon.solution[g, j]


@kernel
def drive_push(
    memory: PushingMemory,
    obstacles: Obstacles,
    solved: bool,
    time: float,
    held: float,
    out: FloatArray,  # (2,) the command
) -> None:
    """Fill the command: of the solution, or the last one, as fast as what is static allows."""
    horizon = memory.horizon
    counts = horizon.counts
    solution = horizon.solution
    if solved:
        counts[MISSED] = 0
        keep_solution(horizon)
    else:
        counts[FAILED] += 1
        counts[MISSED] += 1
        if counts[MISSED] > horizon.steps.shape[0]:
            counts[KNOWN] = 0
    if counts[KNOWN] == 0:
        send_push(memory, 0.0, 0.0, time, held, out)
        return
    contact = contact_now(memory)
    normal = memory.faces.normals[memory.face[0]]
    v = solution[0, 0]
    w = solution[0, 1]
    start = memory.guess
    clearance = memory.clearance
    length = contact.front + contact.depth
    look = max(_CLEAR_PERIODS * held, 2.0 * abs(v) / horizon.limits.max_acceleration)
    free = free_fraction(contact, normal, start, v, w, look, clearance, obstacles)
    if free < _LEAST_FRACTION:
        speed = max(abs(v), abs(w) * length)
        for i in range(_TURNS_TRIED):
            turn = (0.1, 0.3, 0.7)[i // 2]
            aside = w + (turn if i % 2 == 0 else -turn) * speed / length
            other = free_fraction(contact, normal, start, v, aside, look, clearance, obstacles)
            if other > free + _LEAST_FRACTION * turn:
                free = other
                w = aside
                break
    memory.told[SLOWED] = free
    send_push(memory, free * v, free * w, time, held, out)


@kernel
def send_push(
    memory: PushingMemory, v: float, w: float, time: float, held: float, out: FloatArray
) -> None:
    """Fill a command within the accelerations, and remember it."""
    send(memory.horizon, v, w, held, True, out)
    # what another command had followed in effect when the state was observed moves it no more
    over = max(memory.told[SEEN_AT] - memory.delay, time - 2.0 * memory.delay - 1.0)
    remember(memory.horizon, time, over)


@kernel
def begin_push(memory: PushingMemory, direction: float) -> None:
    """Begin a path with a push along ``direction`` [rad, box frame]."""
    memory.told[ALONG] = 0.0
    memory.told[SLOWED] = 1.0
    memory.horizon.counts[MISSED] = memory.horizon.counts[KNOWN] = 0
    take_face(memory, direction)
