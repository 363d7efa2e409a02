"""Planning calls of the core: worlds as it takes them, and its plans."""

from __future__ import annotations

import functools
import math
from dataclasses import fields
from typing import Literal

import numpy as np

from pushplan.core import navigation as core
from pushplan.geometry import gyration_squares
from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.interaction.compiled_model import SweptModel, compile_interaction
from pushplan.motion.path_search_config import PathSearchConfig
from pushplan.world import GoalDisc, GoalPose, Plan, PlanResult, PlanStatus, RobotModel, World
from pushplan.world.checks import FloatArray
from pushplan.world.planning_call import PlanningCall
from pushplan.world.static_map import core_map

_STATUSES = {
    core.PlanStatus.SOLVED: PlanStatus.SOLVED,
    core.PlanStatus.PATH_ONLY: PlanStatus.PATH_ONLY,
    core.PlanStatus.START_BLOCKED: PlanStatus.START_BLOCKED,
    core.PlanStatus.GOAL_UNREACHABLE: PlanStatus.GOAL_UNREACHABLE,
}


def plan_path(
    call: PlanningCall,
    config: PathSearchConfig,
    interaction: InteractionModel,
    search: Literal["shortest_path", "kinodynamic", "push_aware"],
) -> PlanResult:
    """Plan until the stop rule fires, which is asked after every piece of work."""
    model = None
    options = _options(call, config, search)
    if type(interaction) is QuasiStatic:
        values = {one.name: getattr(interaction, one.name) for one in fields(interaction)}
        options.set_contact(**values)
        planner = core.PathPlanner(core_world(call.world), options)
    else:
        model = compile_interaction(interaction, call.world)
        planner = core.PathPlanner(core_world(call.world), options, model)
    first = math.nan
    while True:
        planner.run()
        if isinstance(model, SweptModel):
            model.raise_error()
        if math.isnan(first) and planner.cost < math.inf:
            first = call.elapsed
        if planner.done or call.check(planner.iterations, planner.cost):
            return _result(call, planner, first)


def _options(call: PlanningCall, config: PathSearchConfig, search: str) -> core.PlannerOptions:
    options = core.PlannerOptions()
    options.search = core.SearchKind[search]
    options.seed = call.seed
    for one in fields(config):
        if one.name != "default_iterations":
            setattr(options, one.name, float(getattr(config, one.name)))
    return options


def _result(call: PlanningCall, planner: core.PathPlanner, first: float) -> PlanResult:
    counts = planner.counts
    names = ("trees", "searches", "expansions", "tight")
    detail = {name: float(getattr(counts, name)) for name in names}
    detail["seed"] = float(call.seed)  # with it a C++ program makes the same plan
    plan = None
    best = planner.best()
    status = _STATUSES.get(best.status, call.stopped_status)
    if status.has_plan:
        plan = Plan(
            times=best.times,
            poses=best.poses,
            speeds=best.speeds,
            turn_rates=best.turn_rates,
            travel_cost=best.travel_cost,
            interaction_cost=best.interaction_cost,
            object_poses=best.objects.reshape(len(best.times), len(call.world.movables), 3),
        )
        if math.isnan(first):  # the drive that was set aside
            first = call.elapsed
        detail["cost"] = best.cost
        if planner.bound > 0.0 or best.cost == 0.0:
            detail["bound"] = planner.bound
            detail["gap"] = 0.0
            if best.cost > planner.bound:
                detail["gap"] = best.cost / planner.bound - 1.0
    return call.result(status, plan, first, counts.iterations, counts.nodes, **detail)


def core_world(world: World) -> core.World:
    """A world as the core takes it; nothing in it is held fixed (`World.for_planning`)."""
    assert world.robot_twist is not None
    goal = world.navigation_goal
    if isinstance(goal, GoalDisc):
        heading = (math.nan, 0.0)
        if isinstance(goal, GoalPose):
            heading = (goal.heading, goal.heading_tolerance)
        numbers = (0.0, *goal.center, goal.radius, 0.0, *heading)
    else:
        numbers = (1.0, *goal.point, *goal.normal, math.nan, 0.0)
    made = core.World(
        _core_robot(world.robot),
        world.robot_pose,
        world.robot_twist,
        core_map(world.static),
        np.array(numbers),
        world.margin,
    )
    objects = world.movables
    if len(objects):
        made.set_objects(
            objects.part_vertices,
            objects.part_offsets,
            objects.first_parts,
            objects.poses,
            objects.masses,
            gyration_squares(objects),
        )
    if world.price is not None:
        made.set_prices(world.price.prices, world.price.origin, world.price.resolution)
    return made


@functools.lru_cache(maxsize=16)
def _core_robot(robot: RobotModel) -> core.Robot:
    limits: FloatArray = np.array(
        [
            robot.mass,
            robot.max_speed,
            robot.min_speed,
            robot.max_turn_rate,
            robot.min_turning_radius,
            robot.max_acceleration,
            robot.max_turn_acceleration,
        ]
    )
    drive = core.Drive[robot.drive.value]
    return core.Robot(robot.vertices, robot.offsets, robot.wheel_parts, drive, limits)
