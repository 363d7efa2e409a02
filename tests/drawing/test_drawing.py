from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from conftest import quickest
from PIL import Image

from pushplan.drawing import draw_world, save_animation, save_image
from pushplan.drawing.top_view import film_view
from pushplan.world import (
    ClearanceArea,
    Drive,
    Goal,
    GoalDisc,
    GoalLine,
    GoalPose,
    InvalidInputError,
    Movables,
    Plan,
    Receptacle,
    RobotModel,
    StaticMap,
    Unseen,
    World,
)

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
SIZE = 400


def scene(goal: Goal | None = None, height: float = 10.0) -> World:
    return World(
        robot=RobotModel.from_outline(
            SQUARE * 1.4, mass=1.0, drive=Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
        ),
        robot_pose=np.array([5.0, 2.0, 0.3]),
        static=StaticMap.build([], [[5, 4, 5, 7]], 0.4, bounds=[0, 0, 10, height]),
        movables=Movables.from_outlines(
            [SQUARE, SQUARE], [[2, 5, 0.2], [8, 5, 0.0]], wheeled=[False, True]
        ),
        goal=goal or GoalDisc(np.array([2.0, 8.5]), 1.0),
    )


def colour(picture: np.ndarray, x: float, y: float) -> np.ndarray:
    """The pixel at a place in the world, in a map 10 m wide."""
    scale = picture.shape[1] / 10.0
    return picture[picture.shape[0] - 1 - int(y * scale), int(x * scale)].astype(int)


def plan_of(world: World) -> Plan:
    poses = np.column_stack([np.linspace(5, 9, 20), np.linspace(2, 9, 20), np.zeros(20)])
    objects = np.repeat(world.movables.poses[None], 20, axis=0)
    objects[-1, 0, 1] += 1.5
    zero = np.zeros(20)
    return Plan(np.arange(20.0), poses, zero, zero, 1.0, object_poses=objects)


def test_things_are_drawn_where_they_are() -> None:
    world = scene()
    picture = draw_world(world, size_px=SIZE)
    assert picture.shape == (SIZE, SIZE, 3) and picture.dtype == np.uint8
    floor, wall = colour(picture, 9.5, 0.5), colour(picture, 5.0, 5.5)
    plain, wheeled = colour(picture, 2.0, 5.0), colour(picture, 8.0, 5.0)
    assert floor.min() > 230 and wall.max() < 110
    assert plain.sum() < wheeled.sum() - 100  # dark and light
    goal = colour(picture, 2.5, 8.5)
    assert goal[1] > goal[0] and goal[1] > goal[2]
    robot = colour(picture, 4.5, 2.0 + 0.5)
    assert robot[2] > robot[0] + 50
    assert colour(picture, 5.2, 2.05).min() > 200  # the arrow


def test_plan_and_trail_change_the_picture_only_near_them() -> None:
    world = scene()
    bare = draw_world(world, size_px=SIZE).astype(int)
    plan = draw_world(world, size_px=SIZE, plan=plan_of(world)).astype(int)
    trail = np.column_stack([np.linspace(1, 5, 30), np.full(30, 2.0), np.zeros(30)])
    trailed = draw_world(world, size_px=SIZE, trail=trail).astype(int)
    assert (plan != bare).any() and (trailed != bare).any()
    assert (colour(trailed, 2.5, 2.0) != colour(bare, 2.5, 2.0)).any()
    rows = np.nonzero((trailed != bare).any(axis=(1, 2)))[0]
    assert np.ptp(rows) < 20
    np.testing.assert_array_equal(
        draw_world(world, size_px=SIZE, trail=trail[:, :2]), trailed.astype(np.uint8)
    )


def test_predictions_leave_out_fixed_objects_as_planners_do() -> None:
    world = scene()
    boxes = world.movables
    held = Movables.from_outlines(
        [SQUARE, SQUARE], boxes.poses, masses=boxes.masses, fixed=[False, True]
    )
    world = replace(world, movables=held)
    whole = plan_of(world)
    told = replace(whole, object_poses=whole.object_poses[:, :1])
    pictures = [draw_world(world, size_px=SIZE, plan=plan) for plan in (whole, told)]
    assert np.array_equal(*pictures)
    assert not np.array_equal(pictures[1], draw_world(world, size_px=SIZE, plan=bare(whole)))


def bare(plan: Plan) -> Plan:
    """The same without a prediction."""
    return replace(plan, object_poses=None)


