"""``pushplan plan``: plan in a world from a file. Loads no simulator."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import milliseconds, say, say_json, say_written
from pushplan.cli.output_files import check_figure, check_file

if TYPE_CHECKING:
    from pushplan.world import PlanResult, Stop, World

SCHEMA = "pushplan-plan/1"


def run(options: argparse.Namespace) -> int:
    """Plan, say what came of it, write files."""
    from pushplan.errors import describe
    from pushplan.evaluation import parse_planner
    from pushplan.world import (
        Deadline,
        MaxIterations,
        PlanResult,
        PushplanError,
        load_world,
        stream,
    )
    from pushplan.world.checks import expect
    from pushplan.world.units import check_length

    check_file(options.out)
    check_figure(options.render)
    check_file(options.plain)
    stop: Stop | None = None
    if options.deadline is not None:
        stop = Deadline(options.deadline)
    elif options.iterations is not None:
        stop = MaxIterations(options.iterations)
    world = load_world(options.world)
    if options.plain:
        from pushplan.motion.path_planner import core_world

        written = core_world(world.for_planning()).written()
        Path(options.plain).write_text(written, encoding="ascii")
    spec = parse_planner(options.planner)
    planner = spec.make_planner()
    try:
        made = planner.plan(world, stop=stop, rng=stream(options.seed, "policy"))
        result = expect("what the planner returns", made, PlanResult)
        objection = None if spec.is_ours else _objection(world, result)
    except (Exception, SystemExit) as error:
        if spec.is_ours:
            raise
        raise PushplanError(f"planner {spec.label!r} failed: {describe(error)}") from error
    if result.plan is not None:
        check_length(world, result.plan.length)
    data = _as_dict(options, spec.label, result)
    if options.out:
        Path(options.out).write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    if options.render:
        from pushplan.drawing import Panel, draw_figure, save_figure

        title = f"{spec.label}: {result.status.label}"
        figure = draw_figure(Panel(world, plan=result.plan))
        save_figure(options.render, figure, title=title)
    if options.json:
        say_json(data)
    else:
        _print(spec.label, result)
    say_written(options, options.out, options.plain, options.render)
    if objection is not None:
        raise PushplanError(f"planner {spec.label!r} says {result.status.label}, but {objection}")
    return 0 if result.plan is not None else 1


def _objection(world: World, result: PlanResult) -> str | None:
    """Reason why the plan of a user's planner is not solved as it says; None if it is."""
    from pushplan.motion.polyline_plan import blocked_pose
    from pushplan.planners.following.planning_call import check_plan
    from pushplan.world import PlanStatus

    plan = result.plan
    if plan is None:
        return None
    check_plan(plan, world)
    if result.status is not PlanStatus.SOLVED:
        return None
    if (blocked := blocked_pose(world, plan.poses)) is not None:
        x, y, _ = blocked.tolist()
        return f"at [{x:.6g}, {y:.6g}] the robot touches something static: that is path_only"
    if world.goal_kind == "robot" and not world.navigation_goal.reached_by(plan.poses[-1]):
        x, y, _ = plan.poses[-1].tolist()
        return f"the plan ends at [{x:.6g}, {y:.6g}], short of the goal: that is approximate"
    return None


def _print(name: str, result: PlanResult) -> None:
    stats = result.stats
    say(f"{name}: {result.status.label} in {milliseconds(stats.wall_time_s)}")
    say(f"  {result.status.remedy}")
    if result.plan is not None:
        plan = result.plan
        say(
            f"  length {plan.length:.2f} m, duration {plan.duration:.1f} s, {len(plan.times)} poses"
        )
        say(
            f"  cost {plan.cost:.2f} kg m: travel {plan.travel_cost:.2f}, "
            f"interaction {plan.interaction_cost:.2f}"
        )
    say(f"  {stats.iterations} iterations, {stats.nodes} nodes")


def _as_dict(options: argparse.Namespace, label: str, result: PlanResult) -> dict[str, Any]:
    stats = result.stats
    plan = result.plan
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "planner": label,
        "seed": options.seed,
        "status": result.status.label,
        "stats": {
            "wall_time_s": stats.wall_time_s,
            "iterations": stats.iterations,
            "nodes": stats.nodes,
        },
        "plan": None,
    }
    if not math.isnan(stats.first_solution_s):
        data["stats"]["first_solution_s"] = stats.first_solution_s
    if "seed" in stats.detail:
        data["stats"]["seed"] = int(stats.detail["seed"])
    if plan is not None:
        arrays = ("times", "poses", "speeds", "turn_rates")
        data["plan"] = {
            **{key: getattr(plan, key).tolist() for key in arrays},
            "travel_cost": plan.travel_cost,
            "interaction_cost": plan.interaction_cost,
        }
    return data
