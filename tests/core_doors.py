"""Public functions and classes that lead into the core, with arguments that they accept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from conftest import make_boxes, make_robot, make_u_maze

from pushplan import control, geometry, interaction, observation
from pushplan.gtsp import solve_gtsp
from pushplan.motion.polyline_plan import polyline_plan
from pushplan.world import (
    ClearanceArea,
    GoalDisc,
    GoalLine,
    MaxIterations,
    Movables,
    Receptacle,
    RobotModel,
    StaticMap,
    World,
)

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
PATH = np.array([[1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [2.0, 1.0, 0.0]])


@dataclass(frozen=True)
class Door:
    """A callable with valid arguments by name."""

    call: Callable[..., Any]
    valid: dict[str, Any]


def _maze() -> World:
    return make_u_maze()


def _static() -> StaticMap:
    return StaticMap.build(
        bounds=[0.0, 0.0, 6.0, 6.0], segments=[[0.0, 3.0, 4.0, 3.0]], radii=[0.1]
    )


def _follow(make: Callable[[], Any]) -> Callable[..., Any]:
    """A controller of its own for each call."""

    def command(world: Any, plan: Any) -> Any:
        controller = make()
        controller.reset(world)
        return controller.command(world, plan)

    return command


def make_doors() -> dict[str, Door]:
    world = _maze()
    static = _static()
    grid = geometry.Grid.cover(static.bounds, 0.5)
    goal = GoalDisc([5.0, 5.0], 0.5)
    field = geometry.geodesic_field(static, goal, resolution=0.5)
    plan = polyline_plan(world, np.array([world.robot_pose[:2], world.goal.center]), 0.1)
    flat = np.vstack([SQUARE, SQUARE + 3.0])
    robot = make_robot()
    doors = {
        "convex_overlap": Door(geometry.convex_overlap, {"a": SQUARE, "b": SQUARE}),
        "convex_distance": Door(geometry.convex_distance, {"a": SQUARE, "b": SQUARE}),
        "convex_penetration": Door(geometry.convex_penetration, {"a": SQUARE, "b": SQUARE}),
        "polygon_area": Door(geometry.polygon_area, {"v": SQUARE}),
        "polygon_centroid": Door(geometry.polygon_centroid, {"v": SQUARE}),
        "polygon_inertia": Door(geometry.polygon_inertia, {"v": SQUARE}),
        "core_distance": Door(
            geometry.core_distance, {"x": 0.5, "y": 0.5, "vertices": flat, "first": 0, "last": 4}
        ),
        "fill_convex": Door(
            geometry.fill_convex, {"image": np.zeros((5, 5)), "vertices_px": SQUARE, "value": 1.0}
        ),
        "transform_points": Door(
            geometry.transform_points,
            {"pose": np.zeros(3), "points_body": SQUARE, "out": np.zeros((4, 2))},
        ),
        "transform_outlines": Door(
            geometry.transform_outlines,
            {
                "poses": np.zeros((2, 3)),
                "vertices": flat,
                "offsets": np.array([0, 4, 8]),
                "out": np.zeros((8, 2)),
            },
        ),
        "sample_values": Door(
            geometry.sample_values,
            {"values": np.ones((3, 3)), "ox": 0.0, "oy": 0.0, "step": 1.0, "x": 0.5, "y": 0.5},
        ),
        "Grid": Door(geometry.Grid, {"origin": [0.0, 0.0], "resolution": 0.5, "shape": (3, 3)}),
        "Grid.cover": Door(
            geometry.Grid.cover, {"bounds": [0.0, 0.0, 2.0, 2.0], "resolution": 1.0}
        ),
        "clearance_field": Door(geometry.clearance_field, {"static": static, "grid": grid}),
        "occupancy": Door(geometry.occupancy, {"static": static, "grid": grid, "clearance": 0.2}),
        "geodesic_field": Door(
            geometry.geodesic_field,
            {
                "static": static,
                "goal": goal,
                "resolution": 0.5,
                "clearance": 0.1,
                "bounds": [0.0, 0.0, 5.0, 5.0],
                "to_center": False,
            },
        ),
        "GeodesicField.sample": Door(field.sample, {"x": 1.0, "y": 1.0}),
        "GeodesicField.exact": Door(field.exact, {"x": 1.0, "y": 1.0}),
        "goal_distances": Door(
            geometry.goal_distances,
            {"static": static, "goal": [SQUARE], "clearance": 0.1, "to_center": True},
        ),
        "path_from": Door(field.source.path_from, {"start": [1.0, 1.0]}),
        "VisibilityGraph": Door(
            lambda static, clearance: geometry.VisibilityGraph(static, clearance).shortest_path(
                [1.0, 1.0], [5.0, 5.0]
            ),
            {"static": static, "clearance": 0.1},
        ),
        "shortest_path": Door(
            geometry.VisibilityGraph(static, 0.1).shortest_path,
            {"start": [1.0, 1.0], "goal": [5.0, 5.0]},
        ),
        "to_goal": Door(
            geometry.VisibilityGraph(static, 0.1).to_goal, {"start": [1.0, 1.0], "goal": goal}
        ),
        "QuasiStatic": Door(
            interaction.QuasiStatic,
            {"friction": 0.1, "gyration_scale": 1.0, "step": 0.1, "iterations": 5},
        ),
        "QuasiStatic.sweep": Door(interaction.QuasiStatic().sweep, {"world": world, "path": PATH}),
        "clamp_twist": Door(control.clamp_twist, {"robot": robot, "linear": 0.5, "angular": 0.5}),
        "waiting_twist": Door(control.waiting_twist, {"world": world}),
        "PathFollower": Door(_follow(control.PathFollower), {"world": world, "plan": plan}),
        "PurePursuit": Door(_follow(control.PurePursuit), {"world": world, "plan": plan}),
        "MpcTracker": Door(_follow(control.MpcTracker), {"world": world, "plan": plan}),
        "PoseFollower": Door(
            control.PoseFollower, {"robot": robot, "poses": PATH, "response": 0.2}
        ),
        "Recovery": Door(control.Recovery, {"world": world, "distance": 0.5}),
        "TwistLimiter": Door(control.TwistLimiter, {"robot": robot, "jerk_time": 0.1}),
        "ImageObservation": Door(observation.ImageObservation().observe, {"world": world}),
        "StateObservation": Door(observation.StateObservation().observe, {"world": world}),
        "solve_gtsp": Door(
            lambda costs, clusters: solve_gtsp(costs, clusters, stop=MaxIterations(20)),
            {"costs": np.ones((4, 4)), "clusters": [[0, 1], [2, 3]]},
        ),
        "RobotModel": Door(
            lambda outline, mass: World(
                robot=RobotModel.from_outline(
                    outline, mass=mass, drive="differential", max_speed=1.0, max_turn_rate=1.0
                ),
                robot_pose=[1.0, 1.0, 0.0],
                static=static,
                movables=make_boxes([]),
                goal=goal,
            ),
            {"outline": SQUARE - 0.5, "mass": 1.0},
        ),
        "StaticMap": Door(
            lambda bounds, segments, radii, polygons: geometry.geodesic_field(
                StaticMap.build(bounds=bounds, segments=segments, radii=radii, polygons=polygons),
                goal,
                resolution=0.5,
            ),
            {
                "bounds": [0.0, 0.0, 6.0, 6.0],
                "segments": [[0.0, 3.0, 4.0, 3.0]],
                "radii": [0.1],
                "polygons": [SQUARE + 1.0],
            },
        ),
        "Movables": Door(
            lambda outlines, poses: interaction.QuasiStatic().sweep(
                World(
                    robot=robot,
                    robot_pose=[1.0, 1.0, 0.0],
                    static=static,
                    movables=Movables.from_outlines(outlines, poses),
                    goal=goal,
                ),
                PATH,
            ),
            {"outlines": [SQUARE - 0.5], "poses": [[2.5, 1.0, 0.0]]},
        ),
    }
    goals = {
        "GoalDisc": (GoalDisc, {"center": [4.0, 4.0], "radius": 0.5}),
        "GoalLine": (GoalLine, {"point": [0.0, 4.0], "normal": [0.0, 1.0]}),
        "Receptacle": (Receptacle, {"polygon": SQUARE + 4.0}),
        "ClearanceArea": (ClearanceArea, {"polygon": SQUARE + 4.0, "open_edges": np.ones(4, bool)}),
    }
    for name, (kind, valid) in goals.items():
        doors[name] = Door(_to_goal(kind, static), valid)
    return doors


def _to_goal(kind: Any, static: StaticMap) -> Callable[..., Any]:
    return lambda **fields: geometry.goal_distances(static, kind(**fields)).path_from([1.0, 1.0])


def wrong_values(right: Any) -> Iterator[Any]:
    """Yield values that are wrong for an argument, or strange and right."""
    yield from (None, "text", object(), 7, -1, 0.0, True, np.nan, np.inf, -np.inf, 1e300, 10**30)
    yield from ([], {}, (), [[]], [[], [1.0]], "nan", b"1", [None], 1j, np.array("2020", "M8[D]"))
    if isinstance(right, (list, tuple, np.ndarray)):
        yield from wrong_arrays(right)
    if isinstance(right, list) and len(right) == 1 and isinstance(right[0], np.ndarray):
        for polygon in degenerate_polygons():
            yield [polygon]


def wrong_arrays(right: Any) -> Iterator[Any]:
    good = np.array(right, dtype=object if np.asarray(right).dtype == object else None)
    yield good[:-1]
    yield good[::-1]
    yield good[None]
    yield np.concatenate([good, good])
    yield good.astype(str)
    yield good.astype(object)
    if good.dtype.kind not in "fi":
        return
    yield good.astype(np.float16)
    yield good.astype(np.int8)
    yield good > 0
    yield good + 1j
    yield good[..., :-1]
    for number in (np.nan, np.inf, -np.inf, 1e300, -1.0, 0.0):
        yield np.full(good.shape, number)
        one = good.astype(float)
        one.flat[-1] = number
        yield one
    if good.shape[-1:] == (2,) and good.ndim == 2:
        yield from degenerate_polygons()


def degenerate_polygons() -> Iterator[np.ndarray]:
    """Yield polygons without area, self-intersecting, not convex, tiny, and of too few corners."""
    yield SQUARE[:1]
    yield SQUARE[:2]
    yield SQUARE[[0, 0, 0, 0]]
    yield SQUARE * [1.0, 0.0]
    yield SQUARE[[0, 2, 1, 3]]
    yield np.vstack([SQUARE, [[0.5, 0.5]]])
    yield np.repeat(SQUARE, 2, axis=0)
    yield 1e-9 * SQUARE
    yield 1e-200 * SQUARE
    yield 1e12 * SQUARE
    yield SQUARE * [1.0, 1e-12]
