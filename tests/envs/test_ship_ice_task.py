"""Ship-Ice: starts, rewards and ends, ice from files, observations."""

import json
import math
import os
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
import shapely
from conftest import quickest
from gymnasium.utils.env_checker import check_env

from pushplan.envs import PushEnv, make
from pushplan.envs.tasks import ship_ice
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.scenarios import Scenario, generate_ice, save_ice
from pushplan.world import ScenarioError, UnknownNameError, stream
from pushplan.world.outline import signed_area
from pushplan.world.outline_repair import OutlineWarning

PRESETS = ("benchmark", "full_scale")
BENCHMARK, FULL_SCALE = (ship_ice.PRESETS[name] for name in PRESETS)
UP = math.pi / 2.0


def task(preset="benchmark", **variations):
    return ShipIceTask(preset=preset, variations=variations, action="turn_rate")


def floes(world):
    return [shapely.Polygon(world.movables.outline_world(k)) for k in range(len(world.movables))]


def episode(env, action, seed=0):
    env.reset(seed=seed)
    total, infos = 0.0, []
    while True:
        _, reward, terminated, truncated, info = env.step(np.array([action]))
        total += reward
        infos.append(info)
        if terminated or truncated:
            return total, infos


@pytest.mark.parametrize("concentration", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("preset", PRESETS)
def test_starts(preset, concentration):
    ship = task(preset, concentration=concentration)
    low, high = ship.preset.side_margin, ship.preset.channel[0] - ship.preset.side_margin
    places = []
    for seed in range(5):
        world = ship.start(stream(seed, "layout"))
        hull = shapely.Polygon(world.robot_outline_world()[0])
        ice = floes(world)
        x0, y0, x1, y1 = ship.ice_bounds
        area = (x1 - x0) * (y1 - y0)
        assert sum(floe.area for floe in ice) == pytest.approx(concentration * area, rel=1e-6)
        clearance = ship.preset.clearance
        assert all(floe.distance(hull) > clearance for floe in ice)
        assert shapely.box(0.0, 0.0, *ship.preset.channel).contains(hull)
        places.append(world.robot_pose[0])
        assert world.robot_pose[1:].tolist() == [ship.preset.start_y, UP]
    assert min(places) >= low and max(places) <= high
    assert np.ptp(places) > 0.4 * (high - low)


def test_dimensions_of_the_benchmark():
    world = task(concentration=0.3).start(stream(0, "layout"))
    assert world.static.bounds.tolist() == [0.0, 0.0, 12.0, 40.0]
    assert len(world.static.polygons) == len(world.static.segments) == 0
    np.testing.assert_array_equal(np.ptp(world.robot.vertices, axis=0), (2.0, 0.5))
    assert (world.robot.max_speed, world.robot.max_turn_rate) == (0.3, 0.224)
    assert world.goal.distance(3.0, 8.0) == 1.0 and world.goal.distance(11.0, 9.5) == 0.0
    areas = [floe.area for floe in floes(world)]
    np.testing.assert_allclose(world.movables.masses, areas)  # as its metrics count them


def test_dimensions_at_full_scale():
    ship = task("full_scale", concentration=0.3)
    world = ship.start(stream(0, "layout"))
    np.testing.assert_allclose(np.ptp(world.robot.vertices, axis=0), (76.2, 18.0))
    assert world.robot.mass == 6.0e6
    areas = np.array([floe.area for floe in floes(world)])
    np.testing.assert_allclose(world.movables.masses, 900.0 * 1.2 * areas)
    assert np.sqrt(areas / np.pi).min() >= 6.0 and np.sqrt(areas / np.pi).max() <= 25.0
    assert world.movables.poses[:, 1].min() > 150.0 and world.movables.poses[:, 1].max() < 1150.0
    assert world.goal.point[1] == 1200.0
    hull = world.robot.parts[0]
    # it floats: a hull of that draught with the block coefficient of a supply vessel
    water = ship.materials.water
    assert 0.7 < 6.0e6 / (1025.0 * signed_area(hull) * water.robot_draught) < 1.0
    assert water.object_draught == pytest.approx(1.2 * 900.0 / 1025.0)
    assert np.degrees(world.robot.max_turn_rate) * 60.0 == pytest.approx(45.0)


def test_starts_depend_on_the_seed_alone_and_are_quick():
    ship = task(concentration=0.5)
    one = ship.start(stream(3, "layout"))
    ship.start(stream(4, "layout"))
    assert (
        ship.start(stream(3, "layout")) == one == task(concentration=0.5).start(stream(3, "layout"))
    )
    assert ship.start(stream(4, "layout")) != one
    assert quickest(lambda: ship.start(stream(5, "layout"))) < 0.25


def test_rewards_and_ends_by_hand():
    ship = task(concentration=0.0)
    before = ship.start(stream(0, "layout"))

    def score(x, y, heading=UP, work=0.0):
        return ship.score(
            before, before.moved(robot_pose=(x, y, heading)), work=work, touched_static=False
        )

    ahead = score(6.0, 2.0)
    assert ahead.reward == pytest.approx(1.0)
    assert (ahead.success, ahead.reason, ahead.terminated, ahead.truncated) == (*(False, ""), 0, 0)
    assert score(6.0, 2.0, heading=UP + 0.4).reward == pytest.approx(math.cos(0.4))
    assert score(6.0, 2.0, heading=UP + 0.4 + 6.0 * math.pi).reward == pytest.approx(math.cos(0.4))
    assert score(6.0, 2.0, heading=-UP, work=0.1).reward == pytest.approx(-1.0 - 30.0 * 0.1)
    goal = score(6.0, 9.0)
    assert goal.success and goal.terminated and goal.reason == "goal"
    assert goal.reward == pytest.approx(201.0)
    for x, y in ((-0.01, 5.0), (12.01, 5.0), (6.0, -0.01), (12.01, 9.5)):
        left = score(x, y)
        assert left.terminated and not left.success and left.reason == "left_channel"
        assert left.reward == pytest.approx(-49.0)
    ship.start(stream(0, "layout"))
    outcomes = [score(6.0, 2.0) for _ in range(300)]
    assert [outcome.truncated for outcome in outcomes] == [False] * 299 + [True]
    assert outcomes[-1].reason == "time_limit" and not outcomes[-1].terminated


def test_the_same_scene_pays_the_same_at_both_scales():
    scale = 76.2 / 2.0
    area, way = 0.4, 0.25  # of a floe at model scale
    small = BENCHMARK.work_reward * (BENCHMARK.floe_density * area) * way
    large = FULL_SCALE.work_reward * (FULL_SCALE.floe_density * area * scale**2) * (way * scale)
    assert large == pytest.approx(small)
    assert pytest.approx(BENCHMARK.window * scale) == FULL_SCALE.window


def test_variations():
    ship = task(goal_distance=10.0, start_x=2.5, start_heading=1.2, clumping=0.0)
    world = ship.start(stream(0, "layout"))
    np.testing.assert_array_equal(world.robot_pose, (2.5, 1.0, 1.2))
    assert world.goal.point[1] == 11.0
    assert task(goal_distance=39.0).goal.point[1] == 40.0
    long = task(channel_length=60.0, goal_distance=59.0)
    assert long.goal.point[1] == 60.0
    floes = long.start(np.random.default_rng(0)).movables.poses
    assert 55.0 < floes[:, 1].max() < 60.0


@pytest.mark.parametrize("preset", PRESETS)
def test_floes_after_real_fields(preset):
    ship = task(preset, concentration=0.05, floes="real", start_x=6.0)
    world = ship.start(stream(0, "layout"))
    ice = world.movables
    x0, y0, x1, y1 = ship.ice_bounds
    assert ice.areas.sum() == pytest.approx(0.05 * (x1 - x0) * (y1 - y0), rel=1e-6)
    assert ice.is_compound and np.sqrt(ice.areas.max() / ice.areas.min()) > 3.0
    hull = shapely.Polygon(world.robot_outline_world()[0])
    assert all(floe.distance(hull) > ship.preset.clearance for floe in floes(world))
    assert ship.start(stream(0, "layout")).movables == ice


@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        ({"concentratoin": 0.2}, UnknownNameError, "did you mean 'concentration'"),
        ({"concentration": 0.6}, ScenarioError, "concentration"),
        ({"concentration": -0.1}, ScenarioError, "concentration"),
        ({"concentration": float("nan")}, ScenarioError, "concentration"),
        ({"concentration": "0.2"}, ScenarioError, "concentration"),
        ({"clumping": 1.5}, ScenarioError, "clumping"),
        ({"goal_distance": 0.0}, ScenarioError, "goal_distance"),
        ({"goal_distance": 40.0}, ScenarioError, "at most 39 m"),
        ({"channel_length": 8.9}, ScenarioError, "at least 9 m"),
        ({"start_x": 13.0}, ScenarioError, r"start_x must lie in the channel, \[0, 12\]"),
        ({"start_x": "left"}, ScenarioError, "start_x"),
        ({"start_heading": float("inf")}, ScenarioError, "start_heading"),
        ({"ice_file": 3}, ScenarioError, "ice_file"),
        ({"ice_file": "no/such/file.json"}, ScenarioError, r"cannot read ice field no/such/file"),
        ({"ice_file": "x.json", "concentration": 0.1}, ScenarioError, "exclude each other"),
        ({"ice_file": "x.json", "floes": "real"}, ScenarioError, "floes and ice_file exclude"),
        ({"floes": "round"}, ScenarioError, "convex"),
    ],
)
def test_bad_variations_are_refused(bad, error, text):
    with pytest.raises(error, match=text):
        task(**bad)
    with pytest.raises(UnknownNameError, match="did you mean 'full_scale'"):
        task("fullscale")
    with pytest.raises(UnknownNameError, match="valid: turn_rate"):
        ShipIceTask(preset="benchmark", variations={}, action="heading")


