"""Sweeping a path in portions, so that a call can end in between and a changed path starts late."""

from __future__ import annotations

from collections.abc import Callable

from pushplan.core import interaction as core
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import World
from pushplan.world.checks import FloatArray

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

    A model that the core does not have is asked anew for each portion.
    """
    model = interaction
    if model is None:
        model = default_interaction(world)
    masses = world.movables.masses
    if isinstance(model, IceInteraction):
        ice = model.bodies(world)
        settings = model.settings(world)
        margin = MARGIN * world.robot.circumscribed_radius

        def sweep_floes(
            path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray
        ) -> bool:
            core.sweep_near(path, poses, ice, *settings, margin, out, works)
            return True

        return sweep_floes
    if isinstance(model, QuasiStatic):
        contacts = model.compiled(world)

        def sweep_objects(
            path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray
        ) -> bool:
            jammed = contacts.sweep(path, poses, out)
            core.step_works(out, masses, works)
            return jammed < 0

        return sweep_objects

    def ask_model(path: FloatArray, poses: FloatArray, out: FloatArray, works: FloatArray) -> bool:
        swept = model.sweep(
            world.moved(robot_pose=path[0], robot_twist=(0, 0, 0), movable_poses=poses), path
        )
        out[:] = swept.object_poses
        poses[:] = out[-1]
        core.step_works(out, masses, works)
        return swept.jammed_at < 0

    return ask_model
