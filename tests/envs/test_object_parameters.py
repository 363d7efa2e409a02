"""Masses, limit surfaces, friction and casters as variations, and what a policy is told."""

from dataclasses import replace

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.envs.registry import TASKS
from pushplan.envs.simulators import pymunk_simulator
from pushplan.envs.simulators.pymunk_bodies import PymunkBodies
from pushplan.geometry import gyration_squares
from pushplan.world import ScenarioError, UnknownNameError

ROBOT = 8  # contype of its geoms in mujoco_scene.xml
VARIED = {
    "mass_scale": 3.0,
    "mass_spread": 2.0,
    "gyration_spread": 1.5,
    "bumper_friction": 0.25,
    "friction_spread": 3.0,
}


def environment(task, simulator="pymunk", **variations):
    if task == "office":
        variations.setdefault("polygons", 100)  # of the smallest; a thousand take most of a second
    return PushEnv(task=task, simulator=simulator, observation="state", variations=variations)


def started(*args, seed=3, **variations):
    env = environment(*args, **variations)
    env.reset(seed=seed)
    return env


@pytest.fixture
def pymunk_bodies(monkeypatch):
    """The bodies that Pymunk was last given."""
    made = []

    class Kept(PymunkBodies):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            made.append(self)

    monkeypatch.setattr(pymunk_simulator, "PymunkBodies", Kept)
    return lambda: made[-1]


@pytest.mark.parametrize("task", list(TASKS))
def test_pymunk_simulates_what_is_asked_for(task, pymunk_bodies):
    plain = started(task).true_world.movables
    env = started(task, **VARIED)
    objects = env.true_world.movables
    bodies = pymunk_bodies()
    lib = bodies._lib
    assert np.array_equal(objects.poses, plain.poses)
    masses = [lib.cpBodyGetMass(body) for body, _ in bodies._objects]
    moments = [lib.cpBodyGetMoment(body) for body, _ in bodies._objects]
    assert np.array_equal(masses, objects.masses)
    np.testing.assert_allclose(moments, objects.masses * objects.gyration_radii**2)
    factors = objects.masses / (3.0 * plain.masses)
    assert (factors >= 0.5).all() and (factors <= 2.0).all()
    assert len(np.unique(factors.round(9))) == len(factors)
    scales = objects.gyration_radii / np.sqrt(gyration_squares(plain))
    assert (scales >= 1.0 / 1.5).all() and (scales <= 1.5).all() and (scales != 1.0).all()
    (shape, *_) = bodies._objects[0][1]
    pair = bodies._robot_shapes[0].friction * lib.cpShapeGetFriction(shape)
    assert 0.25 / 3.0 < pair < 0.75 and pair != 0.25


@pytest.mark.parametrize("task", list(TASKS))
def test_mujoco_simulates_what_is_asked_for(task):
    env = started(task, "mujoco", ground_friction=0.5, **VARIED)
    plain = started(task, "mujoco").true_world.movables
    objects = env.true_world.movables
    bodies = env._simulator._scene
    model = bodies.model
    assert np.array_equal(objects.poses, plain.poses)
    assert [model.body(f"object {k}").mass[0] for k in range(len(objects))] == pytest.approx(
        objects.masses
    )
    factors = objects.masses / (3.0 * plain.masses)
    assert (factors >= 0.5).all() and (factors <= 2.0).all() and (factors != 1.0).all()
    ground = model.geom("ground").friction[0]
    robot = model.geom_friction[model.geom_contype == ROBOT, 0]
    assert 0.5 / 3.0 < ground < 1.5 and ground != 0.5
    assert (robot > 0.25 / 3.0).all() and (robot < 0.75).all() and (robot != 0.25).all()


@pytest.mark.parametrize("simulator", ["pymunk", "mujoco"])
@pytest.mark.parametrize("task", ["maze", "namo", "box_delivery", "area_clearing", "room"])
def test_a_share_of_the_objects_stands_on_casters(task, simulator):
    for share in (0.0, 0.5, 1.0):
        env = started(task, simulator, wheeled=share)
        wheeled = env.true_world.movables.wheeled
        assert wheeled.sum() == round(share * len(wheeled))
        assert np.array_equal(env.world.movables.wheeled, wheeled)


