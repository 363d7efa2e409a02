"""The ship lattice planner."""

import numpy as np
import pytest
from conftest import solved_by
from shapely import Polygon
from shapely.ops import unary_union

from pushplan.planners import make_planner, make_policy
from pushplan.planners.ship_lattice import ShipLattice, ShipLatticeConfig
from pushplan.world import (
    ClearanceArea,
    Deadline,
    Drive,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    MaxIterations,
    Movables,
    PlanStatus,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.outline import transform

HULL = [[1, 0], [0.9, 0.1], [0.5, 0.25], [-1, 0.25], [-1, -0.25], [0.5, -0.25], [0.9, -0.1]]
QUICK = ShipLatticeConfig(shortcuts=10)
NAMES = ("ship-lattice", "ship-lattice-quick", "ship-lattice-published", "skeleton")


GOLDEN = [
    (7, 8.826639),
    (7, 8.859435),
    (6, 8.833066),
    (104, 8.435062),
    (33, 8.171805),
    (33, 8.154629),
]


def ship_world(seed: int = 0, floes: int = 60, scale: float = 1.0, **changes: object) -> World:
    rng = np.random.default_rng(seed)
    centres = rng.uniform([0.3, 2.6], [11.7, 12.0], (floes, 2))
    keep: list[np.ndarray] = []
    for centre in centres:
        if all(np.hypot(*(centre - other)) > 0.75 for other in keep):
            keep.append(centre)
    outlines = []
    for centre in keep:
        angles = np.sort(rng.uniform(0, 2 * np.pi, 3)) * 0.3 + np.array([0.0, 2.1, 4.2])
        radius = rng.uniform(0.05, 0.37)
        outlines.append(
            scale * (centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))
        )
    robot = RobotModel.from_outline(
        scale * np.array(HULL),
        mass=scale**3,
        drive=Drive.CONSTANT_SPEED,
        max_speed=0.3 * scale,
        max_turn_rate=0.224,
    )
    fields: dict[str, object] = {
        "robot": robot,
        "robot_pose": np.array([rng.uniform(1, 11) * scale, scale, np.pi / 2]),
        "static": StaticMap.build(bounds=scale * np.array([0.0, 0.0, 12.0, 40.0])),
        "movables": Movables.from_polygons(outlines, density=scale),
        "goal": GoalLine(scale * np.array([6.0, 9.0]), np.array([0.0, 1.0])),
    }
    fields.update(changes)
    return World(**fields)  # type: ignore[arg-type]


def assert_drivable(world: World, plan) -> None:  # type: ignore[no-untyped-def]
    bounds, robot = world.static.bounds, world.robot
    slack = 1e-5 * robot.circumscribed_radius
    assert (plan.poses[:, :2] >= bounds[:2] - slack).all()
    assert (plan.poses[:, :2] <= bounds[2:] + slack).all()
    assert plan.poses[0] == pytest.approx(world.robot_pose)
    assert (np.abs(plan.turn_rates) <= robot.max_turn_rate * (1 + 1e-9)).all()
    steps = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
    turns = np.abs(np.diff(plan.poses[:, 2]))
    # an arc is a little longer than its chord
    assert (turns <= steps * (1 + 1e-2) / robot.turning_radius + 1e-6).all()
    assert world.navigation_goal.contains(plan.poses[-1:, :2] + slack).all()


NO_PLAN = (PlanStatus.START_BLOCKED, PlanStatus.GOAL_UNREACHABLE, PlanStatus.TIMED_OUT)


def check_random_world(seed: int, planner: ShipLattice) -> None:
    """A random channel, ship and crowd: a plan can be driven, or it is said why there is none."""
    rng = np.random.default_rng(seed + 1000)
    scale = float(rng.choice([0.05, 1.0, 38.0]))
    world = ship_world(seed, floes=int(rng.integers(0, 150)), scale=scale)
    world = world.moved(robot_pose=world.robot_pose + np.array([0.0, 0.0, rng.normal(0.0, 0.8)]))
    result = planner.plan(world, stop=MaxIterations(60))
    if result.status is PlanStatus.SOLVED:
        assert result.plan is not None
        assert_drivable(world, result.plan)
    else:  # only near a side, heading out of the channel: there may be no room to turn
        assert result.status in NO_PLAN
        assert result.plan is None
        assert abs(world.robot_pose[2] - np.pi / 2) > 0.3


@pytest.mark.parametrize("seed", range(10))
def test_random_worlds(seed: int) -> None:
    check_random_world(seed, ShipLattice(QUICK))


