"""Lower bounds on the work of robot and objects."""

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze, scattered_boxes

from pushplan.geometry import VisibilityGraph
from pushplan.motion.work_bound import length_bound, transport_bound, work_bound
from pushplan.planners import MaxIterations, make_planner
from pushplan.world import ClearanceArea, GoalDisc, Movables, Receptacle, StaticMap, World


def corridor(width: float, boxes: object, goal: object = None) -> World:
    """A straight corridor along x, with the robot at its left end."""
    half = 0.5 * width
    walls = [[-2.0, half, 14.0, half], [-2.0, -half, 14.0, -half]]
    return World(
        robot=make_robot(),
        robot_pose=[0.0, 0.0, 0.0],
        static=StaticMap.build(segments=walls, radii=0.05, bounds=[-2, -half, 14, half]),
        movables=make_boxes(boxes),
        goal=goal or GoalDisc([12.0, 0.0], 0.5),
    )


@pytest.mark.parametrize("seed", range(3))
def test_no_plan_costs_less(seed):
    world = make_u_maze(scattered_boxes(8, seed))
    bound = work_bound(world, most_nodes=100)
    assert length_bound(world) <= bound.work <= bound.relaxed * (1.0 + 1e-9)
    plan = (
        make_planner("push-aware", push_weight=1.0)
        .plan(world, stop=MaxIterations(3000), rng=np.random.default_rng(seed))
        .plan
    )
    assert bound.work <= plan.travel_cost + plan.interaction_cost


def test_it_knows_what_has_to_make_way():
    """A box in the middle of a corridor in which the robot cannot pass it untouched."""
    world = corridor(2.8, [[6.0, 0.0, 0.0]])
    robot, box = world.robot, world.movables
    aside = 1.4 - 0.05 - robot.inscribed_radius  # how far off the axis the robot's middle gets
    depth = robot.inscribed_radius + 0.5 * box.radii[0] * np.sqrt(2.0) - aside
    assert 0.0 < depth < 0.5 * box.radii[0] * np.sqrt(2.0) + 1e-9
    found = work_bound(world)
    least = length_bound(world) + box.masses[0] * depth
    assert found.work >= 0.99 * least - 0.01
    assert found.work >= 0.99 * found.relaxed
    wide = work_bound(corridor(8.0, [[6.0, 0.0, 0.0]])).work
    assert length_bound(world) < wide < found.work  # it drives around


def test_without_objects_it_is_the_length():
    world = make_u_maze()
    assert work_bound(world).work == length_bound(world)
    nowhere = world.moved(robot_pose=world.robot_pose)
    walls = [[0, 11, 15, 11]]
    shut = World(
        robot=world.robot,
        robot_pose=world.robot_pose,
        static=StaticMap.build(
            segments=[[7.5, 0, 7.5, 15], *walls], radii=0.2, bounds=[0, 0, 15, 15]
        ),
        movables=world.movables,
        goal=world.goal,
    )
    assert work_bound(nowhere).nodes == 1
    assert work_bound(shut).work <= length_bound(world)


def test_every_object_has_its_way():
    box = [[3.0, 0.0, 0.0], [5.0, 0.5, 0.3]]
    goal = Receptacle([[10.0, -1.0], [12.0, -1.0], [12.0, 1.0], [10.0, 1.0]])
    world = corridor(6.0, box, goal)
    masses = world.movables.masses
    paths = [7.0, 5.0]
    assert transport_bound(world) >= float(masses @ paths)
    near = 3.0 - world.movables.radii[0] - world.robot.circumscribed_radius
    inner = 0.5 * world.movables.radii[0] * np.sqrt(2.0)
    assert transport_bound(world) == pytest.approx(
        float(masses @ (np.array(paths) + inner)) + world.robot.mass * near, rel=2e-3
    )
    done = corridor(6.0, [[11.0, 0.0, 0.0]], goal)
    assert transport_bound(done) == 0.0
    area = ClearanceArea([[2.0, -1.0], [6.0, -1.0], [6.0, 1.0], [2.0, 1.0]], [True] * 4)
    assert transport_bound(corridor(6.0, box, area)) > 0.0
    assert VisibilityGraph(world.static).to_goal([3.0, 0.0], goal).length == pytest.approx(7.0)


