"""Compiled step of the predictive tracker: from a pose to a command."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.control.mpc.assembly_kernels import AssemblyMemory, assemble
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
from pushplan.control.mpc.tracking_kernels import (
    ReferencePath,
    Tuning,
    arc,
    errors,
    locate,
)
from pushplan.geometry.angles import wrap_angle
from pushplan.world.checks import FloatArray

_BACK = 0.25  # greatest move back of the place on the path from one call to the next [R]
_WINDOW = 2.0  # distance ahead of the last place in which the next one is looked for [R]
_TURN_STOPPED = 0.25 * np.pi
_TURN_DRIVING = 0.5 * np.pi
"""Heading errors from which a robot turns towards the path first [rad]."""


class TrackerMemory(NamedTuple):
    """All that a tracker knows: its parameters, its state, memory."""

    horizon: Horizon
    tuning: Tuning
    span: float  # Time that the steps reach, if none is shorter than the control period [s]
    delay: float  # Between a command and its effect [s]
    pose: FloatArray  # (3,) where the robot is when the next command takes effect
    place: FloatArray  # (1,) path length of the place on the path [m]
    assembly: AssemblyMemory


@kernel
def begin_track(memory: TrackerMemory) -> None:
    """Begin a path."""
    memory.place[0] = 0.0
    memory.horizon.counts[KNOWN] = 0


@kernel
def begin_step(
    memory: TrackerMemory,
    track: ReferencePath,
    pose: FloatArray,  # (3,) observed x, y [m], theta [rad]
    time: float,  # of it [s]
    held: float,  # from the last call to this one [s]
    out: FloatArray,  # (2,) the command
) -> bool:
    """Put up the program for where the robot is; False if the command is known, and filled."""
    horizon = memory.horizon
    tuning = memory.tuning
    here = memory.pose
    lay_steps(horizon, memory.span, held)
    if horizon.counts[KNOWN] == 1:
        _shift(horizon, held)
    _predict(memory, pose, time)
    low = max(memory.place[0] - _BACK * tuning.size, 0.0)
    high = memory.place[0] + _WINDOW * tuning.size
    along, index, fraction = locate(track, here[0], here[1], low, high)
    memory.place[0] = min(along, track.lengths[-1])
    error = errors(track, here[0], here[1], here[2], index, fraction)[1]
    if tuning.stops and along >= track.lengths[-1] - 1e-9:
        horizon.counts[KNOWN] = 0
        send(horizon, 0.0, 0.0, held, True, out)
        _remember(memory, time)
        return False
    if abs(error) > _turn_from(memory):
        # too far from the path's heading for a linear model: turn towards it first
        horizon.counts[KNOWN] = 0
        turn = np.copysign(tuning.max_turn_rate, -error)
        send(horizon, _turning_speed(horizon), turn, held, True, out)
        _remember(memory, time)
        return False
    set_bounds(horizon, horizon.steps[0], horizon.steps[1])
    for i in range(horizon.steps.shape[0], horizon.program.x.shape[0]):
        horizon.program.low[i] = 0.0  # a plan is driven forwards
    if horizon.counts[KNOWN] == 0:
        horizon.nominal[:] = np.nan
    assemble_step(memory, track)
    return True


@kernel
def assemble_step(memory: TrackerMemory, track: ReferencePath) -> None:
    """Put up the program about the nominal commands."""
    horizon = memory.horizon
    assemble(
        track,
        memory.tuning,
        memory.pose,
        memory.place[0],
        horizon.last,
        horizon.steps,
        horizon.nominal,
        horizon.program.hessian,
        horizon.program.gradient,
        memory.assembly,
    )


@kernel
def finish_step(
    memory: TrackerMemory,
    track: ReferencePath,
    pose: FloatArray,
    time: float,
    held: float,
    solved: bool,  # True if the nominal commands are a solution
    out: FloatArray,
) -> None:
    """Fill the command: of the solution, or what is nearest to it without one."""
    horizon = memory.horizon
    if solved:
        keep_solution(horizon)
        horizon.counts[MISSED] = 0
        send(horizon, horizon.solution[0, 0], horizon.solution[0, 1], held, False, out)
    else:
        _fall_back(memory, track, pose, held, out)
    _remember(memory, time)


@kernel
def _remember(memory: TrackerMemory, time: float) -> None:
    """Keep what was sent for as long as it has no effect yet."""
    if memory.delay > 0.0:
        remember(memory.horizon, time, time - memory.delay)


@kernel
def _turn_from(memory: TrackerMemory) -> float:
    """The heading error from which the robot turns towards the path first [rad]."""
    on_the_spot = memory.tuning.stops and memory.horizon.limits.turning_radius == 0.0
    return _TURN_STOPPED if on_the_spot else _TURN_DRIVING


@kernel
def _turning_speed(horizon: Horizon) -> float:
    """The speed at which a robot that can stop turns as fast as it can [m/s]."""
    limits = horizon.limits
    return min(limits.max_speed, limits.max_turn_rate * limits.turning_radius)


@kernel
def _shift(horizon: Horizon, held: float) -> None:
    """Move the last solution on by the time that has passed since; NaN past its end."""
    shift_steps(horizon, held)
    count = horizon.steps.shape[0]
    for k in range(count):  # never from an earlier step to a later one
        index = horizon.shifted[k]
        for j in range(2):
            horizon.nominal[k, j] = horizon.solution[index, j] if index < count else np.nan
    keep_solution(horizon)


@kernel
def _predict(memory: TrackerMemory, pose: FloatArray, time: float) -> None:
    """Set where the robot will be when a command of now takes effect."""
    here = memory.pose
    horizon = memory.horizon
    copy_into(here, pose)
    out = memory.assembly.motion
    count = horizon.counts[UNDER_WAY]
    # the command in force t seconds from now is the one that was sent `delay` before that
    for i in range(count):
        until = horizon.sent[i + 1, 0] if i + 1 < count else time
        lasts = min(until, time) - max(horizon.sent[i, 0], time - memory.delay)
        if lasts > 0.0:
            arc(here[0], here[1], here[2], horizon.sent[i, 1], horizon.sent[i, 2], lasts, out)
            for j in range(3):
                here[j] = out[j]


@kernel
def _fall_back(
    memory: TrackerMemory, track: ReferencePath, pose: FloatArray, held: float, out: FloatArray
) -> None:
    """Drive the last solution, moved on; pure pursuit where it has run out."""
    horizon = memory.horizon
    counts = horizon.counts
    ahead = horizon.solution[0]
    counts[FAILED] += 1
    counts[MISSED] += 1
    known = counts[KNOWN] == 1 and np.isfinite(ahead[0]) and np.isfinite(ahead[1])
    if known and counts[MISSED] < horizon.steps.shape[0]:
        send(horizon, ahead[0], ahead[1], held, True, out)
    else:
        counts[KNOWN] = 0
        v, w = pursue(memory, track, pose)
        send(horizon, v, w, held, True, out)


@kernel
def pursue(memory: TrackerMemory, track: ReferencePath, pose: FloatArray) -> tuple[float, float]:
    """Speed and turn rate on the arc to a point R ahead (Coulter, CMU-RI-TR-92-01)."""
    tuning = memory.tuning
    lengths = track.lengths
    poses = track.poses
    last = lengths.shape[0] - 1
    aim = memory.place[0] + tuning.size
    i = 0
    while i < last and lengths[i + 1] <= memory.place[0]:
        i += 1
    speed = track.speeds[i]
    while i < last - 1 and lengths[i + 1] < aim:
        i += 1
    if aim >= lengths[last]:  # continue the last heading beyond the end
        over = aim - lengths[last]
        x = poses[last, 0] + over * np.cos(poses[last, 2])
        y = poses[last, 1] + over * np.sin(poses[last, 2])
    else:
        fraction = (aim - lengths[i]) / (lengths[i + 1] - lengths[i])
        x = poses[i, 0] + fraction * (poses[i + 1, 0] - poses[i, 0])
        y = poses[i, 1] + fraction * (poses[i + 1, 1] - poses[i, 1])
    dx = x - pose[0]
    dy = y - pose[1]
    bearing = wrap_angle(np.arctan2(dy, dx) - pose[2])
    if abs(bearing) > _turn_from(memory):
        turn = np.copysign(tuning.max_turn_rate, bearing)
        return _turning_speed(memory.horizon) if tuning.stops else speed, turn
    curvature = 2.0 * np.sin(bearing) / max(np.sqrt(dx * dx + dy * dy), 1e-9)
    radius = memory.horizon.limits.turning_radius
    if radius > 0.0:
        curvature = min(max(curvature, -1.0 / radius), 1.0 / radius)
    if tuning.stops and abs(curvature) * speed > tuning.max_turn_rate:
        speed = tuning.max_turn_rate / abs(curvature)
    return speed, speed * curvature
