"""Models in compiled form: those of the core, C functions, and what only has ``sweep``."""

import ctypes
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import make_u_maze, scattered_boxes
from scipy import LowLevelCallable

from pushplan.interaction import Interaction, QuasiStatic
from pushplan.interaction.compiled_model import (
    CompiledInteraction,
    SweptModel,
    called_model,
    compile_interaction,
)
from pushplan.planners import make_planner
from pushplan.world import InvalidInputError, MaxIterations, Movables, World

POINTER = ctypes.POINTER(ctypes.c_double)
AS_C = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_int64, POINTER, POINTER, POINTER, POINTER
)


@AS_C
def carry(user_data, count, robot_from, robot_to, poses, lengths):
    dx = robot_to[0] - robot_from[0]
    dy = robot_to[1] - robot_from[1]
    for k in range(count):
        poses[3 * k] += dx
        poses[3 * k + 1] += dy
        lengths[k] += np.sqrt(dx * dx + dy * dy)
    return robot_to[0] < 20.0  # it jams beyond


@AS_C
def raise_all(user_data, count, robot_from, robot_to, poses, lengths):
    height = ctypes.cast(user_data, POINTER)[0]
    for k in range(count):
        poses[3 * k + 1] += height
    return True


@pytest.fixture
def world() -> World:
    return make_u_maze(scattered_boxes(3, 1))


def step(model, world, robot_from, robot_to):
    poses = world.movables.poses.copy()
    lengths = np.zeros(len(poses))
    went = model.advance(np.array(robot_from), np.array(robot_to), poses, lengths)
    return went, poses, lengths


@pytest.mark.parametrize(
    "given", [carry, LowLevelCallable(carry), SimpleNamespace(ctypes=carry)]
)  # the last as a numba.cfunc has it
def test_a_c_function_is_a_model(given, world):
    model = called_model(given, world)
    went, poses, lengths = step(model, world, [1.0, 1.0, 0.0], [1.3, 1.4, 0.0])
    assert went and model.tests == 1
    np.testing.assert_allclose(poses - world.movables.poses, [[0.3, 0.4, 0.0]] * 3, atol=1e-12)
    np.testing.assert_allclose(lengths, 0.5)
    assert not step(model, world, [1.0, 1.0, 0.0], [21.0, 1.4, 0.0])[0]


def test_user_data_reaches_the_function(world):
    height = np.array([0.25])
    data = height.ctypes.data_as(ctypes.c_void_p)
    model = called_model(LowLevelCallable(raise_all, data), world)
    _, poses, _ = step(model, world, [1.0, 1.0, 0.0], [1.1, 1.0, 0.0])
    np.testing.assert_allclose(poses[:, 1] - world.movables.poses[:, 1], 0.25)


@pytest.mark.parametrize("given", [3, len, "carry"])
def test_what_is_no_c_function_is_refused(given, world):
    with pytest.raises(InvalidInputError, match=r"LowLevelCallable.*got"):
        called_model(given, world)


def core_step(world: World):
    """`QuasiStatic` behind a C function of our own."""
    model = QuasiStatic().compiled(world)

    def advance(_, count, robot_from, robot_to, poses, lengths):
        ends = [np.ctypeslib.as_array(pose, (3,)) for pose in (robot_from, robot_to)]
        objects = np.ctypeslib.as_array(poses, (count, 3))
        return model.advance(*ends, objects, np.ctypeslib.as_array(lengths, (count,)))

    return AS_C(advance)


@dataclass(frozen=True)
class Called:
    def sweep(self, world, path) -> Interaction:
        return QuasiStatic().sweep(world, path)

    def compiled(self, world):
        return called_model(core_step(world), world)


def test_plans_are_those_of_the_model_behind_the_function(world):
    assert isinstance(Called(), CompiledInteraction)
    stop = MaxIterations(400)
    plans = [
        make_planner("kinodynamic-rrt", interaction=model)
        .plan(world, stop=stop, rng=np.random.default_rng(2))
        .plan
        for model in (QuasiStatic(), Called())
    ]
    # shortcuts are given up after some work, which each model counts in its own way
    assert plans[0].cost == pytest.approx(plans[1].cost, rel=0.05)


class Spoilt:
    def sweep(self, world, path) -> Interaction:
        if len(path) == 2 and path[1, 0] > 12.0:
            raise ZeroDivisionError("here")
        return QuasiStatic().sweep(world, path)


def test_a_model_that_has_only_sweep_is_asked_for_each_step(world):
    model = compile_interaction(Spoilt(), world)
    assert isinstance(model, SweptModel)
    path = [np.array([11.25, 3.75, 0.0]), np.array([11.35, 3.75, 0.0])]
    swept = QuasiStatic().sweep(world, np.array(path))
    went, poses, lengths = step(model, world, *path)
    assert went
    np.testing.assert_array_equal(poses, swept.object_poses[-1])
    np.testing.assert_array_equal(lengths, swept.lengths)
    model.raise_error()
    for _ in range(2):
        assert not step(model, world, path[0], [12.1, 3.75, 0.0])[0]
    with pytest.raises(ZeroDivisionError, match="here"):
        model.raise_error()
    model.raise_error()


def test_it_is_asked_where_there_is_nothing_to_push(world):
    alone = make_u_maze(movables=Movables.empty())
    model = compile_interaction(Spoilt(), alone)
    assert step(model, alone, [11.25, 3.75, 0.0], [11.35, 3.75, 0.0])[0]


@pytest.mark.release
def test_the_example_of_the_documentation(world):
    pytest.importorskip("numba")
    page = Path(__file__).parents[2].joinpath("docs/interaction.md").read_text(encoding="utf-8")
    scope: dict[str, object] = {}
    exec(page.split("```python\n")[1].split("```")[0], scope)
    towed = scope["Towed"]()
    assert isinstance(towed, CompiledInteraction)
    _, _, lengths = step(towed.compiled(world), world, [1.0, 1.0, 0.0], [1.3, 1.4, 0.0])
    np.testing.assert_allclose(lengths, 0.5)