@pytest.mark.parametrize("name", ["quick", "published"])
@pytest.mark.slow
def test_hundreds_of_random_worlds(name: str) -> None:
    planner = ShipLattice(getattr(ShipLatticeConfig, name)())
    for seed in range(120):
        check_random_world(seed, planner)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quick", "published"])
def test_a_thousand_random_worlds(name: str) -> None:
    planner = ShipLattice(getattr(ShipLatticeConfig, name)())
    for seed in range(1000, 2000):
        check_random_world(seed, planner)


def post_world(seed: int) -> World:
    """A random hall with posts and boxes, and a small goal."""
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(1.5, 18.5, (2, 2))
    far = [
        spot
        for spot in rng.uniform(1.0, 19.0, (int(rng.integers(0, 14)), 2))
        if min(np.hypot(*(spot - start)), np.hypot(*(spot - goal))) > 1.2
    ]
    square = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    posts = [spot + rng.uniform(0.1, 0.8) * square for spot in far[::2]]
    boxes = [spot + 0.5 * square for spot in far[1::2]]
    static = StaticMap.build(polygons=posts, bounds=[0.0, 0.0, 20.0, 20.0])
    robot = RobotModel.from_outline(
        0.35 * square, mass=1.0, drive="differential", max_speed=0.5, max_turn_rate=1.0
    )
    movables = Movables.from_polygons(boxes) if boxes else Movables.empty()
    pose = np.array([*start, rng.uniform(-3.0, 3.0)])
    return World(robot, pose, static, movables, GoalDisc(goal, rng.uniform(0.05, 1.0)))


def test_goal_discs_in_random_halls() -> None:
    planner = ShipLattice(ShipLatticeConfig.quick())
    solved = 0
    for seed in range(15):
        world = post_world(seed)
        result = planner.plan(world)
        if result.plan is None:
            continue
        solved += 1
        end = result.plan.poses[-1, :2]
        assert world.goal.distance(*end) <= 1e-6  # type: ignore[union-attr]
        walls = unary_union([Polygon(part) for part in world.static.convex_parts])
        for pose in result.plan.poses:
            outline = Polygon(transform(pose, world.robot.parts[0]))
            assert outline.intersection(walls).area < 1e-9
    assert solved >= 14  # a start with its bow at a post


def test_golden_open_water() -> None:
    world = ship_world(0, floes=0, robot_pose=np.array([6.0, 1.0, np.pi / 2]))
    result = ShipLattice(ShipLatticeConfig.published()).plan(world)
    assert result.plan is not None
    assert result.plan.length == pytest.approx(8.0 + 0.02 * world.robot.circumscribed_radius)
    assert result.stats.nodes == 33
    assert np.abs(result.plan.turn_rates).max() == 0.0


def test_it_goes_around_a_floe() -> None:
    square = 0.4 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    floe = Movables.from_polygons([square + np.array([6.1, 5.0])])
    world = ship_world(0, movables=floe, robot_pose=np.array([6.0, 1.0, np.pi / 2]))
    result = ShipLattice().plan(world)
    assert result.plan is not None
    assert result.plan.interaction_cost < 0.01
    assert result.plan.length < 8.6


def test_same_seed_same_plan() -> None:
    world = ship_world(5)
    plans = [ShipLattice(QUICK).plan(world, rng=np.random.default_rng(3)).plan for _ in range(2)]
    assert plans[0] == plans[1]


