"""Studies over suites of one's own: world files, lists of scenarios, generators."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from pushplan.cli import main
from pushplan.envs.tasks.room import SMALL_ROOM
from pushplan.evaluation import Experiment, Results, bench, compare_runs, verify
from pushplan.evaluation.benchmark import suites_of
from pushplan.scenarios import Scenario, Suite, load_scenarios, save_scenarios, suite, world_suite
from pushplan.world import ClearanceArea, InvalidInputError, SchemaError, load_world, save_world

pytestmark = pytest.mark.usefixtures("empty_figures")


def folder_of(path: Path, *names: str) -> Path:
    path.mkdir(parents=True, exist_ok=True)
    for place, name in enumerate(names):
        save_world(replace(load_world(SMALL_ROOM), margin=0.01 * place), path / name)
    return path


def experiment(folder: Path, *suites: Any, **entries: Any) -> Experiment:
    data = {"schema": "pushplan-experiment/1", "suites": list(suites), "policies": ["straight"]}
    return Experiment.from_dict({**data, **entries}, folder)


def keys(given: Experiment) -> list[str]:
    return [job.scenario.key for job in given.jobs]


@pytest.mark.usefixtures("empty_figures")
def test_a_folder_of_worlds_is_one_setting_whose_scenarios_are_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = [f"room {place:02d}.yaml" for place in range(4)]
    folder_of(tmp_path / "kitchens", *names)
    study = tmp_path / "study.yaml"
    data = {
        "schema": "pushplan-experiment/1",
        "suites": [{"worlds": "kitchens"}],
        "policies": ["straight", "other=straight"],
    }
    study.write_text(yaml.safe_dump(data))
    out = tmp_path / "run"
    assert main(["experiment", str(study), "--workers", "0", "--out", str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) < 30
    assert sum(line.startswith("success") for line in lines) == 1  # one paired test of all worlds
    results = Results.load(out)
    assert {row.scenario for row in results.rows} == {
        f"kitchens/{Path(name).stem}-0" for name in names
    }
    assert results.titles == {"kitchens": "kitchens"}
    (pair,) = (pair for pair in results.compare() if pair.metric == "E_nav")
    assert pair.difference.count == 4
    assert (out / "intervals.svg").is_file()
    (verdict,) = compare_runs(out, out / "results.csv", "E_nav<-0.1")[:1]
    assert (verdict.setting, verdict.count) == ("kitchens", 4)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("pose: [", "pose: [.nan, "), "b.yaml: robot.pose must"),
        (("goal:", "gaol:"), "gaol"),
        (("center: [", "center: [-90.0, "), "b.yaml"),
    ],
)
def test_a_world_that_nobody_could_drive_in_is_refused_before_anything_runs(
    tmp_path: Path, change: tuple[str, str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first world is fine, so that the policy fits."""
    folder = folder_of(tmp_path / "kitchens", "a.yaml", "b.yaml")
    text = (folder / "b.yaml").read_text()
    (folder / "b.yaml").write_text(text.replace(*change, 1))
    out = tmp_path / "run"
    assert main(["bench", f"{folder}/", "--policies", "straight", "--out", str(out)]) == 2
    assert said in capsys.readouterr().err and not (out / "results.csv").exists()


def test_worlds_of_one_name_are_looked_at_one_by_one(tmp_path: Path) -> None:
    folder_of(tmp_path / "a", "x.yaml")
    folder_of(tmp_path / "b", "x.yaml")
    world = load_world(tmp_path / "b" / "x.yaml")
    corners = [(0.1, 0.1), (0.5, 0.1), (0.5, 0.5), (0.1, 0.5)]
    area = ClearanceArea(corners, [True] * 4)
    save_world(replace(world, goal=area), tmp_path / "b" / "x.yaml")
    for order in (["a", "b"], ["b", "a"]):
        suites = [{"worlds": name, "label": name} for name in order]
        found = experiment(tmp_path, *suites)
        assert set(found.skipped) == {("b", "straight")}


def test_the_same_drive_again_and_again_counts_once_in_a_test(tmp_path: Path) -> None:
    """In the two worlds both policies drive alike too, and these are two."""
    folder_of(tmp_path / "kitchens", "a.yaml", "b.yaml")
    given = {"worlds": "kitchens", "episodes": 3}
    results = experiment(tmp_path, given, policies=["straight", "other=straight"]).run(workers=0)
    assert len(results.rows) == 12
    assert {pair.difference.count for pair in results.compare()} == {2}


def test_a_world_that_is_gone_is_named_when_a_run_is_verified(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "kitchens", "a.yaml")
    experiment(tmp_path, {"worlds": "kitchens"}).run(workers=0, out=tmp_path / "run")
    folder.rename(tmp_path / "elsewhere")
    with pytest.raises(InvalidInputError, match=r"world_file .*a\.yaml of job .* is missing"):
        verify(tmp_path / "run", workers=1)


