"""Sweeping a path in portions, so that a call can end in between and a changed path starts late."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.compiled import kernel, owned
from pushplan.interaction.ice_bodies import IceBodies, IceSettings, ice_problem, select_bodies
from pushplan.interaction.ice_contacts import sweep_ice
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.interaction.kernels import sweep_path
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import World
from pushplan.world.checks import FloatArray


@kernel
def add_works(out: FloatArray, masses: FloatArray, works: FloatArray) -> None:
    """Work on K objects from each of N poses to the next [kg m], from (N, K, 3) ``out``."""
    for n in range(works.shape[0]):
        works[n] = 0.0
        for k in range(masses.shape[0]):
            dx = out[n + 1, k, 0] - out[n, k, 0]
            dy = out[n + 1, k, 1] - out[n, k, 1]
            works[n] += masses[k] * np.sqrt(dx * dx + dy * dy)


@kernel(allocates=True)
def sweep_near(
    path: FloatArray,  # (N, 3) poses of the hull
    poses: FloatArray,  # (K, 3) poses of the objects, changed in place
    bodies: IceBodies,
    settings: IceSettings,
    margin: float,  # greatest distance from the hull of an object that is looked at [m]
    out: FloatArray,  # (N, K, 3) receives the poses at each path pose
    works: FloatArray,  # (N - 1,) receives the work from each pose to the next [kg m]
) -> None:
    """`sweep_ice` with those objects only that are near a short path; the rest stays."""
    middle = path[path.shape[0] // 2]
    dx = path[:, 0] - middle[0]
    dy = path[:, 1] - middle[1]
    reach = np.sqrt((dx * dx + dy * dy).max()) + bodies.hull_radius + margin
    gx = poses[:, 0] - middle[0]
    gy = poses[:, 1] - middle[1]
    far = reach + bodies.radii
    chosen = np.flatnonzero(gx * gx + gy * gy < far * far)
    part = select_bodies(bodies, chosen)
    here = poses[chosen]
    moved = np.empty((path.shape[0], chosen.shape[0], 3))
    sweep_ice(path, here, ice_problem(part, settings), moved)
    add_works(moved, part.masses, works)
    for n in range(path.shape[0]):
        out[n] = poses
        out[n][chosen] = moved[n]
    poses[chosen] = here


MARGIN = 1.0
"""Distance from the hull up to which a sweep looks at objects [circumscribed radii]."""


PathSweeper = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], bool]
"""Carries the objects along a portion of a path; False where the robot jams.

It takes (N, 3) robot poses; (K, 3) objects at the first of them, which it changes into those at the
last; (N, K, 3) for the objects at each pose; and (N - 1,) for the work from each pose to the next
[kg m].
"""


def default_interaction(world: World) -> InteractionModel:
    """`IceInteraction` in open water, `QuasiStatic` where there are walls."""
    if world.static.convex_parts:
        return QuasiStatic(friction=1.0)
    return IceInteraction()


def path_sweeper(world: World, interaction: InteractionModel | None = None) -> PathSweeper:
    """The sweeper for a model, by default `default_interaction`.

    A model that has no kernels is asked anew for each portion.
    """
    model = interaction
    if model is None:
        model = default_interaction(world)
    masses = owned(world.movables.masses)
    if isinstance(model, IceInteraction):
        ice = model.bodies(world)
        ice_settings = model.settings(world)
        margin = MARGIN * world.robot.circumscribed_radius

        def sweep_floes(
            path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray
        ) -> bool:
            sweep_near(path, poses, ice, ice_settings, margin, out, works)
            return True

        return sweep_floes
    if isinstance(model, QuasiStatic):
        bodies = model.bodies(world)
        settings = model.settings(world)

        def sweep_objects(
            path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray
        ) -> bool:
            jammed = int(sweep_path(path, poses, bodies, settings, out))
            add_works(out, masses, works)
            return jammed < 0

        return sweep_objects

    def ask_model(path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        swept = model.sweep(
            world.moved(robot_pose=path[0], robot_twist=(0, 0, 0), movable_poses=poses), path
        )
        out[:] = swept.object_poses
        poses[:] = out[-1]
        add_works(out, masses, works)
        return swept.jammed_at < 0

    return ask_model
