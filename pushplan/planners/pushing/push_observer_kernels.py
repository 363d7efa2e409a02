"""Memory of the pushing controller, and its compiled estimate of robot and box from their poses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.control.mpc.horizon import UNDER_WAY, Horizon
from pushplan.geometry.angles import wrap_angle
from pushplan.planners.pushing.box_motion_kernels import advance, observe
from pushplan.planners.pushing.clearance_kernels import ClearanceProblem
from pushplan.planners.pushing.contact_kernels import Contact
from pushplan.planners.pushing.cost_kernels import Memory, Weights
from pushplan.world.checks import FloatArray, IntArray

_FACE_TURNED = np.pi * 50.0 / 180.0  # angle at which another face is taken to be the pushed one
_POSE_JUMP = 0.35  # a pose farther than this from the predicted one replaces it [L]
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
def estimate(memory: PushingMemory, pose: FloatArray, box: FloatArray, time: float) -> None:
    """Estimate the state from poses (3,), now and for when a command of now takes effect."""
    faces = memory.faces
    contact = contact_now(memory)
    observe(contact, faces.normals[memory.face[0]], pose, box, memory.seen)
    if abs(memory.seen[4]) > _FACE_TURNED:
        take_face(memory, pose[2] - box[2])
        contact = contact_now(memory)
        observe(contact, faces.normals[memory.face[0]], pose, box, memory.seen)
    _correct(memory, contact, contact.front + contact.depth, time)
    copy_into(memory.guess, memory.state)
    _predict(memory, contact, time, time + memory.delay)


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
        if far / size >= _POSE_JUMP or turned >= _POSE_JUMP:
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