def test_a_label_names_a_task_in_tables(tmp_path: Path) -> None:
    maze = {"task": "maze", "label": "few", "episodes": 1, "variations": {"boxes": 1}}
    results = experiment(tmp_path, maze).run(workers=0)
    assert list(results.titles.values()) == ["few[boxes=1]"]


def test_files_of_one_name_in_two_folders_have_names_of_their_own(tmp_path: Path) -> None:
    folder_of(tmp_path / "a" / "rooms", "x.yaml", "y.yaml")
    folder_of(tmp_path / "b" / "rooms", "x.yaml", "x.json")
    listed = {"worlds": ["a/rooms/x.yaml", "b/rooms/x.yaml", "a/rooms/y.yaml"], "label": "mine"}
    assert keys(experiment(tmp_path, listed)) == [
        "mine/a-rooms-x-0",
        "mine/b-rooms-x-0",
        "mine/y-0",
    ]
    two = experiment(tmp_path, {"worlds": "a/rooms"}, {"worlds": "b/rooms"})
    found = keys(two)
    assert found[:2] == ["rooms/x-0", "rooms/y-0"]
    assert all(key.startswith("rooms-2/x-") for key in found[2:])
    assert len(set(found)) == 4
    spread = {"worlds": "a/rooms", "variations": {"spread": 0.1}}
    assert keys(experiment(tmp_path, {"worlds": "a/rooms"}, spread))[2:] == [
        "rooms[spread=0.1]/x-0",
        "rooms[spread=0.1]/y-0",
    ]


def test_episodes_count_for_each_file(tmp_path: Path) -> None:
    folder_of(tmp_path / "rooms", "x.yaml", "y.yaml")
    six = ["rooms/x-0", "rooms/y-0", "rooms/x-1", "rooms/y-1", "rooms/x-2", "rooms/y-2"]
    assert keys(experiment(tmp_path, {"worlds": "rooms", "episodes": 3})) == six
    assert keys(experiment(tmp_path, {"worlds": "rooms"}, episodes=3)) == six
    assert keys(experiment(tmp_path, {"worlds": "rooms"})) == six[:2]
    (found,) = suites_of(f"{tmp_path}/rooms", 3, 0)
    assert [one.key for one in found.scenarios] == six


def test_a_list_of_scenarios_is_one_setting(tmp_path: Path) -> None:
    made = [
        Scenario("maze", variations={"boxes": count, "shape": "u"}, seed=count)
        for count in (1, 2, 3)
    ]
    named = replace(made[0], name="corner", seed=9)
    results = bench([*made, named], ["straight"], workers=0)
    assert list(results.titles) == ["scenarios"]
    assert "scenarios/corner-9" in {row.scenario for row in results.rows}
    save_scenarios([*made, named], tmp_path / "mine.yaml")
    assert load_scenarios(tmp_path / "mine.yaml") == (*made, named)
    file = experiment(tmp_path, {"scenarios": "mine.yaml"})
    assert {key.split("/")[0] for key in keys(file)} == {"mine"}
    twice = Suite("twice", 1, (replace(named, variations={"boxes": 4}), named))
    assert len({one.key for one in twice.as_one_setting().scenarios}) == 2


def test_shipped_scenarios_keep_their_names(tmp_path: Path) -> None:
    found = keys(experiment(tmp_path, {"suite": "smoke", "episodes": 1}, "maze-2d-3", episodes=2))
    shipped = [*suite("smoke", episodes=1).scenarios, *suite("maze-2d-3", episodes=2).scenarios]
    assert found == [one.key for one in shipped]
    assert all(key.startswith("maze-pymunk-benchmark-") for key in found)
    seeds = Suite("seeds", 1, suite("maze-2d-3", episodes=2).scenarios)
    assert seeds.as_one_setting() == seeds


@pytest.mark.parametrize("name", ["a/b/c", "/a", "a/", "a\nb", 3])
def test_a_name_of_a_scenario_is_one_or_two_parts(name: Any) -> None:
    with pytest.raises(SchemaError, match="NAME or SUITE/NAME"):
        Scenario("maze", name=name)


def test_what_is_no_world_is_refused(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("image: map.pgm\n")
    with pytest.raises(SchemaError, match="says schema: pushplan-world"):
        world_suite(tmp_path / "map.yaml")
    with pytest.raises(SchemaError, match="at least one entry"):
        experiment(tmp_path, {"worlds": []})
    with pytest.raises(InvalidInputError, match="worlds must be"):
        experiment(tmp_path, {"worlds": [3]})
