"""Contact parameters from pushes: recovered where they are known, robust, and never made up."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.interaction import (
    ContactParameters,
    ObservedPush,
    QuasiStatic,
    find_pushes,
    identify,
    support_gyration,
)
from pushplan.planners import make_policy
from pushplan.runtime import Runner
from pushplan.world import (
    Episode,
    InvalidInputError,
    Movables,
    RobotModel,
    SchemaError,
    StaticMap,
    UnknownNameError,
)

ANGLES = np.arange(12) * math.tau / 12
FINGER = RobotModel.from_outline(
    0.01 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]),
    mass=1.0,
    drive="differential",
    max_speed=0.1,
    max_turn_rate=1.0,
)
SQUARE = 0.05 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
CORNERS = math.sqrt(3.0)  # of the gyration of a square that stands on its corners


def pushes_by(
    model: QuasiStatic,
    count: int,
    rng: np.random.Generator,
    noise: float = 0.0,
    static: StaticMap | None = None,
) -> list[ObservedPush]:
    """Pushes of 4 cm at random places and angles of one side, as a model predicts them."""
    made = []
    for _ in range(count):
        place = rng.uniform(-0.04, 0.04)
        angle = rng.uniform(-0.6, 0.6)
        ways = np.linspace(0.0, 0.04, 5)[:, None] * [math.cos(angle), math.sin(angle)]
        path = np.column_stack([np.add(ways, [-0.061, place]), np.zeros(5)])
        push = ObservedPush(FINGER, SQUARE, path, np.zeros(3), np.zeros(3), static)
        end = push.predicted(model) + noise * rng.standard_normal(3) * [1.0, 1.0, 1.0 / 0.04]
        made.append(ObservedPush(FINGER, SQUARE, path, np.zeros(3), end, static))
    return made


@pytest.mark.slow
@settings(max_examples=2)
@given(
    friction=st.floats(0.1, 0.55),  # beyond the steepest push none slides
    scale=st.floats(0.5, 1.9),
    seed=st.integers(0, 10_000),
)
def test_parameters_are_recovered_from_noisy_pushes(
    friction: float, scale: float, seed: int
) -> None:
    model = QuasiStatic(friction, scale)
    rng = np.random.default_rng(seed)
    found = identify(pushes_by(model, 12, rng, noise=5e-4))
    assert found.gyration_scale == pytest.approx(scale, rel=0.15)
    assert abs(found.friction - friction) < max(0.12, 4.0 * found.deviations[0])
    fresh = pushes_by(model, 10, rng)
    misses = [push.miss(push.predicted(found.model())) for push in fresh]
    untaught = [push.miss(push.predicted(QuasiStatic())) for push in fresh]
    assert np.mean(misses) < max(0.0012, 0.5 * np.mean(untaught))


def test_the_same_pushes_give_the_same_bytes() -> None:
    pushes = pushes_by(QuasiStatic(0.3, 1.2), 4, np.random.default_rng(1))
    assert identify(pushes) == identify(pushes)


def test_two_wild_pushes_of_twelve_change_little() -> None:
    rng = np.random.default_rng(3)
    pushes = pushes_by(QuasiStatic(0.4, 1.4), 12, rng, noise=3e-4)
    clean = identify(pushes)
    for k in (2, 7):
        wild = np.add(pushes[k].object_after, [0.03, -0.05, 1.0])
        pushes[k] = ObservedPush(FINGER, SQUARE, pushes[k].robot_poses, np.zeros(3), wild)
    found = identify(pushes)
    assert found.gyration_scale == pytest.approx(clean.gyration_scale, rel=0.1)
    assert found.friction == pytest.approx(clean.friction, rel=0.25)


def test_more_pushes_make_surer() -> None:
    rng = np.random.default_rng(5)
    pushes = pushes_by(QuasiStatic(0.3, 1.2), 8, rng, noise=1e-3)
    few = identify(pushes[:2])
    many = identify(pushes)
    prior = ContactParameters()
    assert (many.deviations[:2] < few.deviations[:2]).all()
    assert few.deviations[1] < prior.deviations[1]
    assert many.static_friction == prior.static_friction and not many.saw_walls
    assert many.deviations[2] == prior.deviations[2]


def test_friction_at_a_wall_is_found_where_a_push_touched_it() -> None:
    wall = StaticMap.build(
        [[(-0.5, 0.0501), (0.5, 0.0501), (0.5, 0.2), (-0.5, 0.2)]], bounds=(-1, -1, 1, 1)
    )
    model = QuasiStatic(0.5, 1.0, static_friction=0.25)
    rng = np.random.default_rng(0)
    pushes = pushes_by(model, 8, rng, noise=1e-4, static=wall)
    found = identify(pushes)
    assert found.saw_walls
    assert found.static_friction == pytest.approx(0.25, abs=0.1)


def test_outlines_that_overlap_in_contact_are_corrected() -> None:
    thin = ContactParameters(overlap=0.004).fitted(FINGER)
    assert thin.circumscribed_radius == pytest.approx(0.006, rel=0.05)
    thick = ContactParameters(overlap=-0.004).fitted(FINGER)
    assert thick.circumscribed_radius == pytest.approx(0.014, rel=0.05)
    least = ContactParameters(overlap=1.0).fitted(FINGER)
    assert 0.0 < least.circumscribed_radius < 0.002
    pushes = pushes_by(QuasiStatic(0.4, 1.0), 8, np.random.default_rng(2))
    found = identify(
        [
            ObservedPush(
                ContactParameters(overlap=-0.003).fitted(FINGER),
                SQUARE,
                push.robot_poses,
                push.object_before,
                push.object_after,
            )
            for push in pushes
        ]
    )
    assert found.overlap == pytest.approx(0.003, abs=5e-4)
    assert found.gyration_scale == pytest.approx(1.0, rel=0.1)


def test_a_zigzag_of_rounded_places_does_not_count() -> None:
    line = np.linspace([-0.061, 0.02, 0.0], [-0.03, 0.03, 0.0], 300)
    push = ObservedPush(FINGER, SQUARE, np.round(line, 4), np.zeros(3), np.zeros(3))
    assert len(push.path()) <= 3
    bent = np.vstack([line, line[-1] + [0.0, 0.01, 0.0]])
    assert len(ObservedPush(FINGER, SQUARE, bent, np.zeros(3), np.zeros(3)).path()) == 3


def test_samples_have_the_spread_of_the_parameters() -> None:
    prior = ContactParameters.prior("metal on wood")
    drawn = prior.samples(500, np.random.default_rng(0))
    logs = np.log([one.values for one in drawn])
    assert np.cov(logs.T) == pytest.approx(prior.log_covariance, abs=0.05)
    assert drawn[0].deviations == pytest.approx([0.0, 0.0, 0.0])


def test_priors_know_materials_and_supports() -> None:
    prior = ContactParameters.prior("wood on metal", SQUARE, "corners")
    assert prior.friction == pytest.approx(math.sqrt(0.2 * 0.6))
    assert prior.gyration_scale == pytest.approx(CORNERS)
    # c = 0.383 s and I / m = s^2 / 6 for a square of side s
    assert support_gyration(SQUARE, "evenly") == pytest.approx(0.3826 * math.sqrt(6.0), rel=1e-3)
    three = [[-0.02, -0.02], [0.04, -0.02], [-0.02, 0.04]]
    assert support_gyration(SQUARE, three) == pytest.approx(
        np.mean(np.hypot(*np.transpose(three))) / (0.1 / math.sqrt(6.0))
    )
    unequal = [[-0.04, -0.04], [0.04, -0.02], [-0.04, 0.08]]  # carry 1/4, 1/2 and 1/4
    weighted = np.hypot(*np.transpose(unequal)) @ [0.25, 0.5, 0.25]
    assert support_gyration(SQUARE, unequal) == pytest.approx(weighted / (0.1 / math.sqrt(6.0)))


def test_what_makes_no_sense_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="at least one push"):
        identify([])
    with pytest.raises(InvalidInputError, match="at least two poses"):
        ObservedPush(FINGER, SQUARE, [[0.0, 0.0, 0.0]], np.zeros(3), np.zeros(3))
    with pytest.raises(InvalidInputError, match="object_after"):
        ObservedPush(FINGER, SQUARE, np.zeros((2, 3)), np.zeros(3), [0.0, math.nan, 0.0])
    with pytest.raises(InvalidInputError, match="wood on cheese"):
        ContactParameters.prior("wood on cheese")
    with pytest.raises(InvalidInputError, match="evenly"):
        ContactParameters.prior(outline=SQUARE, support="upright")
    with pytest.raises(InvalidInputError, match="around the object's centre"):
        support_gyration(SQUARE, [[0.01, 0.0], [0.02, 0.0], [0.01, 0.01]])


def test_parameters_are_kept_in_a_file(tmp_path: Path) -> None:
    found = identify(pushes_by(QuasiStatic(0.3, 1.2), 4, np.random.default_rng(1)))
    (tmp_path / "contact.json").write_text(json.dumps(found.to_dict()))
    assert ContactParameters.load(tmp_path / "contact.json") == found
    (tmp_path / "other.json").write_text('{"friction": 0.2}')
    with pytest.raises(SchemaError, match="gyration_scale"):
        ContactParameters.load(tmp_path / "other.json")


@pytest.mark.parametrize("name", ["push-aware", "kinodynamic-rrt", "namo", "mppi", "gtsp-mpc"])
def test_policies_and_runners_take_them(name: str) -> None:
    contact = ContactParameters(0.21, 1.31, 0.41)
    policy = make_policy(name, interaction=contact.model())
    with Runner(name, period=0.1, contact=contact) as runner:
        driven = getattr(runner.policy, "_policy", runner.policy)
        for one in (policy, driven):
            planner = getattr(one, "planner", None)
            model = getattr(planner, "interaction", None) or one.config
            assert (model.friction, model.gyration_scale, model.static_friction) == (
                0.21,
                1.31,
                0.41,
            )


def test_policies_that_predict_nothing_refuse_them() -> None:
    contact = ContactParameters()
    with pytest.raises(UnknownNameError, match="interaction"):
        make_policy("straight", interaction=contact.model())
    with pytest.raises(InvalidInputError, match="policy with contact"):
        Runner(make_policy("push-aware"), period=0.1, contact=contact)
    with pytest.raises(UnknownNameError):
        make_policy("nobody", interaction=contact.model())


def recorded(model: QuasiStatic, noise: float = 0.0) -> Episode:
    """A robot that pushes one of two boxes, waits, and pushes it again from another side."""
    rng = np.random.default_rng(0)
    paths = [
        np.linspace([-0.1, 0.02, 0.0], [0.1, 0.05, 0.0], 80),
        np.linspace([0.3, 0.4, -1.6], [0.3, 0.4, -1.6], 10),
    ]
    start = ObservedPush(FINGER, SQUARE, paths[0], np.zeros(3), np.zeros(3)).world()
    objects = Movables.from_outlines([SQUARE, SQUARE], [[0, 0, 0], [1, 1, 0]], ids=[4, 9])
    world = replace(start, movables=objects)
    first = model.sweep(world, paths[0]).object_poses
    rest = np.repeat(first[-1:], len(paths[1]), axis=0)
    x, y, _ = first[-1, 0]
    third = np.linspace([x + 0.02, y + 0.15, 0.0], [x - 0.02, y - 0.05, 0.0], 80)
    last = model.sweep(world.moved(movable_poses=first[-1]), third).object_poses
    poses = np.concatenate([first, rest, last])
    poses += noise * rng.standard_normal(poses.shape)
    return Episode(
        world=world,
        times=0.1 * np.arange(len(poses)),
        robot_poses=np.concatenate([*paths, third]),
        object_poses=poses,
        success=False,
        reason="time_limit",
    )


def test_pushes_are_found_in_a_log_and_give_the_parameters() -> None:
    pushes = find_pushes(recorded(QuasiStatic(0.4, 1.5)))
    assert 4 <= len(pushes) <= 8  # two pushes of about two radii each, cut
    moved = [np.linalg.norm(push.object_after - push.object_before) for push in pushes]
    assert min(moved) > 0.003
    found = identify(pushes)
    assert found.friction == pytest.approx(0.4, abs=0.1)
    assert found.gyration_scale == pytest.approx(1.5, rel=0.1)
    assert len(find_pushes(recorded(QuasiStatic(0.4, 1.5)), [4])) == len(pushes)


def test_noise_of_objects_at_rest_is_no_push() -> None:
    pushes = find_pushes(recorded(QuasiStatic(0.4, 1.5), noise=2e-4))
    assert 3 <= len(pushes) <= 10
    assert identify(pushes).gyration_scale == pytest.approx(1.5, rel=0.25)


def test_a_log_without_what_is_asked_for_says_so() -> None:
    episode = recorded(QuasiStatic(0.4, 1.5))
    with pytest.raises(InvalidInputError, match="no object 7, its objects: 4, 9"):
        find_pushes(episode, [7])
    with pytest.raises(InvalidInputError, match="holds no push"):
        find_pushes(episode, [9])
