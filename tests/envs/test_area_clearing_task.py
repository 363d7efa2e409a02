import numpy as np
import pytest
import shapely
from manipulation_checks import check_reach, check_start, shapes

from pushplan.envs import PushEnv
from pushplan.envs.tasks.area_clearing import LAYOUTS, PRESETS, AreaClearingTask, open_edges
from pushplan.scenarios.rearrangement import rectangle
from pushplan.world import ScenarioError, StaticMap, UnknownNameError, stream

OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in PRESETS if name != "benchmark"]
BY_DEFAULT = ["benchmark", *OTHERS]


def task(preset="benchmark", action="velocity", **variations):
    return AreaClearingTask(preset=preset, variations=variations, action=action)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("preset", BY_DEFAULT)
@pytest.mark.parametrize("seeds", [25, pytest.param(200, marks=pytest.mark.slow)])
def test_starts_are_valid(preset, layout, seeds):
    clearing = task(preset, layout=layout, random_start=True)
    area = shapely.Polygon(clearing.goal.polygon)
    xs = []
    for seed in range(seeds):
        world = clearing.start(stream(seed, "layout"))
        check_start(world, clearing.preset.box_spacing)
        assert all(area.contains(box) for box in shapes(world))
        assert not world.completed.any()
        x, y, theta = world.robot_pose
        assert y < clearing.goal.polygon[:, 1].min() + 2.0 * clearing.preset.start_margin
        assert theta == pytest.approx(np.pi / 2)
        xs.append(x)
        if seed % 40 == 0 and preset == "benchmark":
            check_reach(world, 2.0 * clearing.preset.field_resolution)
    span = np.ptp(clearing.goal.polygon[:, 0]) - 2.0 * clearing.preset.start_margin
    assert (0.8 if seeds < 200 else 0.9) * span < np.ptp(xs) <= span


def test_dimensions_of_the_layouts():
    for layout, outer, area in (
        ("clear", (8, 8), (5, 5)),
        ("clear_small", (6, 6), (4, 4)),
        ("walled_with_columns", (12, 12), (7.5, 8)),
    ):
        world = task(layout=layout).start(stream(0, "layout"))
        np.testing.assert_allclose(world.static.bounds, (-outer[0], -outer[1], *outer))
        np.testing.assert_allclose(world.goal.polygon.max(axis=0), area)
        small = task("testbed", layout=layout).start(stream(0, "layout"))
        np.testing.assert_allclose(small.static.bounds, 0.08 * world.static.bounds)
        np.testing.assert_allclose(small.goal.polygon, 0.08 * world.goal.polygon)
        assert np.ptp(small.static.bounds) < 2.845
    world = task().start(stream(0, "layout"))
    np.testing.assert_allclose(world.robot_pose, (0.0, -4.0, np.pi / 2))
    assert len(world.movables) == 10 and (world.movables.masses == 1.0).all()
    np.testing.assert_allclose(np.ptp(small.movables.outline(0), axis=0), 0.08)
    assert small.robot.mass == 1.07 and small.movables.masses[0] == 0.075


def test_edges_behind_which_no_box_fits_are_closed():
    assert task().goal.open_edges.tolist() == [True] * 4
    # bottom, right, top, left
    assert task(layout="walled").goal.open_edges.tolist() == [True, False, True, False]
    closed = task("testbed", layout="walled_with_columns").goal.open_edges
    assert closed.tolist() == [True, False, True, False]
    assert task(layout="walled", box_size=0.8).goal.open_edges.all()  # 0.9 m are left
    area = rectangle(-2.0, -2.0, 2.0, 2.0)
    bounds = (-4.0, -4.0, 4.0, 4.0)
    part = StaticMap.build(polygons=[rectangle(2.5, -2.0, 2.7, 0.5)], bounds=bounds)
    assert open_edges(part, area, 1.0).tolist() == [True] * 4  # half of the edge is free
    full = StaticMap.build(polygons=[rectangle(2.5, -2.0, 2.7, 2.0)], bounds=bounds)
    assert open_edges(full, area, 1.0).tolist() == [True, False, True, True]
    tight = StaticMap.build(polygons=[rectangle(3.0, 3.0, 3.5, 3.5)], bounds=(-2, -4, 4, 4))
    assert open_edges(tight, area, 1.0).tolist() == [True, True, True, False]
    with pytest.raises(ScenarioError, match="fit through no edge"):
        task(box_size=3.5)


def placed(world, rows):
    return world.moved(movable_poses=np.asarray(rows, dtype=float))


def test_distances_lead_to_open_edges_only():
    clearing = task(layout="walled", boxes=3)
    world = clearing.start(stream(0, "layout"))
    poses = np.array([(4.5, 0.7, 0.0), (0.0, 4.0, 0.0), (0.0, 5.5, 0.0)])
    np.testing.assert_allclose(clearing.goal_distances(poses), (4.3, 1.0, 0.0), atol=0.02)
    free = task(boxes=3)
    free.start(stream(0, "layout"))
    np.testing.assert_allclose(free.goal_distances(poses), (0.5, 1.0, 0.0), atol=0.02)
    assert not placed(world, poses).completed.any()  # half of the last one is inside
    out = placed(world, [(0.0, 5.51, 0.0), (0.0, 5.5, 0.0), (0.0, 5.6, np.pi / 4)])
    assert out.completed.tolist() == [True, False, False]


