"""`PushSimulator`: candidate pushes rolled out in the interaction model, and what comes of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.rearrangement.goal_kernels import all_done
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.push_poses import pose_distance
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rollout_cache import Rollout
from pushplan.planners.rearrangement.rollout_kernels import (
    STAGES,
    RolloutLog,
    RolloutProblem,
    roll_out,
)
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.polyline import path_length, path_lengths

_ALIKE = 0.2
"""By how much places of an object may differ that a relocation gets it to
[circumscribed radii]."""
_NO_PATH = np.zeros((0, 2))


class PushSimulator:
    """Rolls out candidate pushes of one scene, and turns stages into pushes."""

    def __init__(self, scene: PushScene) -> None:
        self.scene = scene
        count = len(scene.poses)
        sides = scene.world.static.bounds[2:] - scene.world.static.bounds[:2]
        step = scene.controller.step
        self.longest = min(2.0 * float(sides.sum()), scene.config.max_steps * step)
        steps = int(self.longest / step) + 2
        self._log = RolloutLog(
            np.empty((steps, 3)),
            np.zeros(STAGES),
            np.zeros((STAGES, count, 3)),
            np.zeros((STAGES, count)),
            np.zeros(4),
        )
        self.left = np.flatnonzero(~scene.done)

    def simulate(
        self,
        start: FloatArray,
        target: int,
        *,
        path: FloatArray | None = None,
        shift: float = 0.0,
        limit: float | None = None,
        wanted: Sequence[int] = (),
        gain: float = 1.5,
        friction: float | None = None,
        relocates: bool = False,
        poses: FloatArray | None = None,
        spent: FloatArray | None = None,
    ) -> list[Push]:
        """The pushes that one start gives: one for each stage at which more objects are done.

        Args:
            start: (3,) pose.
            target: index of the object that follows the path, or is pushed first.
            path: (M, 2) of the target object; None for a line push [m].
            shift: see `Push`.
            limit: of the length [m].
            wanted: indices of the objects after which to stop; ``target`` alone by default.
            gain: of the pushing controller.
            friction: coefficient between robot and objects; that of the config by default.
            relocates: whether to keep only the end, whatever is done then.
            poses: (K, 3) where the objects are when the push begins; where they are now by default.
            spent: (K,) path lengths that getting there has cost them [m].
        """
        problem = self._problem(target, path, shift, limit, wanted, gain, friction)
        rollout = self._roll_out(
            start, target, problem, self.scene.poses if poses is None else poses
        )
        stages = range(len(rollout.steps))
        found = (
            self._push_of(rollout, s, target, problem, spent, relocates)
            for s in (stages[-1:] if relocates else stages)
        )
        return [push for push in found if push is not None]

    def end_of(
        self,
        start: FloatArray,
        target: int,
        *,
        path: FloatArray | None = None,
        shift: float = 0.0,
        limit: float | None = None,
        wanted: Sequence[int] = (),
        gain: float = 1.5,
        friction: float | None = None,
    ) -> FloatArray:
        """(3,) where a push gets the target object to; the arguments are those of `simulate`."""
        problem = self._problem(target, path, shift, limit, wanted, gain, friction)
        end: FloatArray = self._roll_out(start, target, problem, self.scene.poses).poses[-1, target]
        return end

    def _problem(
        self,
        target: int,
        path: FloatArray | None,
        shift: float,
        limit: float | None,
        wanted: Sequence[int],
        gain: float,
        friction: float | None,
    ) -> RolloutProblem:
        """What `roll_out` takes; the arguments are those of `simulate`."""
        scene = self.scene
        flags = np.zeros(len(scene.poses), dtype=np.bool_)
        flags[list(wanted) or [target]] = True
        settings = scene.settings
        if friction is not None:
            settings = settings._replace(friction=float(friction))
        return RolloutProblem(
            target=target if path is not None and len(path) else -1,
            path=_NO_PATH if path is None else path,
            shift=shift,
            limit=self.longest if limit is None else limit,
            wanted=flags,
            controller=scene.controller._replace(gain=gain),
            bodies=scene.bodies,
            settings=settings,
            goal=scene.object_goal,
        )

    def _roll_out(
        self, start: FloatArray, target: int, problem: RolloutProblem, poses: FloatArray
    ) -> Rollout:
        """Roll out a push, unless it is known what comes of it."""
        scene, log, wanted = self.scene, self._log, problem.wanted
        movables, cache = scene.world.movables, scene.cache
        key = (
            start.tobytes(),
            int(movables.ids[target]),
            problem.path.tobytes(),
            problem.shift,
            problem.limit,
            problem.controller.gain,
            problem.settings.friction,
            movables.ids[wanted].tobytes(),
        )
        if poses is not scene.poses or (wanted & scene.done).any():
            cache = None
        known = None if cache is None else cache.find(key, movables, poses)
        if known is not None:
            return known
        scene.budget.used += 1
        # copies may be written to: one kernel for all
        stages, used = roll_out(np.array(start), np.array(poses), problem, log)
        rollout = Rollout(
            log.track[:used].copy(),
            log.steps[:stages].astype(np.int64),
            log.poses[:stages].copy(),
            log.lengths[:stages].copy(),
        )
        if cache is not None:
            cache.keep(key, movables, poses, rollout, log.box)
        return rollout

    def _push_of(
        self,
        rollout: Rollout,
        s: int,
        target: int,
        problem: RolloutProblem,
        spent: FloatArray | None,
        relocates: bool,
    ) -> Push | None:
        """The push up to stage ``s`` of a rollout; None where nothing is won by it."""
        scene, movables = self.scene, self.scene.world.movables
        after, lengths = rollout.poses[s], rollout.lengths[s]
        done = all_done(after, scene.bodies, scene.object_goal)
        delivers = np.flatnonzero(done & ~scene.done)
        follows_path = len(problem.path) > 0
        if (scene.done & ~done).any():
            return None  # something came back
        homeward = target in delivers if follows_path else len(delivers) > 0
        if not (relocates or homeward):
            return None
        track = rollout.track[: int(rollout.steps[s])]
        length = (len(track) - 1) * scene.controller.step
        lengths = lengths + (0.0 if spent is None else spent)
        return Push(
            delivers=tuple(movables.ids[delivers].tolist()),
            target=int(movables.ids[target]),
            controller="path" if follows_path else "line",
            poses=track,
            length=length,
            work=float(movables.masses @ lengths),
            cost=length + self._effort(after, lengths, done),
            object_poses=after,
            object_path=problem.path,
            shift=problem.shift,
            gain=problem.controller.gain,
            relocates=relocates,
        )

    def simulate_primitive(
        self,
        path: FloatArray,
        target: int,
        poses: FloatArray | None = None,
        spent: FloatArray | None = None,
    ) -> list[Push]:
        """A drive that moves an object with whatever part of the robot meets it, if it can be made.

        Args:
            path: (N, 3) poses of the robot, near each other.
            target: index of the object.
            poses: see `simulate`.
            spent: see `simulate`.
        """
        scene = self.scene
        after = np.array(scene.poses if poses is None else poses)
        out = np.empty((len(path), len(after), 3))
        if sweep_path(path, after, scene.bodies, scene.settings, out) >= 0:
            return []
        lengths = path_lengths(out) + (0.0 if spent is None else spent)
        done = all_done(after, scene.bodies, scene.object_goal)
        if (scene.done & ~done).any():
            return []
        ids, masses = scene.world.movables.ids, scene.world.movables.masses
        length = path_length(path)
        cost = length + scene.turn_cost * float(np.abs(np.diff(path[:, 2])).sum())
        return [
            Push(
                delivers=tuple(ids[np.flatnonzero(done & ~scene.done)].tolist()),
                target=int(ids[target]),
                controller="arc",
                relocates=True,
                poses=path,
                length=length,
                work=float(masses @ lengths),
                cost=cost + self._effort(after, lengths, done),
                object_poses=after,
            )
        ]

    def resimulate(
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
            poses: see `simulate`.
            spent: see `simulate`.
        """
        scene = self.scene
        ids = scene.world.movables.ids
        target = int(np.flatnonzero(ids == push.target)[0])
        if push.controller == "arc":
            path = np.vstack([start, push.poses[1:]])
            path[:, 2] = np.unwrap(path[:, 2])
            ends = self.simulate_primitive(path, target, poses, spent)
        else:
            ends = self.simulate(
                start,
                target,
                path=push.object_path if push.controller == "path" else None,
                shift=push.shift,
                limit=push.length if push.relocates else None,
                wanted=np.flatnonzero(np.isin(ids, push.delivers) & ~scene.done).tolist(),
                gain=push.gain,
                relocates=push.relocates,
                poses=poses,
                spent=spent,
            )
        return self._still_relocating(push, target, ends, poses) if push.relocates else ends

    def _still_relocating(
        self, push: Push, target: int, ends: Sequence[Push], poses: FloatArray | None
    ) -> list[Push]:
        """Those that get the target where it was to be relocated to, or half the way on a path."""
        if len(push.object_poses) != len(self.scene.poses):
            return []  # planned among other objects
        size, there = self.scene.size, push.object_poses[target]
        near = _ALIKE
        if push.controller != "arc":
            now = (self.scene.poses if poses is None else poses)[target]
            near = max(near, 0.5 * pose_distance(now, there, size))
        return [end for end in ends if pose_distance(end.object_poses[target], there, size) < near]

    def _effort(self, poses: FloatArray, lengths: FloatArray, done: BoolArray) -> float:
        """Work, and what the objects that are left behind have farther or less far to go [m]."""
        scene = self.scene
        cost = float(scene.weights @ lengths)
        moved = np.flatnonzero((lengths > 1e-9) & ~done)
        if len(moved):
            now, then = scene.remaining_now[moved], scene.remaining(poses[moved])
            known = np.isfinite(now) & np.isfinite(then)
            change = np.full(len(moved), self.longest)
            change[known] = then[known] - now[known]
            cost += float(scene.weights[moved] @ change) + float(np.maximum(change, 0.0).sum())
        return max(cost, 0.0)