def test_floes_in_water_have_no_casters():
    with pytest.raises(ScenarioError, match="ship_ice: wheeled must be 0 in a preset with water"):
        PushEnv(task="ship_ice", preset="full_scale", variations={"wheeled": 0.5})


def test_the_same_seed_gives_the_same_bytes_and_another_one_others():
    def parameters(seed):
        env = started("area_clearing", seed=seed, **VARIED)
        objects = env.true_world.movables
        rows = [objects.masses, objects.gyration_radii, objects.poses.ravel()]
        return np.concatenate(rows).tobytes(), env._simulator._materials

    assert parameters(5) == parameters(5)
    assert parameters(5)[0] != parameters(6)[0]
    assert parameters(5)[1] != parameters(6)[1]


def test_a_draw_of_one_kind_does_not_change_the_others():
    alone = started("room", mass_spread=2.0).true_world.movables
    both = started("room", mass_spread=2.0, gyration_spread=1.5, wheeled=0.5).true_world.movables
    assert np.array_equal(alone.masses, both.masses)


@pytest.mark.parametrize("task", list(TASKS))
def test_parameters_that_are_unknown_are_told_as_the_preset_has_them(task):
    plain = started(task).world.movables
    env = started(task, parameters="unknown", **VARIED)
    for _ in range(2):
        told = env.world.movables
        true = env.true_world.movables
        assert np.array_equal(told.masses, plain.masses)
        assert np.array_equal(told.gyration_radii, plain.gyration_radii)
        assert np.array_equal(told.poses, true.poses) and np.array_equal(told.twists, true.twists)
        assert (true.masses != plain.masses).all()
        env.step(env.action_space.sample())
    known = started(task, **VARIED)
    assert known.world is known.true_world


def test_objects_that_leave_the_floor_leave_what_is_told_too():
    env = started("box_delivery", parameters="unknown", mass_spread=2.0)
    true = env.true_world
    left = replace(true, movables=true.movables.select(np.arange(1, 10)))
    told = env.task.told(left).movables
    assert told.ids.tolist() == list(range(1, 10))
    assert np.array_equal(told.poses, left.movables.poses)


def test_wrong_movability_is_told_beside_unknown_parameters():
    env = started("namo", layout="fixed", movability="wrong", parameters="unknown", mass_scale=2.0)
    true = env.true_world.movables
    assert np.array_equal(env.world.movables.fixed, ~true.fixed)
    assert np.array_equal(2.0 * env.world.movables.masses, true.masses)


@pytest.mark.parametrize("task", list(TASKS))
@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("mass_scale", 0.0),
        ("mass_scale", float("nan")),
        ("mass_scale", "heavy"),
        ("mass_spread", 0.5),
        ("mass_spread", float("inf")),
        ("gyration_spread", -1.0),
        ("friction_spread", "2"),
        ("bumper_friction", -0.1),
        ("object_friction", float("nan")),
        ("wall_friction", "rough"),
        ("ground_friction", -1.0),
        ("wheeled", 1.5),
        ("parameters", "guessed"),
    ],
)
def test_a_value_that_makes_no_sense_is_one_clear_error(task, name, bad):
    with pytest.raises(ScenarioError, match=f"^{task}: .*{name}"):
        environment(task, **{name: bad})


def test_a_wrong_name_is_one_error_too():
    with pytest.raises(UnknownNameError, match="did you mean 'mass_spread'"):
        environment("maze", mas_spread=2.0)


def test_only_planar_simulators_have_limit_surfaces_to_draw():
    flat = started("maze", gyration_spread=2.0).true_world.movables
    solid = started("maze", "mujoco", gyration_spread=2.0).true_world.movables
    assert flat.gyration_radii.all() and not solid.gyration_radii.any()