def test_ice_from_a_file(tmp_path):
    path = tmp_path / "ice.json"
    field = generate_ice(stream(1, "ice"), bounds=(0.0, 0.0, 12.0, 40.0), concentration=0.2)
    save_ice(field, path)
    ship = task(ice_file=str(path))
    starts = []
    for seed in range(5):
        world = ship.start(stream(seed, "layout"))
        for k, (corners,) in enumerate(field.floes):
            np.testing.assert_allclose(world.movables.outline_world(k), corners, atol=1e-12)
        hull = shapely.Polygon(world.robot_outline_world()[0])
        assert min(floe.distance(hull) for floe in floes(world)) > 0.0
        starts.append(world.robot_pose[0])
    assert len(set(starts)) == 5
    env = make(Scenario("ship_ice", variations={"ice_file": str(path)}), observation="state")
    env.reset()
    assert len(env.world.movables) == len(field)


def test_ice_from_a_file_may_be_as_a_camera_sees_it(tmp_path):
    path = tmp_path / "seen.json"
    path.write_text("[[[1,9],[3,9],[2,9.5],[3,11],[1,11]], [[2.9,9],[4,9],[4,11],[2.9,11]]]")
    with pytest.warns(OutlineWarning, match="floes overlapped in 1 places"):
        world = task(ice_file=str(path)).start(stream(0, "layout"))
    assert [len(world.movables.parts(k)) for k in range(2)] == [2, 1]
    a, b = (
        shapely.union_all(list(map(shapely.Polygon, world.movables.parts_world(k)))) for k in (0, 1)
    )
    assert a.area == pytest.approx(3.0) and b.area == pytest.approx(2.2) and not a.overlaps(b)
    ship = task(ice_file=str(path), ice_hull=True, ice_overlaps=True)
    assert len(ship.start(stream(0, "layout")).movables) == 2


