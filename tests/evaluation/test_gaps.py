"""Gaps to bounds and best known solutions, and the file that keeps them."""

import math

import pytest

from pushplan.envs import make
from pushplan.evaluation import ResultRow
from pushplan.evaluation.statistics.gaps import gaps, scenario_bound, total_work
from pushplan.motion.work_bound import work_bound
from pushplan.scenarios import Scenario, suite, suite_names
from pushplan.scenarios.known_bounds import KnownBounds, known_bounds, load_bounds, save_bounds
from pushplan.world import InvalidInputError, SchemaError


def test_gaps_are_means_over_successes():
    known = {"maze-a-0": KnownBounds(2.0, 20.0, 25.0, "x"), "maze-a-1": KnownBounds(2.0, 40.0)}
    rows = [
        row("maze-a-0", 0, length=10.0, work=10.0),
        row("maze-a-1", 1, length=20.0, work=20.0),
        row("maze-a-1", 1, length=1.0, work=0.0, success=False),
        row("maze-a-2", 2, length=1.0, work=0.0),
    ]
    (gap,) = gaps(rows, ["p"], known)
    assert (gap.policy, gap.count, gap.with_best) == ("p", 2, 1)
    assert gap.to_bound == pytest.approx(0.5)
    assert gap.to_best == pytest.approx(30.0 / 25.0 - 1.0)
    assert total_work(rows[2], known["maze-a-1"]) is None
    (alone,) = gaps(rows[1:2], ["p"], known)
    assert math.isnan(alone.to_best)


def row(scenario, seed, *, length, work, success=True):
    metrics = {"path_length_m": length, "interaction_work_kg_m": work}
    names = {"policy": "p", "task": "maze", "simulator": "pymunk", "scenario": scenario}
    return ResultRow(
        **names, seed=seed, status="done", reason="goal", success=success, metrics=metrics
    )


def test_a_better_solution_takes_the_place():
    one = KnownBounds(1.0, 2.0)
    two = one.better(5.0, "a").better(6.0, "b").better(4.0, "c")
    assert (two.best, two.best_policy) == (4.0, "c")
    with pytest.raises(InvalidInputError, match=r"by d of 1 kg m undercuts the bound of 2 kg m"):
        two.better(1.0, "d")


def test_a_bound_holds_for_robots_that_turn_on_the_spot_too():
    for one in suite("maze-3d-3").scenarios[:4]:
        env = make(one, action="velocity")
        env.reset(seed=one.seed)
        assert scenario_bound(one).bound <= work_bound(env.world).work


def test_files_keep_them(tmp_path):
    bounds = {"b-1": KnownBounds(1.5, 2.25, 3.5, 'p, "q"'), "a-0": KnownBounds(1.0, 2.0)}
    save_bounds(tmp_path / "b.csv", bounds)
    assert load_bounds(tmp_path / "b.csv") == bounds
    assert (tmp_path / "b.csv").read_text().splitlines()[1].startswith("a-0,")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", "columns must be"),
        ("HEAD\nx,1,nan,,\n", "line 2"),
        ("HEAD\nx,1,-2,,\n", "line 2"),
        ("HEAD\nx,one,2,,\n", "line 2"),
        ("HEAD\nx\n", "line 2"),
    ],
)
def test_damaged_files_say_where(tmp_path, text, words):
    head = "scenario,robot_mass_kg,bound_kg_m,best_kg_m,best_policy"
    (tmp_path / "b.csv").write_text(text.replace("HEAD", head))
    with pytest.raises(SchemaError, match=words):
        load_bounds(tmp_path / "b.csv")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SchemaError, match="cannot be read"):
        load_bounds(tmp_path / "none.csv")
    with pytest.raises(InvalidInputError):
        KnownBounds(1.0, float("nan"))


def test_what_ships_belongs_to_scenarios_and_no_solution_undercuts_its_bound():
    shipped = known_bounds()
    assert suite("maze-2d-10").scenarios[0].key in shipped
    for key, one in shipped.items():
        assert one.best is None or one.best >= one.bound, key


def test_what_a_policy_is_told_is_no_part_of_a_bound():
    known, wrong = (
        scenario_bound(
            Scenario("namo", variations={"layout": "fixed", "movability": told}, seed=0),
            most_nodes=60,
        )
        for told in ("known", "wrong")
    )
    assert known == wrong


OFFICES = ("office-1k", "office-2k", "office-5k")
PLACES = [name for name in suite_names() if name.startswith(("rearrange", "push-t"))]
SENSED = [
    name
    for name in suite_names()
    if any("sensing" in one.variations for one in suite(name, episodes=1).scenarios)
]
WITHOUT = ("box-delivery-2d-large-columns-20", *OFFICES, *PLACES, *SENSED, "smoke")
"""The suites of which some scenarios have no best known solution, and the one of several tasks."""


@pytest.mark.parametrize("name", PLACES)
def test_a_bound_is_known_where_objects_have_places(name):
    known = known_bounds()
    one = suite(name).scenarios[-1]
    assert known[one.key].bound == pytest.approx(scenario_bound(one).bound, rel=1e-5)
    assert known[one.key].bound > 0.0


@pytest.mark.parametrize("name", [name for name in suite_names() if name not in WITHOUT])
def test_a_solution_is_known_of_every_scenario(name):
    known = known_bounds()
    scenarios = [one for one in suite(name).scenarios if one.seed < 50]
    assert [one.key for one in scenarios if known[one.key].best is None] == []
