"""`Runner`: candidate pushes run through the interaction model, and what comes of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.rearrangement.places import apart, lengths_of
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.rollout import EVENTS, Log, all_done, roll_out
from pushplan.planners.rearrangement.rollout_cache import Run
from pushplan.planners.rearrangement.scene import Scene
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.polyline import path_length

_ALIKE = 0.2
"""By how much places of an object may differ that a maneuver gets it to [circumscribed radii]."""


class Runner:
    """Runs candidate pushes of one scene, and turns stages into pushes."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        count = len(scene.poses)
        sides = scene.world.static.bounds[2:] - scene.world.static.bounds[:2]
        self.longest = 2.0 * float(sides.sum())
        steps = int(self.longest / scene.law.step) + 2
        self._log = Log(
            np.empty((steps, 3)),
            np.zeros(EVENTS),
            np.zeros((EVENTS, count, 3)),
            np.zeros((EVENTS, count)),
            np.zeros(4),
        )
        self._none = np.zeros((0, 2))
        self.left = np.flatnonzero(~scene.done)

    def run(
        self,
        start: FloatArray,
        led: int,
        *,
        path: FloatArray | None = None,
        shift: float = 0.0,
        limit: float | None = None,
        wanted: Sequence[int] = (),
        gain: float = 1.5,
        frees: bool = False,
        poses: FloatArray | None = None,
        spent: FloatArray | None = None,
    ) -> list[Push]:
        """The pushes that one start gives: one for each stage at which more objects are done.

        Args:
            start: (3,) pose.
            led: index of the object that is led or pushed first.
            path: (M, 2) of the led object for a guided push; None for a line push [m].
            shift: see `Push`.
            limit: of the length [m].
            wanted: indices of the objects after which to stop; ``led`` alone by default.
            gain: of the pushing law.
            frees: whether to keep the end where nothing is done.
            poses: (K, 3) where the objects are when the push begins; where they are now by default.
            spent: (K,) path lengths that getting there has cost them [m].
        """
        scene = self.scene
        flags = np.zeros(len(scene.poses), dtype=np.bool_)
        flags[list(wanted) or [led]] = True
        way = self._none if path is None else path
        limit = self.longest if limit is None else limit
        run = self._run(
            start, led, way, shift, limit, flags, gain, scene.poses if poses is None else poses
        )
        found = []
        for s in range(len(run.steps)):
            if frees and s < len(run.steps) - 1:
                continue
            push = self._stage(run, s, led, way, shift, gain, frees, spent)
            if push is not None:
                found.append(push)
        return found

    def _run(
        self,
        start: FloatArray,
        led: int,
        path: FloatArray,
        shift: float,
        limit: float,
        wanted: BoolArray,
        gain: float,
        poses: FloatArray,
    ) -> Run:
        """Run a push, unless it is known what comes of it. Arguments as in `roll_out`."""
        scene, log = self.scene, self._log
        movables, recall = scene.world.movables, scene.recall
        key = (
            start.tobytes(),
            int(movables.ids[led]),
            path.tobytes(),
            shift,
            limit,
            gain,
            movables.ids[wanted].tobytes(),
        )
        if poses is not scene.poses or (wanted & scene.done).any():
            recall = None
        known = None if recall is None else recall.find(key, movables, poses)
        if known is not None:
            return known
        stages, used, _ = roll_out(
            np.array(start),  # a copy may be written to: one kernel for all
            np.array(poses),
            led if len(path) else -1,
            path,
            shift,
            limit,
            wanted,
            scene.law._replace(gain=gain),
            scene.bodies,
            scene.settings,
            scene.task,
            log,
        )
        run = Run(
            log.track[:used].copy(),
            log.steps[:stages].astype(np.int64),
            log.poses[:stages].copy(),
            log.lengths[:stages].copy(),
        )
        if recall is not None:
            recall.keep(key, movables, poses, run, log.box)
        return run

    def _stage(
        self,
        run: Run,
        s: int,
        led: int,
        path: FloatArray,
        shift: float,
        gain: float,
        frees: bool,
        spent: FloatArray | None,
    ) -> Push | None:
        """The push up to stage ``s`` of a run; None where nothing is won by it."""
        scene, movables = self.scene, self.scene.world.movables
        after, lengths = run.poses[s], run.lengths[s]
        done = all_done(after, scene.bodies, scene.task)
        covers = np.flatnonzero(done & ~scene.done)
        if (scene.done & ~done).any():
            return None  # something came back
        if not frees and (not len(covers) or (len(path) and led not in covers)):
            return None
        track = run.track[: int(run.steps[s])]
        length = (len(track) - 1) * scene.law.step
        lengths = lengths + (0.0 if spent is None else spent)
        return Push(
            covers=tuple(movables.ids[covers].tolist()),
            led=int(movables.ids[led]),
            guided=len(path) > 0,
            poses=track,
            length=length,
            work=float(movables.masses @ lengths),
            price=length + self._effort(after, lengths, done),
            object_poses=after,
            box_path=path,
            shift=shift,
            gain=gain,
            frees=frees,
        )

    def trace(
        self,
        path: FloatArray,
        led: int,
        poses: FloatArray | None = None,
        spent: FloatArray | None = None,
    ) -> list[Push]:
        """A drive that moves an object with whatever part of the robot meets it, if it can be made.

        Args:
            path: (N, 3) poses of the robot, near each other.
            led: index of the object.
            poses, spent: see `run`.
        """
        scene = self.scene
        after = np.array(scene.poses if poses is None else poses)
        out = np.empty((len(path), len(after), 3))
        if sweep_path(path, after, scene.bodies, scene.settings, out) >= 0:
            return []
        lengths = lengths_of(out) + (0.0 if spent is None else spent)
        done = all_done(after, scene.bodies, scene.task)
        if (scene.done & ~done).any():
            return []
        ids, masses = scene.world.movables.ids, scene.world.movables.masses
        length = path_length(path)
        price = length + scene.config.turn_price * scene.size * float(
            np.abs(np.diff(path[:, 2])).sum()
        )
        return [
            Push(
                covers=tuple(ids[np.flatnonzero(done & ~scene.done)].tolist()),
                led=int(ids[led]),
                guided=False,
                poses=path,
                length=length,
                work=float(masses @ lengths),
                price=price + self._effort(after, lengths, done),
                object_poses=after,
                frees=True,
                traced=True,
            )
        ]

    def again(
        self,
        push: Push,
        start: FloatArray,
        *,
        poses: FloatArray | None = None,
        spent: FloatArray | None = None,
    ) -> list[Push]:
        """What a push would come to from another start, or after something has been moved.

        Args:
            push: the push.
            start: (3,) where it begins now.
            poses, spent: see `run`.
        """
        scene = self.scene
        ids = scene.world.movables.ids
        led = int(np.flatnonzero(ids == push.led)[0])
        if push.traced:
            path = np.vstack([start, push.poses[1:]])
            path[:, 2] = np.unwrap(path[:, 2])
            ends = self.trace(path, led, poses, spent)
            there, size = push.object_poses[led], scene.size
            return [end for end in ends if apart(end.object_poses[led], there, size) < _ALIKE]
        return self.run(
            start,
            led,
            path=push.box_path if push.guided else None,
            shift=push.shift,
            limit=push.length if push.frees else None,
            wanted=np.flatnonzero(np.isin(ids, push.covers) & ~scene.done).tolist(),
            gain=push.gain,
            frees=push.frees,
            poses=poses,
            spent=spent,
        )

    def _effort(self, poses: FloatArray, lengths: FloatArray, done: BoolArray) -> float:
        """Work, and what the objects that are left behind have farther or less far to go [m]."""
        scene = self.scene
        price = float(scene.weights @ lengths)
        moved = np.flatnonzero((lengths > 1e-9) & ~done)
        if len(moved):
            now, then = scene.remaining_now[moved], scene.remaining(poses[moved])
            known = np.isfinite(now) & np.isfinite(then)
            change = np.full(len(moved), self.longest)
            change[known] = then[known] - now[known]
            price += float(scene.weights[moved] @ change) + float(np.maximum(change, 0.0).sum())
        return max(price, 0.0)
