"""`PathImprover`: the best path so far of one planning call, and how paths get better."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.interaction import InteractionModel
from pushplan.interaction.compiled_model import SweptModel, compile_interaction
from pushplan.motion.collision import footprint, goal_numbers, obstacles
from pushplan.motion.goal_approach import behind, fitting, path_end, run_up
from pushplan.motion.keep_out import keep_out
from pushplan.motion.path_search_config import (
    BATCH,
    INSET,
    LEAST_GAIN,
    SHORTCUTS,
    SPACING,
    PathSearchConfig,
)
from pushplan.motion.room_ahead import Room
from pushplan.motion.speed_profile import TIGHTEST, goal_is_outside, start_margin, timed_plan
from pushplan.motion.swept_path import SweptPath, make_swept_path
from pushplan.motion.time_slicing import Pace
from pushplan.world import Drive, GoalDisc, GoalPose, PlanResult, PlanStatus
from pushplan.world.checks import FloatArray
from pushplan.world.planning_call import PlanningCall
from pushplan.world.polyline import arc_lengths

_THIN_MARGIN = 0.05
"""Margin below which a post could hide between two poses of the usual spacing [R]."""
_LEAST_SPACING = 0.02  # least spacing for that reason [R]
_LESS_MARGIN = 0.4  # of the margin is kept where plans fail with it
_NO_MARGIN = 0.01  # a margin as small is given up then [R]
_NEAR = 0.5
"""Radius of the disc at a goal pose to which searches lead [tolerance of the place], or at the
beginning of a straight way into it [R]."""
_SLOT = 2.5  # ways at both ends of a straight way on which a robot does not turn [R]
_LONGEST_SLOT = 0.4  # the same of its length at most
_BEYOND = 1e4  # times the way around the workspace with everything in tow: no path is as long
ENDLESS = 2**62
"""A limit of the tests of a sweep that is none."""


@dataclass
class Candidate:
    """A path that is being shortcut, with the memory for it."""

    path: SweptPath
    trial: core.SweptPath
    count: int
    cost: float
    is_best: bool = False
    """True if the best path is this one itself, not a copy of it."""


class Lead(NamedTuple):
    """Motion with which every path of a search begins, before the search itself."""

    pieces: FloatArray
    """(E, 2) length [m] and curvature [1/m] of arcs from the robot's pose on.

    A turn on the spot has an infinite curvature and an angle [rad] for its length."""
    pose: FloatArray  # (3,) where the search begins
    objects: FloatArray  # (K, 3) poses of the objects by then


class PathImprover:
    """State shared by the searches of a planning call: problem, clock, and best path."""

    def __init__(
        self,
        call: PlanningCall,  # its world, stop rule and source of chance
        config: PathSearchConfig,
        interaction: InteractionModel,
        turning_radius: float,  # least one of plans at first [m]
    ) -> None:
        world = call.world
        self.given = world  # with its own goal
        self.pose_goal = world.goal if isinstance(world.goal, GoalPose) else None
        """A goal with a heading; searches of `world` lead to where the end of a path begins."""
        self._fits = True
        self._straight = 0.0
        if self.pose_goal is not None:
            fitted = fitting(world, self.pose_goal)
            self._fits = fitted is not None
            self.pose_goal = fitted or self.pose_goal
            self._straight = run_up(world, self.pose_goal, turning_radius)
            near = self.pose_goal.radius
            if self._straight:
                near = world.robot.circumscribed_radius
            place = behind(self.pose_goal, self._straight)[:2]
            world = replace(world, goal=GoalDisc(place, _NEAR * near))
        self.world = world
        self.config = config
        self.rng = call.rng
        self.goal = world.navigation_goal
        self.size = world.robot.circumscribed_radius
        self.iterations = self.nodes = self.relaxed = 0
        self.tight = False
        self.backward = 0.0
        """Greatest distance by which paths of trees may lead back [m]."""
        self.lead = self._no_lead = Lead(np.empty((0, 2)), world.robot_pose, world.movables.poses)
        self.best_cost = np.inf
        self.first_solution_s = float("nan")
        self.turning_radius = turning_radius
        self.interaction = interaction
        self.contacts = compile_interaction(interaction, world)
        self._jam_length = self._endless_length()
        self._price = None
        if world.price is not None:
            price = world.price
            self._price = core.PriceGrid(price.prices, price.origin, price.resolution)
        self.room = Room(
            footprint(world.robot),
            obstacles(keep_out(world)),
            goal_numbers(self.goal, INSET * self.size),
            SPACING * self.size,
        )
        self._goal_of_paths = self.room.goal
        if self.pose_goal is not None:
            turns = world.robot.drive is Drive.DIFFERENTIAL and not self._straight
            self._goal_of_paths = np.append(self.room.goal[:4], self.pose_goal.heading)
            self._goal_of_paths[0] = 2.0 + turns
        # crowded worlds are slow to sweep: look at the stop rule more often
        self._batch = max(1, 10 * BATCH // (10 + len(world.movables)))
        self._call = call
        self._margin = 0.0
        self._shortcut_pace = Pace()
        self._sweep_pace = Pace()
        self.best: SweptPath | None = None
        self.spare: PathImprover | None = None
        """Has a path that is the plan if no other one is found."""

    def begin(self) -> PlanStatus | None:
        """Find the margin that can be kept; a status where the call ends here already."""
        margin = start_margin(self.world, self.config.margin * self.size)
        if margin is None:
            return PlanStatus.START_BLOCKED
        if goal_is_outside(self.given) or not self._fits:
            return PlanStatus.GOAL_UNREACHABLE
        goal = self.pose_goal
        if goal is not None:
            margin = start_margin(self.world, margin, goal.pose) or 0.0
        self._set_margin(margin)
        if self.given.goal_reached:
            here = make_swept_path(1, len(self.world.movables))
            here.poses[0] = self.world.robot_pose
            here.objects[0] = self.world.movables.poses
            self.keep(here, 1, 0.0)
            return PlanStatus.SOLVED
        if goal is not None and goal.distance(*self.world.robot_pose[:2]) == 0.0:
            self.candidate(np.empty((0, 2)), self.jam_cost)  # it only has to turn
        return PlanStatus.SOLVED if self.solved else None

    def begin_with(self, lead: Lead | None) -> None:
        """Begin all paths with some arcs, from the next search on; None begins at the robot."""
        self.lead = self._no_lead if lead is None else lead

    def relax(self) -> None:
        """Allow tighter turns from the second time on, and less margin from the fourth.

        That helps where the robot starts in a tight place or has to turn round first. A
        constant-speed robot may then use its whole turn rate; one that can slow down turns on half
        the radius, to a tenth of its size. The margin comes last: who drives without it may touch
        a wall.
        """
        self.relaxed += 1
        if self.relaxed < 2:
            return
        if self.relaxed >= 4:
            margin = _LESS_MARGIN * self._margin
            if self._margin <= _NO_MARGIN * self.size:
                margin = 0.0
            self._set_margin(margin)
        radius = self.world.robot.turning_radius
        if self.world.robot.turns_on_spot:
            radius = 0.5 * self.turning_radius
        self.turning_radius = max(radius, TIGHTEST * self.size)

    def _set_margin(self, margin: float) -> None:
        """Keep ``margin`` [m] from walls; with little of it poses lie closer, for what is thin."""
        self._margin = margin
        spacing = SPACING * self.size
        if margin < _THIN_MARGIN * self.size:
            spacing = min(spacing, max(2.0 * margin, _LEAST_SPACING * self.size))
        shape = footprint(self.world.robot, margin)
        self.room = self.room._replace(spacing=spacing, footprint=shape)

    def _endless_length(self) -> float:
        """A length [m] that no path without a jam comes near."""
        world = self.world
        extent = float((world.static.bounds[2:] - world.static.bounds[:2]).sum())
        load = self.config.push_weight * float(world.movables.masses.sum()) / world.robot.mass
        if world.price is not None:
            load += float(world.price.prices.max(initial=0.0))
        return _BEYOND * (extent + self.size) * (1.0 + load)

    @property
    def problem(self) -> core.PathProblem:
        """Costs and constraints of paths, with the limits of now."""
        room = self.room
        return core.PathProblem(
            robot_mass=self.world.robot.mass,
            push_weight=self.config.push_weight,
            turning_radius=self.turning_radius,
            spacing=room.spacing,
            jam_length=self._jam_length,
            displacement=1.5 * self.size,
            goal=self._goal_of_paths,
            footprint=room.footprint,
            walls=room.walls,
            price=self._price,
            reverses=self.world.robot.curves_back,
            slides=self.world.robot.slides,
        )

    @property
    def jam_cost(self) -> float:
        """A cost [kg m] that no path without a jam comes near."""
        return self._jam_length * self.world.robot.mass

    @property
    def plan_cost(self) -> float:
        """The cost of the best plan [kg m], infinite while there is none."""
        return self.best_cost if self.solved else np.inf

    @property
    def solved(self) -> bool:
        """True if the best path is free of jams."""
        return self.best_cost < self.jam_cost

    def stopped(self, more: int = 0) -> bool:
        """Return True if the stop rule fires now, or after so many iterations more."""
        if isinstance(self.contacts, SweptModel):
            self.contacts.raise_error()
        return self._call.check(self.iterations + more, self.plan_cost)

    def candidate(
        self,
        arcs: FloatArray,  # (E, 2) length [m] and curvature [1/m], from the end of the lead on
        limit: float = np.inf,  # cost that it must stay below [kg m]
    ) -> Candidate | None:
        """The path along some arcs, free of walls, with its cost; None where it costs too much.

        None too where the robot cannot take the heading of its goal there.
        """
        ended = self.ended(*self._along(arcs, 3))
        if ended is None:
            return None
        path, used = ended
        cost = self.sweep(path, used, limit)
        if cost is None:
            return None
        self.keep(path, used, cost)
        trial = make_swept_path(len(path.poses), len(self.world.movables))
        return Candidate(path, trial.view(), used, cost)

    def drives(self, arcs: FloatArray) -> bool:
        """Keep the path along some arcs where it touches no wall, jams nothing and arrives."""
        ended = self.ended(*self._along(arcs))
        return ended is not None and self._arrives(*ended)

    def slides(self, places: FloatArray) -> bool:
        """Keep the straight way from place to place (V, 2) likewise, turning at an even rate.

        It ends at the goal pose where that is the goal, else at the heading that the robot has.
        Where it touches a wall, the turn is made away from both ends, which may be in a slot.
        """
        start = self.world.robot_pose
        corners = np.vstack([start[:2], places])
        turn = 0.0
        if self.pose_goal is not None:
            corners[-1] = self.pose_goal.center
            turn = self.pose_goal.heading_error(float(start[2]))
        along = arc_lengths(corners)
        length = float(along[-1])
        if length == 0.0:
            return False
        count = math.ceil(length / self.room.spacing + abs(turn) / core.step_along(np.inf, 1.0))
        for kept in (0.0, min(_SLOT * self.size, _LONGEST_SLOT * length)):
            at = np.union1d(np.linspace(0.0, length, count + 1), [*along, kept, length - kept])
            x, y = (np.interp(at, along, column) for column in corners.T)
            turned = np.interp(at, [kept, length - kept], [0.0, turn])
            path = make_swept_path(len(at), len(self.world.movables))
            path.poses[:] = np.column_stack([x, y, start[2] + turned])
            path.objects[0] = self.world.movables.poses
            if self._arrives(path, len(at)):
                return True
        return False

    def _arrives(self, path: SweptPath, used: int) -> bool:
        """Keep a path if it is a plan."""
        goal = self.pose_goal or self.goal
        if self.first_blocked(path, used) < used or not goal.reached_by(path.poses[used - 1]):
            return False
        cost = self.sweep(path, used, self.jam_cost)
        if cost is None:
            return False
        self.keep(path, used, cost)
        return True

    def _along(self, arcs: FloatArray, spare: int = 1) -> tuple[SweptPath, int]:
        return self.laid_out(np.concatenate([self.lead.pieces, arcs]), spare=spare)

    def first_blocked(self, path: SweptPath, count: int, known: int = 0) -> int:
        """The first of ``count`` poses where the robot touches a wall, none of those known does."""
        checker = core.CollisionChecker(self.room.footprint, self.room.walls)
        return known + checker.first_blocked(path.poses[known:count])

    def ended(self, path: SweptPath, count: int) -> tuple[SweptPath, int] | None:
        """A path of ``count`` poses whose end has the heading of the goal, if that asks for one.

        Returns:
            The path, not swept where its end is another one, and the number of its poses; None
            where there is no such end.
        """
        if self.pose_goal is None:
            return path, count
        end = path_end(
            self.world.robot,
            self.pose_goal,
            path.poses[:count],
            self.turning_radius,
            self.room.spacing,
            core.CollisionChecker(self.room.footprint, self.room.walls),
            self._straight,
        )
        if end is None:
            return None
        used = end.kept + len(end.poses)
        other = make_swept_path(3 * used + 200, len(self.world.movables))
        other.poses[:used] = np.concatenate([path.poses[: end.kept], end.poses])
        other.curvatures[:used] = np.concatenate([path.curvatures[: end.kept], end.curvatures])
        other.objects[0] = path.objects[0]
        return other, used

    def laid_out(
        self, arcs: FloatArray, start: FloatArray | None = None, *, spare: int = 1
    ) -> tuple[SweptPath, int]:
        """Lay poses along arcs (E, 2) from the robot, or from a pose, to the goal.

        Args:
            arcs: lengths [m] and curvatures [1/m].
            start: (3,) where they begin; at the robot if None.
            spare: times as many poses as there is room for.

        Returns:
            A path that is not swept, and the number of its poses.
        """
        steps = [abs(arc) / core.step_along(turn, self.room.spacing) for arc, turn in arcs.tolist()]
        capacity = spare * int(sum(steps) + len(arcs)) + 200
        path = make_swept_path(capacity, len(self.world.movables))
        begin = self.world.robot_pose if start is None else start
        used = core.lay_out(begin, arcs, path.view(), self.problem)
        assert used > 0  # there is room for all
        path.objects[0] = self.world.movables.poses
        return path, used

    def sweep(
        self, path: SweptPath, count: int, limit: float = np.inf, known: int = 1
    ) -> float | None:
        """Sweep the objects along a path.

        Sweeping through a crowd takes its time: there is no cost where the stop rule fires
        meanwhile.

        Args:
            path: of which ``count`` poses are in use.
            count: likewise.
            limit: cost that it must stay below [kg m].
            known: poses up to which the objects are known.

        Returns:
            Its cost [kg m]; None where it passes the limit.
        """
        cost = 0.0
        swept = known
        view = path.view()
        problem = self.problem
        for first, last in self._sweep_pace.pieces(count - known, self.stopped):
            swept = known + last
            cost = core.sweep_cost(
                view, known + first - 1, swept, limit, ENDLESS, problem, self.contacts
            )
            if not cost < limit:
                return None
        return cost if swept == count else None

    def work_out(self, candidate: Candidate) -> None:
        """Shortcut a path for as long as that pays and the stop rule allows."""
        while not self.stopped():
            before = candidate.cost
            self.shortcut(candidate)
            if candidate.cost > (1.0 - LEAST_GAIN) * before:
                return

    def work_out_best(self) -> None:
        """Shortcut the best path."""
        if self.best is None or self.stopped():
            return
        count = len(self.best.poses)
        spare = count + count // 5 + 200  # shortcuts seldom make a path longer
        path, trial = (make_swept_path(spare, len(self.world.movables)) for _ in "ab")
        for ours, best in zip(path, self.best, strict=True):
            ours[:count] = best
        self.work_out(Candidate(path, trial.view(), count, self.best_cost, is_best=True))

    def shortcut(self, candidate: Candidate) -> None:
        """Try `SHORTCUTS` shortcuts, as long as the stop rule allows."""
        view = candidate.path.view()
        problem = self.problem
        for _ in range(0, SHORTCUTS, self._batch):
            if self.stopped():
                return
            draws = self.rng.random((self._batch, 4))
            normals = self.rng.standard_normal((self._batch, 2))
            # between pieces only the clock counts: what else may fire has been looked at
            late = partial(self._call.check, self.iterations, self.plan_cost)
            for first, last in self._shortcut_pace.pieces(self._batch, late):
                candidate.count, candidate.cost = core.shortcut(
                    view,
                    candidate.count,
                    candidate.cost,
                    draws[first:last],
                    normals[first:last],
                    candidate.trial,
                    problem,
                    self.contacts,
                )
            self.keep(candidate.path, candidate.count, candidate.cost, copied=not candidate.is_best)
            self.iterations += self._batch

    def keep(self, path: SweptPath, count: int, cost: float, *, copied: bool = True) -> None:
        """Keep the first ``count`` poses of a swept path, or a copy, if it is the best so far."""
        if cost >= self.best_cost:
            return
        if np.isnan(self.first_solution_s) and cost < self.jam_cost:
            self.first_solution_s = self._call.elapsed
        self.best_cost = cost
        self.tight = self.relaxed > 1
        self.best = SweptPath(*(part[:count] for part in path))
        if copied:
            self.best = SweptPath(*(part.copy() for part in self.best))

    def falls_back(self) -> bool:
        """Take up the spare path where there is no plan; True if there is one then."""
        if self.spare is not None and self.spare.best is not None and not self.solved:
            self.best = self.spare.best
            self.best_cost = self.spare.best_cost
            self.first_solution_s = self.spare.first_solution_s
        return self.solved

    def result(self, status: PlanStatus, **detail: float) -> PlanResult:
        """The result of the call: the best path so far as a plan, where the status has one."""
        plan = None
        if status.has_plan:
            assert self.best is not None
            plan = timed_plan(self.world, self.best, self.config.turn_fraction)
        return self._call.result(
            status,
            plan,
            self.first_solution_s,
            self.iterations,
            self.nodes,
            tight=float(self.tight),
            **detail,
        )
