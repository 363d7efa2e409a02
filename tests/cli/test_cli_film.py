"""Scores that are shown while an episode goes on are those of the metrics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import make_u_maze
from PIL import Image

from pushplan.cli import film
from pushplan.cli.film import Camera
from pushplan.cli.scoreboard import Scoreboard, closing_lines
from pushplan.metrics import manipulation_scores, navigation_scores
from pushplan.world import ClearanceArea, Episode, Plan, Receptacle, StaticMap, World

AREA = ClearanceArea([[2, 6], [9, 6], [9, 12], [2, 12]], [True, True, False, True])


def wander(start: World, steps: int = 40) -> Episode:
    """Robot and boxes go anywhere: the scores have to be right, not the physics."""
    rng = np.random.default_rng(4)
    robot = start.robot_pose + np.cumsum(rng.normal(0, 0.2, (steps, 3)), axis=0)
    objects = start.movables.poses + np.cumsum(
        rng.normal(0, 0.3, (steps, len(start.movables), 3)), axis=0
    )
    objects[-1, 0, :2] = [12.0, 8.0]
    robot[0], objects[0] = start.robot_pose, start.movables.poses
    return Episode(start, 0.1 * np.arange(steps), robot, objects, False, "stopped")


def shown(episode: Episode, chunk: int) -> tuple[Scoreboard, str]:
    board, seen = Scoreboard(episode.world), 1
    while seen < len(episode.times):
        part = slice(seen, seen + chunk)
        last = min(seen + chunk, len(episode.times)) - 1
        board.advance(episode.world_at(last), episode.robot_poses[part], episode.object_poses[part])
        seen += chunk
    return board, "\n".join(board.lines())


@pytest.mark.parametrize("chunk", [1, 7, 100])
def test_scores_so_far_are_those_of_the_metrics(chunk: int) -> None:
    start = make_u_maze([[4, 9, 0.3], [10, 13, 0.0], [8.4, 11.2, 0.7]], goal=AREA)
    episode = wander(start)
    board, text = shown(episode, chunk)
    done = board.completed()
    assert done.tolist()[:2] == [True, True]
    final = Episode(
        start, episode.times, episode.robot_poses, episode.object_poses, False, "", done
    )
    scores = manipulation_scores(final)
    assert f"path {scores.path_length_m:.2f} m" in text
    assert f"{scores.completed} of 3 done" in text
    assert f"E {scores.efficiency:.2f}   I {scores.effort:.2f}" in text
    navigation = wander(make_u_maze([[4, 9, 0.3]]))
    assert f"I {navigation_scores(navigation).effort:.2f}" in shown(navigation, chunk)[1]


def test_objects_that_left_the_floor_are_done() -> None:
    corner = Receptacle([[11, 11], [14, 11], [14, 14], [11, 14]])
    start = make_u_maze([[4, 9, 0], [12.5, 12.5, 0], [8.0, 12.0, 0]], goal=corner)
    board = Scoreboard(start)
    assert board.completed().tolist() == [False, True, False]
    rest = World(start.robot, start.robot_pose, start.static, start.movables.select([1, 2]), corner)
    board.advance(rest, start.robot_pose[None], start.movables.poses[None])
    assert board.completed().tolist() == [True, True, False]


class Nobody:
    def reset(self, world: World, rng: Any) -> None: ...

    def act(self, world: World, observation: Any) -> None: ...


@pytest.mark.parametrize("name", ["a.png", "a.gif"])
def test_films_follow_an_episode(name: str, tmp_path: Path) -> None:
    episode = wander(make_u_maze([[4, 9, 0.3], [10, 13, 0.0]], goal=AREA), steps=6)
    camera = Camera(str(tmp_path / name))
    for step in range(len(episode.times)):
        camera(step, episode.world_at(step), Nobody())  # type: ignore[arg-type]
    camera.write(episode)
    with Image.open(tmp_path / name) as shown_film:
        assert getattr(shown_film, "n_frames", 1) == (1 if name == "a.png" else 6)
    assert closing_lines(episode)[0] == "stopped"


@pytest.mark.parametrize(("length", "follows"), [(20.0, False), (60.0, True)])
def test_films_of_long_maps_say_that_the_picture_follows(
    length: float, follows: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = make_u_maze([[4, 9, 0.3]], goal=AREA)
    floor = StaticMap.build(bounds=[0, 0, 15, length])
    episode = wander(replace(start, static=floor), steps=3)
    frames = []
    monkeypatch.setattr(
        film, "add_strips", lambda picture, text, _: frames.append((picture.shape, text)) or picture
    )
    for name in ("a.gif", "a.pdf"):
        camera = Camera(str(tmp_path / name))
        for step in range(3):
            camera(step, episode.world_at(step), Nobody())  # type: ignore[arg-type]
        camera.write(episode)
    assert len(frames) == 3 and len({len(text) for _, text in frames}) == 1
    for (rows, columns, _), text in frames:
        assert any("follows the robot" in line for line in text) == follows
        assert rows / columns == pytest.approx(1.6 if follows else length / 15, rel=0.01)


class Ahead(Nobody):
    """Its plan is through a box, and says nothing of it."""

    def __init__(self, start: World) -> None:
        x, y, _ = start.robot_pose
        poses = np.column_stack(
            [np.full(20, x), np.linspace(y, y + 3.0, 20), np.full(20, np.pi / 2)]
        )
        zero = np.zeros(20)
        self.current_plan = Plan(np.arange(20.0), poses, zero, zero, 3.0)


@pytest.mark.slow
def test_plans_that_predict_nothing_are_shown_with_a_prediction(tmp_path: Path) -> None:
    x, y, _ = make_u_maze().robot_pose
    for box, seen in (((x, y + 2.0, 0.0), True), ((4.0, 13.0, 0.0), False)):
        episode = wander(make_u_maze([box]), steps=3)
        camera = Camera(str(tmp_path / "a.gif"))
        policy = Ahead(episode.world)
        for step in range(3):
            camera(step, episode.world, policy)  # type: ignore[arg-type]
        camera.write(episode)
        with Image.open(tmp_path / "a.gif") as shown_film:
            picture = np.asarray(shown_film.convert("RGB")).astype(int)
        purple = (np.abs(picture - [204, 121, 167]).max(axis=2) < 12).sum()
        assert (purple > 50) == seen
