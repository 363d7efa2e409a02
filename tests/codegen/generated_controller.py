"""A controller written as C, compiled and called."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from pushplan.geometry.obstacles import obstacles_of
from pushplan.world import Plan, World

FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-ffp-contract=off"]
GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="gcc is not installed")

_DOUBLES, _INTS = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int)


class _Path(ctypes.Structure):
    _fields_ = [("count", ctypes.c_int), *((name, _DOUBLES) for name in ("poses", "at", "speeds"))]


class _Map(ctypes.Structure):
    _fields_ = [
        ("count", ctypes.c_int),
        ("vertices", _DOUBLES),
        ("offsets", _INTS),
        ("radii", _DOUBLES),
        ("boxes", _DOUBLES),
    ]


def run_gcc(*arguments: object) -> str:
    """Compile; what the compiler has to say is an error of the test."""
    done = subprocess.run([GCC, *FLAGS, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


class Generated:
    """Commands of the C in a folder; has the `command` of controllers in Python.

    Args:
        folder: with the written files.
        name: of the controller.
        pushes: index of the box among the movables, None for a tracker.
    """

    def __init__(self, folder: Path, name: str, pushes: int | None) -> None:
        library = folder / "controller.so"
        run_gcc("-shared", "-fPIC", "-o", library, folder / f"{name}.c", "-lm")
        loaded = ctypes.CDLL(str(library))
        size = folder / "size.c"
        size.write_text(
            f'#include "{name}.h"\n#include <stdio.h>\n'
            f'int main(void) {{ printf("%zu", sizeof({name})); return 0; }}\n'
        )
        run_gcc("-o", folder / "size", size)
        self.bytes = int(subprocess.check_output([folder / "size"]))
        """Size of the struct."""
        self._struct = ctypes.create_string_buffer(self.bytes)
        self._init, self._begin, self._step = (
            getattr(loaded, f"{name}_{what}") for what in ("init", "begin", "step")
        )
        self._pushes, self._plan = pushes, None
        self.out = np.zeros(2)

    def arguments(self, world: World, plan: Plan) -> tuple[object, ...]:
        """Arguments of a step; begins a path that is another than before."""
        poses = [np.array(world.robot_pose)]
        if self._pushes is not None:
            poses.append(np.array(world.movables.poses[self._pushes]))
        if self._plan is None:
            vx, vy, omega = world.robot_twist
            theta = world.robot_pose[2]
            speed = ctypes.c_double(vx * np.cos(theta) + vy * np.sin(theta))
            self._init(self._struct, speed, ctypes.c_double(omega))
        if plan is not self._plan:
            self._plan = plan
            self._kept = [np.array(part) for part in (plan.poses, plan.arc_lengths, plan.speeds)]
            self._path = _Path(len(plan.poses), *(_pointer(part) for part in self._kept))
            self._begin(self._struct, *(map(_pointer, poses) if len(poses) > 1 else ()))
        obstacles = []
        if self._pushes is not None:
            parts = obstacles_of(world.static)
            vertices, offsets, radii, boxes = (np.array(part) for part in parts)
            offsets = offsets.astype(np.int32)
            pointers = (_pointer(vertices), offsets.ctypes.data_as(_INTS))
            self._map = _Map(len(radii), *pointers, _pointer(radii), _pointer(boxes))
            self._arrays = (vertices, offsets, radii, boxes)
            obstacles = [ctypes.byref(self._map)]
        self._poses = poses
        time = ctypes.c_double(world.time)
        tail = (*(_pointer(pose) for pose in poses), _pointer(self.out))
        return (self._struct, ctypes.byref(self._path), *obstacles, time, *tail)

    def command(self, world: World, plan: Plan) -> np.ndarray:
        """(2,) speed [m/s] and turn rate [rad/s]."""
        self._step(*self.arguments(world, plan))
        return self.out.copy()


def _pointer(array: np.ndarray) -> object:
    return array.ctypes.data_as(_DOUBLES)