def test_size_does_not_matter() -> None:
    small, large = ship_world(2), ship_world(2, scale=38.0)
    paths = []
    for world, scale in ((small, 1.0), (large, 38.0)):
        plan = ShipLattice(ShipLatticeConfig.published()).plan(world).plan
        assert plan is not None
        paths.append(plan.poses[:, :2] / scale)
    assert paths[0] == pytest.approx(paths[1], abs=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_hostile_worlds(name: str) -> None:
    planner = make_planner(name)
    stop = MaxIterations(40)
    outside = ship_world(0, robot_pose=np.array([-1.0, 1.0, 1.6]))
    assert planner.plan(outside, stop=stop).status is PlanStatus.START_BLOCKED
    walls = [np.array([[0.0, 5.0], [12.0, 5.0], [12.0, 5.5], [0.0, 5.5]])]
    static = StaticMap.build(polygons=walls, bounds=[0.0, 0.0, 12.0, 40.0])
    blocked = planner.plan(ship_world(0, static=static), stop=stop)
    assert blocked.plan is None
    there = planner.plan(ship_world(0, robot_pose=np.array([6.0, 9.5, 1.6])), stop=stop)
    assert there.status is PlanStatus.SOLVED
    away = planner.plan(ship_world(0, robot_pose=np.array([6.0, 8.0, -np.pi / 2])), stop=stop)
    assert away.status.has_plan or away.status is PlanStatus.TIMED_OUT
    sliver = Movables.from_polygons([[[6.0, 5.0], [6.5, 5.0], [6.5, 5.0001]]])
    assert planner.plan(ship_world(0, movables=sliver), stop=stop).status is PlanStatus.SOLVED
    area = ClearanceArea([[0, 0], [1, 0], [1, 1], [0, 1]], np.ones(4, dtype=bool))
    with pytest.raises(InvalidInputError):
        planner.plan(ship_world(0, goal=area), stop=stop)


@pytest.mark.parametrize("name", NAMES)
def test_crowds_of_every_kind(name: str) -> None:
    planner, stop = make_planner(name), MaxIterations(40)
    ends = solved_by(name)
    square = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    barrier = [square + np.array([x, 5.0]) for x in np.arange(0.5, 12.0, 1.0)]
    through = planner.plan(ship_world(0, movables=Movables.from_polygons(barrier)), stop=stop)
    assert through.status in ends  # floes may be pushed
    crowd = ship_world(3, floes=700)
    assert len(crowd.movables) > 80
    assert planner.plan(crowd, stop=stop).status in ends
    small = [0.2 * square + spot for spot in np.random.default_rng(0).uniform(0.5, 11.5, (300, 2))]
    heap = ship_world(3, movables=Movables.from_polygons(small))  # they overlap one another
    assert planner.plan(heap, stop=stop).status in ends
    on_top = ship_world(3, movables=Movables.from_polygons([square + heap.robot_pose[:2]]))
    assert planner.plan(on_top, stop=stop).status in ends  # starts in a floe
    assert planner.plan(ship_world(3, floes=0), stop=stop).status in ends


def test_water_without_end() -> None:
    planner = ShipLattice(QUICK)
    result = planner.plan(
        ship_world(0, static=StaticMap.build(bounds=[-1e6, -1e6, 1e6, 1e6])), stop=MaxIterations(60)
    )
    assert result.status is PlanStatus.SOLVED and result.plan is not None


def test_golden_searches() -> None:
    """Nodes and costs of fixed fields: a change means that the search has changed."""
    found = []
    for config in (ShipLatticeConfig.quick(), ShipLatticeConfig.published()):
        for seed in (1, 2, 3):
            stats = ShipLattice(config).plan(ship_world(seed, floes=500)).stats
            found.append((stats.nodes, stats.detail["lattice_cost"]))
    for (nodes, cost), (golden_nodes, golden_cost) in zip(found, GOLDEN, strict=True):
        assert nodes == golden_nodes
        assert cost == pytest.approx(golden_cost, rel=1e-6)


def test_goal_disc_among_walls() -> None:
    walls = [np.array([[3.0, 5.0], [12.0, 5.0], [12.0, 5.5], [3.0, 5.5]])]
    static = StaticMap.build(polygons=walls, bounds=[0.0, 0.0, 12.0, 12.0])
    world = ship_world(
        0,
        floes=0,
        static=static,
        robot_pose=np.array([6.0, 1.5, np.pi / 2]),
        goal=GoalDisc([6.0, 10.0], 1.0),
    )
    result = ShipLattice().plan(world)
    assert result.status is PlanStatus.SOLVED and result.plan is not None
    assert result.plan.poses[:, 0].min() < 3.0


def test_far_goal_is_approached() -> None:
    config = ShipLatticeConfig(horizon=4.0, shortcuts=0)
    result = ShipLattice(config).plan(ship_world(0))
    assert result.status is PlanStatus.APPROXIMATE and result.plan is not None
    assert 3.9 < result.plan.length < 5.0


@pytest.mark.usefixtures("cpu_time")
def test_deadline_is_kept() -> None:
    planner, world = ShipLattice(), ship_world(1, floes=400)
    planner.plan(world)
    late = [planner.plan(world, stop=Deadline(0.03)).stats.wall_time_s for _ in range(10)]
    assert min(late) < 0.06


@pytest.mark.parametrize(
    "changes",
    [
        {"floe_cost": "gold"},
        {"headings": 9},
        {"horizon": 0.0},
        {"searches": (-1.0,)},
        {"searches": ()},
        {"heuristic": "none"},
    ],
)
def test_config_is_checked(changes: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError):
        ShipLatticeConfig(**changes)  # type: ignore[arg-type]


def test_policy_drives() -> None:
    world = ship_world(0, floes=10)
    for name in NAMES:
        policy = make_policy(name)
        policy.reset(world, np.random.default_rng(0))
        twist = policy.act(world, None)
        assert abs(twist.angular) <= world.robot.max_turn_rate + 1e-12
