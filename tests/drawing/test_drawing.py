from __future__ import annotations

import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from pushplan.drawing import draw_world, save_animation, save_image
from pushplan.world import (
    ClearanceArea,
    Drive,
    Goal,
    GoalDisc,
    GoalLine,
    InvalidInputError,
    Movables,
    Plan,
    Receptacle,
    RobotModel,
    StaticMap,
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


def test_long_maps_keep_their_shape_with_even_sides() -> None:
    assert draw_world(scene(height=3.33), size_px=301).shape[0] % 2 == 0
    height, width, _ = draw_world(scene(height=40.0), size_px=SIZE).shape
    assert (height, width) == (SIZE, SIZE // 4)


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