def test_text_stays_in_its_corner() -> None:
    bare = draw_world(scene(), size_px=SIZE)
    picture = draw_world(scene(), size_px=SIZE, text=["E_nav 0.91", "I_nav 0.85"])
    changed = np.argwhere((picture != bare).any(axis=2))
    assert len(changed) > 100
    assert changed.max(axis=0).tolist() < [SIZE // 2, SIZE // 2]
    np.testing.assert_array_equal(draw_world(scene(), size_px=SIZE, text=""), bare)


@pytest.mark.parametrize(
    "goal",
    [
        GoalLine(np.array([0.0, 8.0]), np.array([0.1, 1.0])),
        GoalPose(np.array([2.0, 8.4]), 0.02, np.pi / 2.0, 0.1),
        Receptacle(np.array([[1.0, 7], [3, 7], [3, 9], [1, 9]])),
        ClearanceArea(np.array([[1.0, 7], [3, 7], [3, 9], [1, 9]]), np.ones(4, dtype=bool)),
    ],
)
def test_every_goal_is_green(goal: Goal) -> None:
    r, g, b = colour(draw_world(scene(goal), size_px=SIZE), 2.0, 8.6)
    assert g > r and g > b


def test_same_world_same_bytes_and_no_leftovers_of_another() -> None:
    first = draw_world(scene(), size_px=SIZE)
    draw_world(scene(), size_px=SIZE, plan=plan_of(scene()), text="x")
    draw_world(scene(GoalLine(np.array([0.0, 8.0]), np.array([0.0, 1.0]))), size_px=SIZE)
    assert draw_world(scene(), size_px=SIZE).tobytes() == first.tobytes()


def test_what_nobody_has_seen_is_grey() -> None:
    cells = np.zeros((20, 22), dtype=bool)
    cells[12:, 14:] = True  # the map goes on beyond the picture
    hidden = replace(scene(), unseen=Unseen(cells, 0.6, np.array([-1.0, -1.0])))
    before, after = draw_world(scene(), size_px=SIZE), draw_world(hidden, size_px=SIZE)
    grey = (before != after).any(axis=2)
    assert grey[: int(0.38 * SIZE), int(0.74 * SIZE) + 2 :].all()
    assert not grey[int(0.38 * SIZE) + 2 :].any() and not grey[:, : int(0.74 * SIZE) - 2].any()


def test_long_maps_keep_their_shape_with_even_sides() -> None:
    assert draw_world(scene(height=3.33), size_px=301).shape[0] % 2 == 0
    height, width, _ = draw_world(scene(height=40.0), size_px=SIZE, view=40.0).shape
    assert (height, width) == (SIZE, SIZE // 4)


SIDES = [(9.0, 2.0), (2.0, 9.0), (100.0, 2.0), (2.0, 100.0), (0.4, 0.1), (1000.0, 800.0)]


def hall(width: float, height: float) -> tuple[World, Plan]:
    """An empty hall whose robot goes from one end to the other."""
    size = 0.1 * min(width, height, 2.0)
    ends = np.array([[0.05, 0.05], [0.95, 0.95]]) * [width, height]
    robot = RobotModel.from_outline(
        SQUARE * size, mass=1.0, drive=Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
    )
    floor = StaticMap.build(bounds=[0, 0, width, height])
    world = World(robot, [*ends[0], 0.0], floor, Movables.empty(), GoalDisc(ends[1], size))
    poses = np.column_stack([np.linspace(*ends, 9), np.zeros(9)])
    return world, Plan(np.arange(9.0), poses, np.zeros(9), np.zeros(9), 1.0)


@pytest.mark.parametrize(("width", "height"), SIDES)
def test_a_still_shows_all_of_the_world_whatever_its_shape(width: float, height: float) -> None:
    world, plan = hall(width, height)
    picture = draw_world(world, size_px=SIZE, plan=plan).astype(int)
    rows, columns = picture.shape[:2]
    assert rows / columns == pytest.approx(height / width, rel=0.2)
    red, green, blue = np.moveaxis(picture, -1, 0)

    def along(seen: np.ndarray) -> np.ndarray:
        """Part of the way from one end of the hall to the other at which pixels lie."""
        up, right = np.nonzero(seen[::-1])
        return up / rows if rows > columns else right / columns

    assert np.median(along(blue > red + 60)) == pytest.approx(0.05, abs=0.05)  # robot
    assert np.median(along((green > red + 15) & (green > blue + 5))) == pytest.approx(
        0.95, abs=0.05
    )
    plan = along(red > blue + 60)
    assert plan.min() < 0.2 and plan.max() > 0.8


def test_long_maps_are_shown_around_the_robot_where_the_picture_follows() -> None:
    world = scene(height=400.0)
    assert film_view(scene()) is None and film_view(scene(height=24.0)) is None
    shapes = set()
    for y in (2.0, 50.0, 321.4, 399.0):
        there = world.moved(robot_pose=[5.0, y, 0.3])
        picture = draw_world(there, size_px=SIZE, view=film_view(there))
        shapes.add(picture.shape)
        rows, _ = np.nonzero(picture[..., 2].astype(int) - picture[..., 0] > 90)  # the robot's blue
        middle = picture.shape[0] / 2
        if y == 2.0:
            assert rows.mean() > 1.5 * middle
        elif y == 399.0:
            assert rows.mean() < 0.5 * middle
        else:
            assert rows.mean() == pytest.approx(middle, abs=3)
    assert shapes == {(SIZE, SIZE * 10 // 16, 3)}


def test_still_things_do_not_shimmer_while_the_picture_follows() -> None:
    world = scene(height=400.0)
    posts = [[2, y, 3, y + 1] for y in range(0, 400, 4)]
    world = World(
        world.robot,
        world.robot_pose,
        StaticMap.build([], posts, 0.4, bounds=[0, 0, 10, 400]),
        Movables.empty(),
        GoalDisc(np.array([9.0, 399.0]), 0.5),
    )
    pictures = [
        draw_world(world.moved(robot_pose=[8.0, 100.0 + dy, 0.0]), size_px=SIZE, view=16.0)[:, :120]
        for dy in (0.0, 0.0131, 0.0263)
    ]
    for picture in pictures[1:]:
        assert any(
            np.array_equal(picture[5:-5], np.roll(pictures[0], k, axis=0)[5:-5]) for k in range(3)
        )


@pytest.mark.parametrize("view", [0.0, -1.0, float("nan"), "all"])
def test_senseless_views_are_refused(view: object) -> None:
    with pytest.raises(InvalidInputError):
        draw_world(scene(), view=view)  # type: ignore[arg-type]


def test_a_channel_of_water_has_floes_of_ice() -> None:
    line = GoalLine(np.array([0.0, 9.0]), np.array([0.0, 1.0]))
    world = scene(line)
    open_water = World(
        world.robot, world.robot_pose, StaticMap.build(bounds=[0, 0, 10, 10]), world.movables, line
    )
    picture = draw_world(open_water, size_px=SIZE)
    water, floe = colour(picture, 9.5, 0.5), colour(picture, 2.0, 5.0)
    assert water[2] > water[0] + 30 and floe.min() > 230
    assert colour(draw_world(world, size_px=SIZE), 9.5, 0.5).min() > 230


def test_the_bumper_is_told_from_the_chassis() -> None:
    world = scene()
    plow = np.array([[0.7, -1.2], [1.1, -1.2], [1.1, 1.2], [0.7, 1.2]])
    robot = RobotModel(
        (SQUARE * 1.4, plow), 1.0, Drive.DIFFERENTIAL, max_speed=1.0, max_turn_rate=1.0
    )
    world = World(robot, [5.0, 2.0, 0.0], world.static, world.movables, world.goal)
    picture = draw_world(world, size_px=SIZE)
    chassis, bumper = colour(picture, 4.5, 2.5), colour(picture, 5.9, 2.9)
    assert bumper.sum() < chassis.sum() - 100


def test_open_edges_are_told_from_closed_ones() -> None:
    area = ClearanceArea(np.array([[1.0, 7], [3, 7], [3, 9], [1, 9]]), [True, True, True, False])
    picture = draw_world(scene(area), size_px=SIZE)
    beyond_open = picture[SIZE - (8 * 40) - 40 : SIZE - 8 * 40 + 40, 3 * 40 : 3 * 40 + 10]
    beyond_closed = picture[SIZE - (8 * 40) - 40 : SIZE - 8 * 40 + 40, 30:38]
    green = [(p[..., 1].astype(int) - p[..., 0] > 90).sum() for p in (beyond_open, beyond_closed)]
    assert green[0] > 50 and green[1] == 0


def test_a_picture_of_many_floes_is_drawn_in_time() -> None:
    rng = np.random.default_rng(0)
    angles = np.arange(7) * 2 * np.pi / 7
    floe = 0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    poses = rng.uniform([0, 2, -3], [12, 40, 3], (640, 3))
    world = World(
        scene().robot,
        [6.0, 20.0, 1.5],
        StaticMap.build(bounds=[0, 0, 12, 40]),
        Movables.from_outlines([floe] * 640, poses),
        GoalLine(np.array([0.0, 39.0]), np.array([0.0, 1.0])),
    )
    draw_world(world)
    assert quickest(lambda: draw_world(world, text="E 0.9"), 5) < 0.08  # some 15 ms if undisturbed


def test_empty_worlds_and_trails_can_be_drawn() -> None:
    world = World(
        robot=scene().robot,
        robot_pose=np.array([50.0, 50.0, 0.0]),  # out of the picture
        static=StaticMap.build(bounds=[0, 0, 10, 10]),
        movables=Movables.empty(),
        goal=scene().goal,
    )
    picture = draw_world(world, size_px=SIZE, trail=np.array([[1.0, 1.0]]))
    assert colour(picture, 5.0, 5.0).min() > 230


@pytest.mark.parametrize("size", [0, 3, 10.5, 10**6])
def test_senseless_sizes_are_refused(size: int) -> None:
    with pytest.raises(InvalidInputError):
        draw_world(scene(), size_px=size)


def test_images_round_trip(tmp_path: Path) -> None:
    picture = draw_world(scene(), size_px=SIZE)
    save_image(tmp_path / "a.png", picture)
    np.testing.assert_array_equal(np.array(Image.open(tmp_path / "a.png").convert("RGB")), picture)


def frames(count: int = 4) -> list[np.ndarray]:
    """The plan and the trail are only in later frames: their colours have to survive."""
    world, out = scene(), []
    trail = np.column_stack([np.linspace(1, 5, 30), np.full(30, 2.0)])
    for i in range(count):
        extra = {"plan": plan_of(world), "trail": trail[: 10 * i]} if i else {}
        out.append(draw_world(world, size_px=200, **extra))
    return out


def test_gif_has_all_frames_in_their_colours(tmp_path: Path) -> None:
    pictures = frames()
    save_animation(tmp_path / "a.gif", pictures, fps=10)
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames >= 2  # equal frames may be joined
        assert film.info["duration"] >= 100
        film.seek(film.n_frames - 1)
        shown = np.array(film.convert("RGB")).astype(int)
    assert np.abs(shown - pictures[-1]).mean() < 3.0
    assert np.abs(shown - pictures[-1]).max(axis=2).max() < 110


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_a_film_that_cannot_be_written_is_said_in_a_line(name: str, tmp_path: Path, capfd) -> None:
    (tmp_path / name).mkdir()
    with pytest.raises(InvalidInputError, match=r"^cannot write .*Is a directory[^\n]{,200}$"):
        save_animation(tmp_path / name, [draw_world(scene(), size_px=SIZE)] * 2)
    assert capfd.readouterr() == ("", "")


def test_mp4_can_be_read_back(tmp_path: Path) -> None:
    pictures = frames()
    save_animation(tmp_path / "a.mp4", (p for p in pictures), fps=10)
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", tmp_path / "a.mp4"]
    raw = subprocess.run(
        [*command, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    ).stdout
    film = np.frombuffer(raw, np.uint8).reshape(-1, *pictures[0].shape)
    assert len(film) == len(pictures)
    assert np.abs(film[-1].astype(int) - pictures[-1]).mean() < 4.0


@pytest.mark.parametrize("name", ["a.bmp", "a", "missing/a.png"])
def test_what_cannot_be_written_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidInputError):
        save_image(tmp_path / name, frames(1)[0])
    with pytest.raises(InvalidInputError):
        save_animation(tmp_path / name, frames(1), fps=10)


def test_a_film_needs_a_frame(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError):
        save_animation(tmp_path / "a.gif", [], fps=10)


def test_walls_around_the_bounds_are_in_the_picture() -> None:
    room = [[[-3, -3], [13, -3], [13, 0], [-3, 0]], [[-3, 0], [0, 0], [0, 10], [-3, 10]]]
    world = World(
        scene().robot,
        [5.0, 5.0, 0.0],
        StaticMap.build(room, bounds=[0, 0, 10, 10]),
        Movables.empty(),
        GoalDisc(np.array([8.0, 8.0]), 0.5),
    )
    picture = draw_world(world, size_px=SIZE)
    assert (picture[-4:] < 110).all() and (picture[:, :4] < 110).all()
    assert picture[4, -4].min() > 230  # nothing is there on this side
    assert (picture[:, 20:-20][:-20] > 110).any(axis=2).all()  # most of it is the room
