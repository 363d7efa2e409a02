"""Pictures by MuJoCo's own camera."""

import gc
import os
import subprocess
import sys
import weakref

import numpy as np
import pytest
from mujoco_scenes import GROUND, SEA, built, room, sea

from pushplan.envs import PushEnv
from pushplan.envs.simulators import mujoco_camera
from pushplan.world import InvalidInputError, MissingDependencyError, Twist


@pytest.fixture(scope="module")
def can_draw():
    try:
        built(room()).photograph(64, 48)
    except MissingDependencyError as error:
        pytest.skip(str(error))


def test_picture_shows_the_scene_and_follows_the_robot(can_draw):
    simulator = built(room([(0.5, 0.5, 0.2), (-0.5, 0.5, 0.1)], wheeled=[1]))
    before = simulator.photograph(320, 240)
    assert before.shape == (240, 320, 3) and before.dtype == np.uint8
    blue = (before[..., 2] > before[..., 0].astype(int) + 60).sum()
    green = (before[..., 1] > before[..., 0].astype(int) + 10).sum()
    assert blue > 50 and green > 20  # robot and goal
    np.testing.assert_array_equal(simulator.photograph(320, 240), before)
    for _ in range(8):
        simulator.step(Twist(0.2, 0.0), 0.2)
    after = simulator.photograph(320, 240)
    assert (after != before).any(axis=2).sum() > 100


def test_a_picture_changes_nothing(can_draw):
    world = sea([(60.0, 0.0, 0.1), (90.0, 5.0, 0.3)])
    one, other = built(world, SEA), built(world, SEA)
    for _ in range(10):
        one.step(Twist(2.0, 0.0), 4.0)
        other.step(Twist(2.0, 0.0), 4.0)
        other.photograph(64, 64)
        assert one.save() == other.save()


def test_environment_renders_it(can_draw):
    env = PushEnv(task="maze", simulator="mujoco", observation="state", render_mode="camera")
    env.reset(seed=0)
    assert env.render().shape == (480, 640, 3)


def test_camera_is_freed_with_the_simulator(can_draw):
    simulator = built(room())
    simulator.photograph(64, 48)
    camera = weakref.ref(simulator._camera)
    finalizer = simulator._camera._finalizer
    del simulator
    gc.collect()
    assert camera() is None and not finalizer.alive
    built(room()).photograph(64, 48)  # and another one works


def test_sizes_are_checked():
    simulator = built(room())
    for size in ((0, 10), (64, 100_000), (64.5, 48)):
        with pytest.raises(InvalidInputError, match="photograph"):
            simulator.photograph(*size)


def test_missing_graphics_say_what_to_install(monkeypatch):
    def broken(*arguments):
        raise AttributeError("no library")

    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setattr(mujoco_camera.mujoco, "GLContext", broken)
    with pytest.raises(MissingDependencyError, match="libegl1"):
        built(room(), GROUND).photograph(64, 48)


RUN = ["-m", "pushplan", "run", "maze-3d-3", "--policy", "straight", "--seed", "1"]
MAKE = """
from pushplan.envs import PushEnv
env = PushEnv(task="maze", simulator="mujoco", observation="state", render_mode="camera")
env.reset(seed=0)
env.render()
"""


@pytest.mark.parametrize(
    ("backend", "command", "told"),
    [
        ("osmesa", RUN, "apt-get install libosmesa6), or unset MUJOCO_GL or set it to egl"),
        (
            "OSMesa",
            ["-c", MAKE],
            "apt-get install libosmesa6), or unset MUJOCO_GL or set it to egl",
        ),
        ("bogus", RUN, "MUJOCO_GL=bogus: unset MUJOCO_GL or set it to egl"),
        ("off", ["-c", MAKE], "MUJOCO_GL=off: unset MUJOCO_GL or set it to egl"),
        ("glfw", ["-c", MAKE], "MUJOCO_GL=glfw: unset MUJOCO_GL or set it to egl"),
    ],
)
def test_a_backend_that_is_not_there_is_named_with_a_way_on(tmp_path, backend, command, told):
    broken = tmp_path / "OpenGL"
    broken.mkdir()
    (broken / "__init__.py").touch()
    (broken / "GL.py").write_text("None.glGetError\n")  # as PyOpenGL ends without its library
    environ = {**os.environ, "MUJOCO_GL": backend, "PYTHONPATH": str(tmp_path)}
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "PYOPENGL_PLATFORM"):
        environ.pop(name, None)
    done = subprocess.run(
        [sys.executable, *command], env=environ, capture_output=True, text=True, timeout=120
    )
    *before, last = done.stderr.splitlines()
    assert told in last, done.stderr
    if command is RUN:
        assert done.returncode == 2 and not before
    else:
        assert last.startswith("pushplan.errors.MissingDependencyError: ")
        assert "GLFWError" not in done.stderr
