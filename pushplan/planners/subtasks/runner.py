"""`Runner`: candidate pushes run through the interaction model, and what comes of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.subtasks.push import Push
from pushplan.planners.subtasks.rollout import EVENTS, all_done, roll_out
from pushplan.planners.subtasks.scene import Scene
from pushplan.world.checks import BoolArray, FloatArray


class Runner:
    """Runs candidate pushes of one scene, and turns stages into pushes."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        count = len(scene.poses)
        sides = scene.world.static.bounds[2:] - scene.world.static.bounds[:2]
        self.longest = 2.0 * float(sides.sum())
        steps = int(self.longest / scene.law.step) + 2
        self._track = np.empty((steps, 3))
        self._steps = np.zeros(EVENTS)
        self._poses = np.zeros((EVENTS, count, 3))
        self._lengths = np.zeros((EVENTS, count))
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
        scene, world = self.scene, self.scene.world
        flags = np.zeros(len(scene.poses), dtype=np.bool_)
        flags[list(wanted) or [led]] = True
        stages, _, _ = roll_out(
            start,
            scene.poses if poses is None else poses,
            -1 if path is None else led,
            self._none if path is None else path,
            shift,
            self.longest if limit is None else limit,
            flags,
            scene.law._replace(gain=gain),
            scene.bodies,
            scene.settings,
            scene.task,
            self._track,
            self._steps,
            self._poses,
            self._lengths,
        )
        found = []
        ids = world.movables.ids
        for s in range(stages):
            last = s == stages - 1
            if frees and not last:
                continue
            after = self._poses[s]
            done = all_done(after, scene.bodies, scene.task)
            covers = np.flatnonzero(done & ~scene.done)
            if (scene.done & ~done).any():
                continue  # something came back
            if not frees and (not len(covers) or (led not in covers and path is not None)):
                continue
            track = self._track[: int(self._steps[s])].copy()
            length = (len(track) - 1) * scene.law.step
            lengths = self._lengths[s] + (0.0 if spent is None else spent)
            found.append(
                Push(
                    covers=tuple(ids[covers].tolist()),
                    led=int(ids[led]),
                    guided=path is not None,
                    poses=track,
                    length=length,
                    work=float(world.movables.masses @ lengths),
                    price=length + self._effort(after, lengths, done),
                    object_poses=after.copy(),
                    box_path=self._none if path is None else path,
                    shift=shift,
                    gain=gain,
                    frees=frees,
                )
            )
        return found

    def swing(
        self,
        start: FloatArray,
        led: int,
        turn: float,
        poses: FloatArray | None = None,
        spent: FloatArray | None = None,
    ) -> list[Push]:
        """A turn on the spot that moves an object with the corner of the bumper, if it can be made.

        Args:
            start: (3,) pose.
            led: index of the object.
            turn: how far [rad].
            poses, spent: see `run`.
        """
        scene = self.scene
        steps = math.ceil(abs(turn) / 0.1)
        path = np.tile(start, (steps + 1, 1))
        path[:, 2] += np.linspace(0.0, turn, steps + 1)
        after = np.array(scene.poses if poses is None else poses)
        out = np.empty((len(path), len(after), 3))
        if sweep_path(path, after, scene.bodies, scene.settings, out) >= 0:
            return []
        lengths = np.hypot(*np.moveaxis(np.diff(out[:, :, :2], axis=0), 2, 0)).sum(axis=0)
        lengths += 0.0 if spent is None else spent
        done = all_done(after, scene.bodies, scene.task)
        if (scene.done & ~done).any():
            return []
        ids, masses = scene.world.movables.ids, scene.world.movables.masses
        price = scene.config.turn_price * scene.size * abs(turn)
        return [
            Push(
                covers=tuple(ids[np.flatnonzero(done & ~scene.done)].tolist()),
                led=int(ids[led]),
                guided=False,
                poses=path,
                length=0.0,
                work=float(masses @ lengths),
                price=price + self._effort(after, lengths, done),
                object_poses=after,
                frees=True,
                turn=turn,
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
        if push.turn:
            return self.swing(start, led, push.turn, poses, spent)
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
            now, then = scene.remaining_now[moved], scene.remaining(poses)[moved]
            known = np.isfinite(now) & np.isfinite(then)
            change = np.full(len(moved), self.longest)
            change[known] = then[known] - now[known]
            price += float(scene.weights[moved] @ change) + float(np.maximum(change, 0.0).sum())
        return max(price, 0.0)