def test_ice_from_a_file_must_fit(tmp_path):
    wall = tmp_path / "wall.json"
    wall.write_text("[[[0, 0], [12, 0], [12, 3], [0, 3]]]")
    with pytest.raises(ScenarioError, match=r"wall\.json leaves no room for the ship"):
        task(ice_file=str(wall)).start(stream(0, "layout"))
    outside = tmp_path / "outside.json"
    outside.write_text("[[[0, 5], [1, 5], [1, 6]], [[11, 5], [13, 5], [13, 6]]]")
    with pytest.raises(ScenarioError, match=r"outside\.json: polygon 1 must lie in the channel"):
        task(ice_file=str(outside))
    hostile, mark = tmp_path / "field.npy", tmp_path / "mark"

    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(mark),)

    hostile.write_bytes(pickle.dumps(Trap()))
    with pytest.raises(ScenarioError, match="cannot read ice field"):
        task(ice_file=str(hostile))
    assert not mark.exists()


def nrc(path, size, floes):
    """A field in the form of the National Research Council of Canada, which runs along x."""
    square = [[-2, -1], [2, -1], [2, 1], [-2, 1]]
    ice = {str(k): {"location": at, "perimeter": square} for k, at in enumerate(floes)}
    path.write_text(json.dumps({"properties": {"field_size": size}, "ice": ice}))
    return str(path)


