"""What an approach and a push would come to together, by the interaction model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pushplan.interaction.kernels import sweep_path
from pushplan.planners.rearrangement.places import length_of, lengths_of
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.route import Route, Router
from pushplan.planners.rearrangement.runner import Runner


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """A push with the way to it.

    Args:
        price: of both [m]; inf where the push would not do what it is for.
        route: the way to its start.
        push: what it is predicted to do after that way.
    """

    price: float
    route: Route
    push: Push


def rehearse(router: Router, runner: Runner, route: Route, push: Push) -> Rehearsal:
    """Drive the way and the push in the interaction model."""
    scene = router.scene
    path = router.poses_along(route)
    poses = scene.poses.copy()
    out = np.empty((len(path), len(poses), 3))
    jammed = sweep_path(path, poses, scene.bodies, scene.settings, out)
    if jammed >= 0:
        return Rehearsal(np.inf, route, push)
    length = length_of(path[:, :2])
    ends = runner.again(push, path[-1], poses=poses, spent=lengths_of(out))
    good = [end for end in ends if push.frees or set(push.covers) <= set(end.covers)]
    if not good:
        return Rehearsal(np.inf, route, push)
    return Rehearsal(length + good[0].price, route, good[0])
