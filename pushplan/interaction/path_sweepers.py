"""Sweeping a path in portions, so that a call can end in between and a changed path starts late."""

from __future__ import annotations

from collections.abc import Callable

from pushplan.compiled import owned
from pushplan.interaction.ice import IceInteraction
from pushplan.interaction.kernels import sweep_path
from pushplan.interaction.model import InteractionModel
from pushplan.interaction.path_sweep_kernels import add_works, sweep_near
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import World
from pushplan.world.checks import FloatArray

MARGIN = 1.0
"""How far from the hull objects are that a sweep still looks at [circumscribed radii]."""


PathSweeper = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], bool]
"""Carries the objects along a portion of a path; False where the robot jams.

It takes (N, 3) robot poses; (K, 3) objects at the first of them, which it changes into those at the
last; (N, K, 3) for the objects at each pose; and (N - 1,) for the work from each pose to the next
[kg m].
"""


def default_interaction(world: World) -> InteractionModel:
    """`IceInteraction` in open water, `QuasiStatic` where there are walls."""
    return QuasiStatic(friction=1.0) if world.static.convex_parts else IceInteraction()


def path_sweeper(world: World, interaction: InteractionModel | None = None) -> PathSweeper:
    """The sweeper for a model, by default `default_interaction`.

    A model that has no kernels is asked anew for each portion.
    """
    model = default_interaction(world) if interaction is None else interaction
    masses = owned(world.movables.masses)
    if isinstance(model, IceInteraction):
        ice, ice_settings = model.bodies(world), model.settings(world)
        margin = MARGIN * world.robot.circumscribed_radius

        def sweep_floes(
            path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray
        ) -> bool:
            sweep_near(path, poses, ice, ice_settings, margin, out, works)
            return True

        return sweep_floes
    if isinstance(model, QuasiStatic):
        bodies, settings = model.bodies(world), model.settings(world)

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
