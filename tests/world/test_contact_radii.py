"""Contact radii: what is drawn, what touches, and what survives a file."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import SQUARE, make_robot, make_u_maze

from pushplan.interaction import QuasiStatic
from pushplan.world import (
    ClearanceArea,
    InvalidInputError,
    Movables,
    World,
    world_from_dict,
    world_to_dict,
)
from pushplan.world.outline import grown_outline, grown_outlines
from pushplan.world.stored.world_files import movables_from_list, robot_from_dict

TRIANGLE = np.array([(0.4, 0.0), (-0.2, 0.3), (-0.2, -0.3)])
HALF = 0.5 * np.ptp(SQUARE, axis=0)[0]


def objects(radii: list[float]) -> Movables:
    shapes = [TRIANGLE if k % 2 else SQUARE for k in range(len(radii))]
    poses = [(3.0 * k, 9.0, 0.1 * k) for k in range(len(radii))]
    return Movables.from_outlines(shapes, poses, contact_radii=radii)


def scene(radii: list[float], robot_radius: float) -> World:
    robot = make_robot(contact_radius=robot_radius)
    return make_u_maze(movables=objects(radii), robot=robot)


def test_outlines_grow_and_masses_do_not() -> None:
    plain, grown = objects([0.0, 0.0]), objects([0.0, 0.1])
    np.testing.assert_array_equal(grown.masses, plain.masses)
    np.testing.assert_array_equal(grown.outline(0), plain.outline(0))
    np.testing.assert_array_equal(grown.outline(1), grown_outline(TRIANGLE, 0.1))
    np.testing.assert_array_equal(grown.drawn_parts(1)[0], TRIANGLE)
    assert grown.radii[1] > plain.radii[1] + 0.1 and grown != plain
    assert plain.vertices is plain.drawn_vertices
    robot = make_robot(contact_radius=0.05)
    np.testing.assert_array_equal(robot.vertices, grown_outline(robot.parts[0], 0.05))
    assert robot.inscribed_radius == pytest.approx(make_robot().inscribed_radius + 0.05)


def test_many_outlines_grow_as_each_does() -> None:
    movables = objects([0.0, 0.1, 0.02, 0.3])
    drawn = movables.drawn_vertices, movables.drawn_offsets
    vertices, offsets = grown_outlines(*drawn, movables.contact_radii)
    for k, radius in enumerate(movables.contact_radii.tolist()):
        alone = grown_outline(movables.drawn_parts(k)[0], radius)
        expected = movables.drawn_parts(k)[0] if radius == 0.0 else alone
        np.testing.assert_array_equal(vertices[offsets[k] : offsets[k + 1]], expected)


@pytest.mark.parametrize("radii", [[0.0, 0.0], [0.02, 0.0], [1 / 30, 1 / 70]])
def test_radii_survive_json_and_older_files_load(radii: list[float]) -> None:
    world = scene(radii, radii[0])
    data = json.loads(json.dumps(world_to_dict(world)))
    assert world_from_dict(data) == world
    assert ("contact_radius" in data["robot"]) == (radii[0] > 0.0)
    for item in data["movables"]:
        item.pop("contact_radius", None)
    data["robot"].pop("contact_radius", None)
    assert world_from_dict(data) == scene([0.0, 0.0], 0.0)


def test_messages_of_the_policy_server_carry_them() -> None:
    data = world_to_dict(scene([0.02, 0.03], 0.04))
    assert robot_from_dict(data["robot"])[0].contact_radius == 0.04
    assert movables_from_list(data["movables"]).contact_radii.tolist() == [0.02, 0.03]


def test_changes_keep_them() -> None:
    movables = objects([0.0, 0.1, 0.2])
    moved = movables.moved_to(movables.poses + 1.0)
    np.testing.assert_array_equal(moved.vertices, movables.vertices)
    assert movables.select([2, 0]).contact_radii.tolist() == [0.2, 0.0]
    np.testing.assert_array_equal(movables.select([1]).vertices, movables.outline(1))
    other = replace(movables.select([1]), contact_radii=np.array([0.3]))
    after = movables.updated(other)
    assert after.contact_radii.tolist() == [0.0, 0.3, 0.2]
    np.testing.assert_array_equal(after.outline(1), grown_outline(TRIANGLE, 0.3))


def test_goals_look_at_what_is_drawn() -> None:
    area = ClearanceArea(SQUARE, [True] * 4)
    box = Movables.from_outlines([SQUARE], [[2.0 * HALF + 0.01, 0.0, 0.0]], contact_radii=0.1)
    assert make_u_maze(movables=box, goal=area).completed.tolist() == [True]


def test_the_interaction_model_pushes_from_the_radii_on() -> None:
    robot = make_robot(contact_radius=0.02)
    nose = float(robot.parts[0][:, 0].max())
    box = Movables.from_outlines([SQUARE], [[11.0, 8.0, 0.0]], contact_radii=0.03)
    world = make_u_maze(movables=box, robot=robot)
    first = 11.0 - HALF - nose - 0.05  # where they touch
    path = np.array([(x, 8.0, 0.0) for x in (first - 0.1, first - 1e-4, first + 0.2)])
    poses = QuasiStatic().sweep(world, path).object_poses[:, 0]
    np.testing.assert_allclose(poses[:, 0], [11.0, 11.0, 11.2], atol=2e-3)


@pytest.mark.parametrize("bad", [-0.1, np.nan, np.inf])
def test_what_makes_no_sense_is_refused(bad: float) -> None:
    with pytest.raises(InvalidInputError, match="contact_radi"):
        objects([bad])
    with pytest.raises(InvalidInputError, match=r"robot\.contact_radius"):
        make_robot(contact_radius=bad)
    with pytest.raises(InvalidInputError, match="less than the number of parts, 1, got 1"):
        make_robot(wheel_parts=1)
