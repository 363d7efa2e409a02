"""Compiled step of the pushing controller: from the poses of robot and box to a command."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.control.mpc.horizon import (
    FAILED,
    KNOWN,
    MISSED,
    UNDER_WAY,
    Horizon,
    keep_solution,
    lay_steps,
    remember,
    send,
    set_bounds,
    shift_steps,
)
from pushplan.control.mpc.tracking_kernels import ReferencePath, locate
from pushplan.geometry.angles import wrap_angle
from pushplan.geometry.obstacles import Obstacles
from pushplan.planners.pushing.clearance_kernels import ClearanceProblem, free_fraction
from pushplan.planners.pushing.contact_kernels import Contact, advance, box_pose, observe
from pushplan.planners.pushing.cost_kernels import Memory, PushingProblem, Weights
from pushplan.planners.pushing.problem_kernels import assemble
from pushplan.world.checks import FloatArray, IntArray

_BACK = 0.5
_WINDOW = 2.0
"""Greatest move of the box's place, back or ahead, from one call to the next [L]."""
_LEAST = 0.4
"""Least speed of a push that has not ended, as a fraction of the greatest, or of that at which the
robot can turn within the distance to the box."""
_LOOK = 4.0
"""Periods for which a command must stay clear of static things, or it is driven more slowly."""
_BESIDE = 1.5
_AHEAD = 2.0
"""Greatest offset [half bumpers] and gap [L] that the problem is solved for."""
_BLOCKED = 0.5
_ASIDES = 6
"""Fraction of a command below which others are tried, and how many."""
_TURNED = np.pi * 50.0 / 180.0  # angle at which another face is taken to be the pushed one
_JUMP = 0.35  # a pose farther than this from the predicted one replaces it [L]
ALONG, LATERAL, SLOWED, VALUE, SEEN_AT, OBSERVED = range(6)
"""Places in `PushingMemory.told`."""


class Faces(NamedTuple):
    """The sides of a box, F of them, on one bumper."""

    scores: FloatArray  # (F, 3) see `faces_of`
    contacts: FloatArray  # (F, 8) as `Contact`
    normals: FloatArray  # (F,) direction of the inward normal in the box's frame [rad]
    curvatures: FloatArray  # (F,) as `Weights.curvature` [1/m]


class PushingMemory(NamedTuple):
    """All that the controller knows of one robot, box and path: parameters, state, memory."""

    horizon: Horizon
    weights: Weights  # But for length and curvature, which are of the face
    faces: Faces
    assembly: Memory
    clearance: ClearanceProblem
    groups: IntArray  # (N,) which of the M commands holds in each step
    reach: float  # Reach of the steps at full speed [L]
    delay: float  # Between a command and its effect [s]
    gain: float  # Fraction by which an observation corrects what was predicted
    face: IntArray  # (1,) the one that is pushed
    told: FloatArray  # (6,) along and lateral [m], fraction driven, cost, time [s], 1 if observed
    seen: FloatArray  # (6,) state as the poses show it
    state: FloatArray  # (6,) state as estimated, see `PushState`
    guess: FloatArray  # (6,) the one that was predicted, or is when a command of now takes effect
    near: FloatArray  # (6,) that, with the box no farther away than the model means anything for
    box: FloatArray  # (3,) pose of the face
    detail: FloatArray  # (6,)


@kernel
def contact_now(memory: PushingMemory) -> Contact:
    """Bumper, pushed face and friction."""
    row = memory.faces.contacts[memory.face[0]]
    return Contact(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])


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
    faces = memory.faces
    at = memory.box
    contact = contact_now(memory)
    observe(contact, faces.normals[memory.face[0]], pose, box, memory.seen)
    if abs(memory.seen[4]) > _TURNED:
        take_face(memory, pose[2] - box[2])
        contact = contact_now(memory)
        observe(contact, faces.normals[memory.face[0]], pose, box, memory.seen)
    size = contact.front + contact.depth
    _correct(memory, contact, size, time)
    copy_into(memory.guess, memory.state)
    _predict(memory, contact, time, time + memory.delay)
    box_pose(contact, memory.guess, at)
    low = max(told[ALONG] - _BACK * size, 0.0)
    along, index, _ = locate(track, at[0], at[1], low, told[ALONG] + _WINDOW * size)
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
def take_face(memory: PushingMemory, direction: float) -> None:
    """Push the face that a direction [rad, box frame] meets most squarely; forget the state."""
    scores = memory.faces.scores
    best = -np.inf
    c = np.cos(direction)
    s = np.sin(direction)
    for k in range(scores.shape[0]):
        score = scores[k, 0] * c + scores[k, 1] * s + scores[k, 2]
        if score > best:
            best = score
            memory.face[0] = k
    memory.told[OBSERVED] = 0.0


@kernel
def _correct(memory: PushingMemory, contact: Contact, size: float, time: float) -> None:
    """Correct the predicted state by a fixed fraction of what is observed, unless it jumps."""
    told = memory.told
    seen = memory.seen
    state = memory.state
    guess = memory.guess
    if told[OBSERVED] == 1.0 and memory.gain < 1.0 and time > told[SEEN_AT]:
        copy_into(guess, state)
        _predict(memory, contact, told[SEEN_AT], time)
        far = 0.0
        turned = 0.0
        for j in range(6):
            change = seen[j] - guess[j]
            if j == 2 or j == 4:
                change = wrap_angle(change)
                turned = max(turned, abs(change))
            elif j > 2:
                far = max(far, abs(change))
            state[j] = guess[j] + memory.gain * change
        dx = seen[0] - guess[0]
        dy = seen[1] - guess[1]
        far = max(far, np.sqrt(dx * dx + dy * dy))
        if far / size >= _JUMP or turned >= _JUMP:
            copy_into(state, seen)
    else:
        copy_into(state, seen)
    state[5] = max(state[5], 0.0)
    told[OBSERVED] = 1.0
    told[SEEN_AT] = time


@kernel
def _predict(memory: PushingMemory, contact: Contact, begin: float, end: float) -> None:
    """Move the guess on from one time to another by what takes effect in between."""
    sent = memory.horizon.sent
    count = memory.horizon.counts[UNDER_WAY]
    for i in range(count):
        until = sent[i + 1, 0] if i + 1 < count else np.inf
        duration = min(until + memory.delay, end) - max(sent[i, 0] + memory.delay, begin)
        if duration > 1e-12:
            advance(contact, memory.guess, sent[i, 1], sent[i, 2], duration, memory.detail)


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
    least = _LEAST * min(1.0, horizon.limits.max_turn_rate * length / base.max_speed)
    for i in range(horizon.program.moves):
        horizon.program.low[i] = min(least, horizon.last[0] / base.max_speed + reach)
    near = memory.near
    far = _BESIDE * contact.half
    copy_into(near, memory.guess)
    near[3] = min(max(near[3], -far), far)
    near[5] = min(near[5], _AHEAD * length)
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
    look = max(_LOOK * held, 2.0 * abs(v) / horizon.limits.max_acceleration)
    free = free_fraction(contact, normal, start, v, w, look, clearance, obstacles)
    if free < _BLOCKED:
        speed = max(abs(v), abs(w) * length)
        for i in range(_ASIDES):
            turn = (0.1, 0.3, 0.7)[i // 2]
            aside = w + (turn if i % 2 == 0 else -turn) * speed / length
            other = free_fraction(contact, normal, start, v, aside, look, clearance, obstacles)
            if other > free + _BLOCKED * turn:
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