def test_a_field_that_states_its_water_is_turned_and_moved_into_the_channel(tmp_path):
    path = nrc(tmp_path / "field.json", [900, 100], [[10, 20], [890, 0], [-5, 99]])
    ship = task("full_scale", ice_file=path)
    # x of the file runs ahead; the ice begins at y = 150 m, midway in 200 m
    boxes = [(129, 158, 131, 162), (149, 1038, 151, 1042), (50, 143, 52, 147)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [floe.bounds for floe in floes(ship.start(stream(0, "layout")))]
    np.testing.assert_allclose(found, boxes, atol=1e-9)
    env = make(Scenario("ship_ice", preset="full_scale", variations={"ice_file": path}))
    env.reset()
    env.step(np.zeros(env.action_space.shape, np.float32))
    # a field that lies in the channel stays where it is
    path = nrc(tmp_path / "small.json", [12, 20], [[6, 5], [0, 15]])
    found = [floe.bounds for floe in floes(task(ice_file=path).start(stream(0, "layout")))]
    np.testing.assert_allclose(found, [(4, 4, 8, 6), (-2, 14, 2, 16)], atol=1e-9)


def test_a_field_that_does_not_fit_says_what_would(tmp_path):
    path = nrc(tmp_path / "field.json", [900, 100], [[10, 20]])
    with pytest.raises(ScenarioError, match=r"100 x 900 m does not fit.*wide enough: full_scale;"):
        task(ice_file=path)
    path = nrc(tmp_path / "long.json", [1200, 100], [[10, 20]])
    with pytest.raises(ScenarioError, match=r"channel_length .* 1450 m"):
        task("full_scale", ice_file=path)
    task("full_scale", ice_file=path, channel_length=1450.0)
    path = nrc(tmp_path / "wide.json", [1200, 300], [[10, 20]])
    with pytest.raises(ScenarioError, match="presets that are wide enough: none"):
        task("full_scale", ice_file=path)


@pytest.mark.parametrize("preset", PRESETS)
def test_observations(preset):
    ship = task(preset)
    world = ship.start(stream(2, "layout"))
    image = ship.observation("image").observe(world)
    footprint, _, goal, line = image
    assert image.shape == (4, 150, 150) and image.dtype == np.uint8
    rows, cols = np.nonzero(footprint)
    scale = 25.0  # px a ship's half length: 6 half lengths are 150 px
    assert np.ptp(cols) + 1 == pytest.approx(
        np.ptp(world.robot.vertices[:, 1])
        / 6.0
        * 150.0
        * (2.0 / np.ptp(world.robot.vertices[:, 0])),
        abs=2,
    )
    assert np.ptp(rows) + 1 == pytest.approx(2.0 * scale, abs=2)
    # the ship lies 2 half lengths below the middle, whichever way it heads
    assert cols.mean() == pytest.approx(74.5, abs=1.5)
    turned = ship.observation("image").observe(world.moved(robot_pose=(*world.robot_pose[:2], 0.0)))
    rows, cols = np.nonzero(turned[0])
    assert rows.mean() == pytest.approx(74.5 + 2.0 * scale, abs=1.5)
    assert np.ptp(cols) > np.ptp(rows)
    assert np.count_nonzero(line) > 50 and np.ptp(np.nonzero(line)[1]) <= 1
    assert np.ptp(np.nonzero(turned[3])[0]) <= 1  # its heading line points to the right
    assert (np.diff(goal[:, 0].astype(int)) >= 0).all()  # nearer further up
    state = ship.observation("state").observe(world)
    assert state.shape == (6 + 5 * 20,)
    with pytest.raises(UnknownNameError, match="valid: image, lidar, state"):
        ship.observation("imgae")


def test_ice_shows_in_the_image():
    ship = task(concentration=0.5)
    world = ship.start(stream(0, "layout"))
    seen = ship.observation("image").observe(world)[1]
    x, y = world.robot_pose[:2]
    window = shapely.box(x - 3.0, y - 1.0, x + 3.0, y + 5.0)
    area = sum(floe.intersection(window).area for floe in floes(world))
    assert np.count_nonzero(seen) / seen.size == pytest.approx(area / 36.0, rel=0.03)


def test_straight_through_open_water():
    env = PushEnv(task="ship_ice", variations={"concentration": 0.0}, observation="state")
    total, infos = episode(env, 0.0)
    assert infos[-1]["success"] and infos[-1]["reason"] == "goal"
    assert len(infos) == math.ceil(8.0 / 0.24) and total == pytest.approx(len(infos) + 200.0)
    assert all(info["work"] == 0.0 for info in infos)


def test_a_ship_that_keeps_turning_leaves_the_channel():
    env = PushEnv(
        task="ship_ice",
        variations={"concentration": 0.0, "start_x": 0.5, "start_heading": math.pi},
        observation="state",
    )
    total, infos = episode(env, 0.0)
    assert infos[-1]["reason"] == "left_channel" and not infos[-1]["success"]
    assert total == pytest.approx(-50.0, abs=0.1)


@pytest.mark.parametrize("preset", PRESETS)
def test_ice_costs_and_repeats(preset):
    goal = {"benchmark": 4.0, "full_scale": 250.0}[preset]
    env = PushEnv(
        task="ship_ice",
        preset=preset,
        variations={"concentration": 0.5, "goal_distance": goal},
        observation="state",
    )
    total, infos = episode(env, 0.0, seed=1)
    work = sum(info["work"] for info in infos)
    assert infos[-1]["success"] and work > 0.0
    paid = 200.0 + len(infos) - total
    assert paid == pytest.approx(env.task.preset.work_reward * work)
    again = episode(env, 0.0, seed=1)
    assert again == (total, infos)


@pytest.mark.parametrize("observation", [pytest.param("image", marks=pytest.mark.slow), "state"])
def test_gymnasium_contract(observation):
    env = gymnasium.make(
        "pushplan.envs:pushplan/ShipIce-v0", concentration=0.1, observation=observation
    )
    check_env(env.unwrapped, skip_render_check=True)