def test_rewards_by_hand():
    clearing = task(boxes=2)
    start = clearing.start(stream(0, "layout"))
    before = placed(start, [(3.0, 0.0, 0.0), (0.0, 2.0, 0.0)])
    nearer = placed(start, [(3.6, 0.0, 0.0), (0.0, 1.9, 0.0)])
    outcome = clearing.score(before, nearer, work=0.0, touched_static=False)
    assert outcome.reward == pytest.approx(0.2 * (0.6 - 0.1), abs=0.005)
    assert outcome.completed.tolist() == [False, False] and outcome.reason == ""
    wall = clearing.score(nearer, before, work=0.0, touched_static=True)
    assert wall.reward == pytest.approx(-0.2 * 0.5 - 0.25, abs=0.005)


def test_the_same_motion_pays_the_same_in_the_testbed():
    rewards = []
    for preset, scale in (("benchmark", 1.0), ("testbed", 0.08)):
        clearing = task(preset=preset, boxes=2)
        start = clearing.start(stream(0, "layout"))
        before, after = (
            placed(start, [(scale * x, 0.0, 0.0), (0.0, scale * y, 0.0)])
            for x, y in ((3.0, 2.0), (3.6, 1.9))
        )
        rewards.append(clearing.score(before, after, work=0.0, touched_static=False).reward)
    assert rewards[0] == pytest.approx(0.2 * (0.6 - 0.1), abs=0.005)
    assert rewards[1] == pytest.approx(rewards[0], rel=0.05)


def test_a_cleared_box_can_come_back():
    clearing = task(boxes=2)
    start = clearing.start(stream(0, "layout"))
    inside = placed(start, [(4.9, 0.0, 0.0), (0.0, 0.0, 0.0)])
    outside = placed(start, [(5.6, 0.0, 0.0), (0.0, 0.0, 0.0)])
    out = clearing.score(inside, outside, work=0.0, touched_static=False)
    assert out.reward == pytest.approx(10.0 + 0.2 * 0.1, abs=0.005)
    assert out.completed.tolist() == [True, False] and not out.terminated
    back = clearing.score(outside, inside, work=0.0, touched_static=False)
    assert back.reward == pytest.approx(-10.0 - 0.2 * 0.1, abs=0.005)
    assert back.completed.tolist() == [False, False]


def test_the_end_when_all_are_cleared():
    clearing = task(boxes=2)
    start = clearing.start(stream(0, "layout"))
    before = placed(start, [(5.6, 0.0, 0.0), (0.0, 5.4, 0.0)])
    after = placed(start, [(5.6, 0.0, 0.0), (0.0, 5.6, 0.0)])
    outcome = clearing.score(before, after, work=0.0, touched_static=False)
    assert outcome.reward == pytest.approx(10.0 + 50.0)
    assert outcome.success and outcome.terminated and outcome.reason == "cleared"


def test_the_count_of_idle_actions_restarts_when_a_box_is_cleared():
    clearing = task(action="heading", boxes=2)
    start = clearing.start(stream(0, "layout"))
    inside = placed(start, [(4.9, 0.0, 0.0), (0.0, 0.0, 0.0)])
    outside = placed(start, [(5.6, 0.0, 0.0), (0.0, 0.0, 0.0)])

    def step(before, after):
        return clearing.score(before, after, work=0.0, touched_static=False).truncated

    assert not any(step(inside, inside) for _ in range(199))
    assert not step(inside, outside)
    assert not step(outside, inside)  # coming back does not restart it
    assert [step(inside, inside) for _ in range(199)] == [False] * 198 + [True]


@pytest.mark.parametrize(
    ("preset", "bad", "error", "text"),
    [
        ("benchmark", {"layout": "wall"}, ScenarioError, "did you mean 'walled'"),
        ("benchmark", {"box_count": 3}, UnknownNameError, "variation of area_clearing"),
        ("benchmark", {"boxes": -1}, ScenarioError, "boxes must be at least 1"),
        ("benchmark", {"bumper": "pusher"}, ScenarioError, "one of its own"),
        ("testbed", {"robot": "jackal"}, ScenarioError, "valid: turtlebot3"),
        ("testbed", {"box_size": float("inf")}, ScenarioError, "must lie in .0, inf.,"),
        ("testbed", {"box_yaw": 3}, ScenarioError, "aligned"),
    ],
)
def test_bad_variations_are_refused(preset, bad, error, text):
    with pytest.raises(error, match=text):
        task(preset, **bad)
    with pytest.raises(UnknownNameError, match="did you mean 'heading'"):
        task(action="headin")
    with pytest.raises(ScenarioError, match="200 boxes of 1 m do not fit"):
        task(boxes=200).start(stream(0, "layout"))


def test_same_seed_same_episode():
    def run():
        env = PushEnv(
            task="area_clearing", action="velocity", observation="state", preset="testbed"
        )
        env.reset(seed=5)
        rows = [env.step([1.0, 0.2 * np.sin(i)]) for i in range(40)]
        return env.world, [row[1] for row in rows], rows[-1][4]["completed"].tolist()

    assert run() == run()


def test_a_pushed_box_is_cleared_and_stays():
    env = PushEnv(
        task="area_clearing", action="velocity", observation="state", variations={"boxes": 2}
    )
    env.reset(seed=0)
    world = env.world.moved(
        robot_pose=(3.0, 0.0, 0.0), movable_poses=[(4.3, 0.0, 0.0), (-2.0, 0.0, 0.0)]
    )
    env._simulator.build(world, env.task.materials)
    env._world = world
    total = 0.0
    for _ in range(45):
        _, reward, terminated, _, info = env.step([1.0, 0.0])
        total += reward
    assert info["completed"].tolist() == [True, False] and not terminated
    assert total == pytest.approx(10.0 + 0.2 * 0.7, abs=0.01)
    assert len(env.world.movables) == 2
