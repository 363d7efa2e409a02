"""Whatever is given wrongly is refused by one clear error."""

import math

import numpy as np
import pytest
from pushing_scenes import SQUARE, make_world

from pushplan.planners.pushing import (
    Bumper,
    Face,
    PushingMpc,
    PushModel,
    PushParameters,
    PushPath,
    face_towards,
)
from pushplan.world import InvalidInputError, Twist, area_clearing_robot

ROBOT = area_clearing_robot()
WORLD = make_world(ROBOT, [-3.0, 0.0, 0.0], [[0.0, 0.0, 0.0]])
PATH = PushPath.straight((0.0, 0.0), (3.0, 0.0))
FRICTION = PushParameters()
MODEL = PushModel(ROBOT, SQUARE)
STATE = MODEL.state([0.0, 0.0, 0.0], [2.0, 0.0, 0.0])

WRONG = {
    "no pose": (lambda: PushPath([]), "two poses"),
    "one pose": (lambda: PushPath([[0, 0, 0]]), "two poses"),
    "a pose that is no number": (lambda: PushPath([[0, 0, 0], [math.nan, 0, 0]]), "finite"),
    "no pieces": (lambda: PushPath.arcs([0, 0, 0], None), "pieces"),
    "pieces without curvature": (lambda: PushPath.arcs([0, 0, 0], [1.0]), "pieces"),
    "plan without robot": (lambda: PATH.plan(None, 0), "RobotModel"),
    "plan of no box": (lambda: PATH.plan(ROBOT, "x"), "box_id"),
    "controller config": (lambda: PushingMpc(3), "PushingConfig"),
    "controller world": (lambda: PushingMpc().command(None, PATH.plan(ROBOT, 0)), "World"),
    "controller path": (lambda: PushingMpc().command(WORLD, PATH), "Plan"),
    "model robot": (lambda: PushModel(None, SQUARE), "RobotModel"),
    "model friction": (lambda: PushModel(ROBOT, SQUARE, 0.4), "PushParameters"),
    "model face": (lambda: PushModel(ROBOT, SQUARE, FRICTION, 3), "Face"),
    "model outline": (lambda: PushModel(ROBOT, SQUARE + 5.0), "centroid"),
    "offset nan": (lambda: MODEL.stable_curvature(math.nan), "offset"),
    "predict from nothing": (lambda: MODEL.rows(None, [[1, 0]], 0.1), "PushState"),
    "steps that do not match": (lambda: MODEL.rows(STATE, [[1, 0]], [0.1, 0.2]), "dt"),
    "bumper without width": (lambda: Bumper(0.3, 0.0, 0.0), "half"),
    "bumper nan": (lambda: Bumper(math.nan, 1.0, 0.0), "front"),
    "bumper of nothing": (lambda: Bumper.of(None), "RobotModel"),
    "face without width": (lambda: Face(0.0, 0.5, 0.0, 0.0), "high"),
    "face of a point": (lambda: face_towards(np.zeros((1, 2)), 0.0), "outline"),
    "face towards nan": (lambda: face_towards(SQUARE, math.nan), "direction"),
}


@pytest.mark.parametrize("name", WRONG)
def test_it_is_refused(name):
    call, words = WRONG[name]
    with pytest.raises(InvalidInputError, match=words):
        call()


def test_boxes_that_are_not_there_are_left_alone():
    assert PushingMpc().command(WORLD, PATH.plan(ROBOT, 77)) == Twist(0.0, 0.0)
