import pickle
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.scenarios import (
    Scenario,
    load_scenarios,
    save_scenarios,
    suite,
    suite_names,
)
from pushplan.world import InvalidInputError, SchemaError, UnknownNameError

values = st.one_of(
    st.booleans(),
    st.integers(-(2**53), 2**53),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(max_size=20),
)
scenarios = st.builds(
    Scenario,
    task=st.sampled_from(["maze", "ship_ice"]),
    preset=st.sampled_from(["benchmark", "testbed"]),
    variations=st.dictionaries(st.text(min_size=1, max_size=10), values, max_size=4),
    seed=st.integers(0, 2**40),
)


@settings(max_examples=12)
@given(st.lists(scenarios, max_size=3))
def test_yaml_file_gives_back_equal_scenarios(tmp_path_factory, items):
    path = tmp_path_factory.mktemp("scenarios") / "s.yaml"
    save_scenarios(items, path)
    back = load_scenarios(path)
    assert list(back) == items
    assert [repr(a) for a in back] == [repr(a) for a in items]  # types as well as values


@given(scenarios)
def test_scenarios_hash_and_pickle(scenario):
    assert pickle.loads(pickle.dumps(scenario)) == scenario
    assert len({scenario, Scenario.from_dict(scenario.to_dict())}) == 1
    assert re.fullmatch(r"[a-z_]+-pymunk-[a-z]+-[0-9a-f]{8}-\d+", scenario.key)


def test_key_depends_on_every_part_and_not_on_order():
    base = Scenario("maze", variations={"boxes": 3, "shape": "u"})
    assert base.key == Scenario("maze", variations={"shape": "u", "boxes": 3}).key
    others = [
        Scenario("maze", variations={"boxes": 4, "shape": "u"}),
        Scenario("maze", preset="testbed", variations={"boxes": 3, "shape": "u"}),
        Scenario("maze", variations={"boxes": 3, "shape": "u"}, seed=1),
    ]
    assert len({base.key, *(other.key for other in others)}) == 4


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ({"task": "maze", "sed": 1}, "did you mean 'seed'"),
        ({"seed": 1}, "lacks the required key 'task'"),
        ({"task": "maze", "variations": {"boxes": [1]}}, "'boxes'"),
        ({"task": "maze", "variations": {"a": float("nan")}}, "finite"),
        ({"task": "maze", "seed": -1}, "at least 0"),
        ({"task": "ma ze"}, "plain name"),
        ([], "mapping"),
    ],
)
def test_bad_scenarios_are_refused_by_name(data, text):
    with pytest.raises(InvalidInputError, match=re.escape(text)):
        Scenario.from_dict(data)


def test_unreadable_scenario_files(tmp_path):
    for text in ("a: [", "schema: other/1\nscenarios: []", "schema: pushplan-scenarios/1"):
        path = tmp_path / "bad.yaml"
        path.write_text(text)
        with pytest.raises(SchemaError):
            load_scenarios(path)
    with pytest.raises(SchemaError, match="missing"):
        load_scenarios(tmp_path / "missing.yaml")


@pytest.mark.parametrize("name", suite_names())
def test_every_suite_has_distinct_scenarios(name):
    found = suite(name)
    assert found.name == name and len(found) > 0 and found.version >= 1
    assert len({scenario.key for scenario in found.scenarios}) == len(found)


def test_maze_suites_are_there():
    wanted = {f"maze-2d-{n}{shape}" for n in (3, 5, 6, 10) for shape in ("", "-z")}
    assert wanted | {"smoke"} <= set(suite_names())


def test_seeds_count_up_from_the_first():
    found = suite("maze-2d-5", episodes=4, first_seed=100)
    assert [scenario.seed for scenario in found.scenarios] == [100, 101, 102, 103]
    assert {scenario.variations["boxes"] for scenario in found.scenarios} == {5}
    assert suite("maze-2d-5", episodes=2).scenarios == suite("maze-2d-5").scenarios[:2]
    smoke = suite("smoke", episodes=10, first_seed=7)
    assert [scenario.seed for scenario in smoke.scenarios] == [7] * 8 + [8] * 2


def test_unknown_suite_names_the_nearest():
    with pytest.raises(UnknownNameError, match="did you mean 'maze-2d-5'"):
        suite("maze-2d5")
    with pytest.raises(InvalidInputError, match="episodes"):
        suite("smoke", episodes=0)