def test_the_robot_may_push_an_object_that_is_done_against_the_others():
    """It drives 2.5 m to a light object, and with that the other one off, which takes 1.4 m."""
    shapes = [
        [[-3.0, -0.595], [3.0, -0.595], [3.0, 0.595], [-3.0, 0.595]],
        [[-0.5, -0.65], [0.5, -0.65], [0.5, 0.65], [-0.5, 0.65]],
    ]
    world = World(
        robot=make_robot(),
        robot_pose=[-4.0, 0.605, 0.0],
        static=StaticMap.build([], bounds=[-6, -6, 20, 6]),
        movables=Movables.from_outlines(
            shapes, [[0.0, 0.605, 0.0], [5.6, 0.6, 0.0]], masses=[1e-3, 1.0]
        ),
        goal=ClearanceArea([[3.2, -3], [6.5, -3], [6.5, 0], [3.2, 0]], [True] * 4),
    )
    pushed = 6.5 + 0.5 - 5.6 + 1e-3
    led = 5.6 - 0.5 - 3.0 + pushed  # of the object that is done
    driven = 4.0 - 3.0 - float(world.robot.vertices[:, 0].max()) + led
    after = world.moved(movable_poses=[[led, 0.605, 0.0], [5.6 + pushed, 0.6, 0.0]])
    assert world.completed.tolist() == [True, False] and after.completed.all()
    cost = world.robot.mass * driven + float(world.movables.masses @ [led, pushed])
    assert transport_bound(world) <= cost


def test_an_object_is_delivered_as_drawn():
    square = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    world = World(
        robot=make_robot(),
        robot_pose=[3.0, 0.0, 0.0],
        static=StaticMap.build([], bounds=[-5, -5, 25, 5]),
        movables=Movables.from_outlines(
            [square], [[5.0, 0.0, 0.0]], masses=[1e3], contact_radii=0.3
        ),
        goal=Receptacle([[7, -3], [12, -3], [12, 3], [7, 3]]),
    )
    assert world.moved(movable_poses=[[7.501, 0.0, 0.0]]).completed.all()
    assert transport_bound(world) <= 1e3 * 2.501 + world.robot.mass * (2.0 + 2.501)


def test_fixed_objects_are_static():
    """A box that closes all but one side of the corridor makes the way longer by itself."""
    world = corridor(8.0, [[6.0, 0.0, 0.0]])
    shapes = [[[-0.5, -2.0], [0.5, -2.0], [0.5, 2.0], [-0.5, 2.0]]]
    plate = Movables.from_outlines(shapes, [[6.0, 0.0, 0.0]], fixed=[True])
    held = World(world.robot, world.robot_pose, world.static, plate, world.goal)
    assert work_bound(held).work == pytest.approx(length_bound(held.with_fixed_as_static()))
    assert work_bound(held).work > 1.05 * length_bound(held)
    goal = Receptacle([[10.0, -1.0], [12.0, -1.0], [12.0, 1.0], [10.0, 1.0]])
    none_left = World(world.robot, world.robot_pose, world.static, plate, goal)
    assert transport_bound(none_left) == 0.0


def test_a_start_in_a_wall_proves_no_way_out_of_it():
    wall = [[0.0, -3.0], [0.3, -3.0], [0.3, 0.5], [0.0, 0.5]]
    world = World(
        robot=make_robot(),
        robot_pose=[-0.05, 0.0, 1.5],
        static=StaticMap.build([wall], bounds=[-5, -5, 25, 5]),
        movables=make_boxes([[8.0, 3.0, 0.0]]),
        goal=GoalDisc([3.0, 0.0], 0.3),
    )
    assert work_bound(world).work == length_bound(world)


def test_few_paths_prove_what_can_be_proven_of_one_object():
    world = corridor(10.0, [[6.0, 0.0, 0.0]])
    found, deeper = work_bound(world), work_bound(world, most_nodes=2000)
    assert found.nodes < 30 and found == deeper
