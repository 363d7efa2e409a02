"""Worlds in millimetres or degrees are reported, and refused if one asks for it."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import pytest

from pushplan.cli import main
from pushplan.evaluation import JobSettings
from pushplan.scenarios import suite
from pushplan.serving.world_feed import WorldFeed
from pushplan.world import InvalidInputError, load_world
from pushplan.world.units import UnitsWarning, check_length, check_units

WORLD = {
    "schema": "pushplan-world/1",
    "robot": {
        **{"drive": "differential", "mass": 1.0, "max_speed": 0.2, "max_turn_rate": 2.84},
        "parts": [[[0.1, -0.1], [0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1]]],
        "pose": [1, 1, 0],
    },
    "static": {
        "bounds": [0, 0, 5, 5],
        "polygons": [[[0.6, 2.4], [2.0, 2.4], [2.0, 2.6]]],
        "segments": [{"from": [0, 0], "to": [5, 0]}],
    },
    "movables": [{"outline": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "pose": [3, 3, 0]}],
    "goal": {"kind": "pose", "center": [4, 4], "radius": 0.3, "heading": 0, "heading_tolerance": 1},
}
PLACE = {"id": 0, "pose": [3, 3, 90.0], "radius": 0.1}
MISTAKES = {
    "static.polygons has 1 of 1": ("static", "polygons", [[[600, 2400], [900, 2400], [900, 2600]]]),
    r"\[600.0, 2400.0, 900.0, 2600.0\]": (
        "static",
        "polygons",
        [[[600, 2400], [900, 2400], [900, 2600]]],
    ),
    "static.segments has 1 of 1": ("static", "segments", [{"from": [0, 5000], "to": [5000, 5000]}]),
    "movables has 1 of 1": ("movables", 0, "pose", [3000, 3000, 0]),
    "goal.center has 1 of 1": ("goal", "center", [4000, 4000]),
    "robot.parts has 1 of 1": ("robot", "pose", [1000, 1000, 0]),
    "robot.pose has 90 rad": ("robot", "pose", [1, 1, 90.0]),
    "robot.twist has 45 rad": ("robot", "twist", [0, 0, 45.0]),
    "robot.max_turn_rate has 162.7 rad": ("robot", "max_turn_rate", 162.7),
    r"movables\[0\].pose has -45 rad": ("movables", 0, "pose", [3, 3, -45.0]),
    r"movables\[0\].twist has 30 rad": ("movables", 0, "twist", [0, 0, 30.0]),
    "goal.heading has 180 rad": ("goal", "heading", 180.0),
    r"goal.places\[0\].pose has 90 rad": ("goal", {"kind": "objects", "places": [PLACE]}),
    r"goal.center is 4,242.64 m from robot.pose, 15,000 robot lengths": ("mm",),
}


def written(folder: Path, *change: object) -> Path:
    data = json.loads(json.dumps(WORLD))
    if change == ("mm",):
        data["static"] = {"bounds": [0, 0, 5000, 5000]}
        data["goal"]["center"] = [3001, 3001]
    elif change:
        place = data
        for key in change[:-2]:
            place = place[key]
        place[change[-2]] = change[-1]
    path = folder / "world.json"
    path.write_text(json.dumps(data))
    return path


@pytest.mark.filterwarnings("ignore::pushplan.world.units.UnitsWarning")  # the others
@pytest.mark.parametrize("words", MISTAKES)
def test_a_mistake_is_named_with_its_key_and_value(words: str, tmp_path: Path) -> None:
    path = written(tmp_path, *MISTAKES[words])
    with pytest.warns(UnitsWarning, match=f"world.json: .*{words}"):
        load_world(path)
    with pytest.raises(InvalidInputError):
        load_world(path, strict=True)
    with pytest.warns(UnitsWarning, match=words):
        WorldFeed().whole(json.loads(path.read_text()))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "name", ["maze-2d-10-shapes", "ship-ice-2d-30-real", "namo-2d-unknown", "maze-3d-6-lidar"]
)
def test_worlds_of_tasks_raise_no_doubt(name: str) -> None:
    scenario = suite(name, episodes=1).scenarios[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        env = JobSettings().environment(scenario, None)
        env.reset(seed=0)
    check_units(env.unwrapped.world, strict=True)
    env.close()


@pytest.mark.filterwarnings("error")
def test_worlds_in_the_right_units_raise_no_doubt(tmp_path: Path) -> None:
    load_world(written(tmp_path), strict=True)
    load_world(Path(__file__).parents[2] / "examples" / "room.yaml", strict=True)


def test_commands_say_it_once_and_refuse_it_if_strict(tmp_path: Path, capsys) -> None:
    path = str(written(tmp_path, *MISTAKES["static.polygons has 1 of 1"]))
    room = ["--task", "room", "--set", f"world_file={path}"]
    commands = [
        (["plan", path, "--planner", "straight"], 0),
        (["run", *room, "--policy", "straight"], 0),
    ]
    for command, code in commands:
        assert main(command) == code
        assert capsys.readouterr().err.count("note: ") == 1
        assert main([*command, "--strict"]) == 2
        assert "outside static.bounds [0.0, 0.0, 5.0, 5.0]" in capsys.readouterr().err


def test_a_path_is_measured_by_the_robot(tmp_path: Path) -> None:
    world = load_world(written(tmp_path))
    longest = 2_000.0 * world.robot.circumscribed_radius
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_length(world, 0.99 * longest)
    with pytest.warns(UnitsWarning, match="the path has a length of .* 1,010 robot lengths"):
        check_length(world, 1.01 * longest)
