"""MuJoCo, whose import fails if the environment variable ``MUJOCO_GL`` names no usable OpenGL."""

from __future__ import annotations

import os

from pushplan.world import MissingDependencyError

_PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}
"""Packages of Debian that bring a kind of OpenGL."""


def no_opengl(cause: object, otherwise: str = "") -> MissingDependencyError:
    """Our error about a missing OpenGL: it names what to install or to set.

    Args:
        cause: text or error that says what is wrong with it.
        otherwise: what can be done without.
    """
    given = os.environ.get("MUJOCO_GL", "")
    kind = given.strip().lower()
    asked = "that draws without a display"
    remedies = []
    if packages := _PACKAGES.get(kind or "egl"):
        remedies.append(f"install it (Debian: apt-get install {packages})")
    if given:
        asked = f"with MUJOCO_GL={given}"
        remedies.append(f"unset MUJOCO_GL{'' if kind == 'egl' else ' or set it to egl'}")
    return MissingDependencyError(
        f"MuJoCo finds no OpenGL {asked}: {', or '.join(remedies)}{otherwise} ({cause})"
    )


try:
    import mujoco
except ModuleNotFoundError:
    raise
except Exception as error:  # PyOpenGL raises errors of many kinds
    if not os.environ.get("MUJOCO_GL"):
        raise
    raise no_opengl(error) from error

__all__ = ["mujoco", "no_opengl"]
