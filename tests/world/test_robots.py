import numpy as np
import pytest
import shapely

from pushplan.world import (
    BUMPERS,
    Drive,
    InvalidInputError,
    UnknownNameError,
    area_clearing_robot,
    box_delivery_robot,
    jackal,
    maze_robot,
    turtlebot3_burger,
)

EVERY = [
    *(turtlebot3_burger(bumper) for bumper in BUMPERS),
    *(jackal(bumper) for bumper in BUMPERS),
    maze_robot(),
    box_delivery_robot(),
    area_clearing_robot(),
]


def silhouette(robot):
    return shapely.union_all([shapely.Polygon(part) for part in robot.parts])


@pytest.mark.parametrize("robot", EVERY, ids=lambda robot: f"{robot.name}-{len(robot.parts)}")
def test_footprints_are_in_one_piece_and_mirror_symmetric(robot):
    shape = silhouette(
        robot.__class__(
            parts=robot.parts, mass=1, drive="differential", max_speed=1, max_turn_rate=1
        )
    )
    assert shape.buffer(1e-9).geom_type == "Polygon"
    mirrored = shapely.transform(shape, lambda xy: xy * [1.0, -1.0])
    assert shape.symmetric_difference(mirrored).area < 1e-12
    assert robot.inscribed_radius > 0.3 * robot.circumscribed_radius
    assert robot.parts[0][:, 0].min() == robot.vertices[:, 0].min()  # the chassis comes first


def test_dimensions_and_limits():
    burger = turtlebot3_burger()
    np.testing.assert_allclose(np.ptp(burger.vertices, axis=0), (0.138, 0.183))
    np.testing.assert_allclose(burger.vertices.mean(axis=0), 0.0, atol=1e-12)
    assert (burger.mass, burger.wheel_separation) == (1.07, 0.16)
    assert (burger.max_speed, burger.max_turn_rate, burger.min_speed) == (0.22, 2.84, -0.22)
    np.testing.assert_allclose(np.ptp(jackal().vertices, axis=0), (0.51, 0.43))
    assert maze_robot().circumscribed_radius == pytest.approx(0.86, abs=1e-3)
    np.testing.assert_allclose(np.ptp(box_delivery_robot().vertices, axis=0), (0.62, 1.06))
    np.testing.assert_allclose(np.ptp(area_clearing_robot().vertices, axis=0), (1.4, 2.4))
    slow = turtlebot3_burger("pusher", max_speed=0.1)
    assert (slow.max_speed, slow.min_speed) == (0.1, -0.1)
    steady = turtlebot3_burger(drive=Drive.CONSTANT_SPEED)
    assert steady.min_speed == steady.max_speed == 0.22


def test_bumpers_have_the_shapes_of_their_names():
    """Where the front edge is along y: hollow, straight, or bulging."""

    def reach(bumper, y):
        line = shapely.LineString([(0.0, y), (1.0, y)])
        return silhouette(turtlebot3_burger(bumper)).intersection(line).bounds[2]

    middle, side = 0.0, 0.095
    assert reach("collector", side) > reach("collector", middle) + 0.015
    assert reach("pusher", side) == pytest.approx(reach("pusher", middle)) == pytest.approx(0.099)
    assert reach("navigation", middle) > reach("navigation", side) + 0.02
    for bumper in BUMPERS[1:]:
        assert np.ptp(turtlebot3_burger(bumper).vertices[:, 1]) == pytest.approx(0.2)
        assert reach(bumper, middle) > 0.069


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: turtlebot3_burger("scoop"), InvalidInputError, "valid: collector, navigation"),
        (lambda: turtlebot3_burger(None), InvalidInputError, "unknown bumper None"),
        (lambda: turtlebot3_burger(drive="omni"), InvalidInputError, "differential"),
        (lambda: jackal(max_sped=1.0), UnknownNameError, "did you mean 'max_speed'"),
        (lambda: jackal(max_speed=float("nan")), InvalidInputError, "must lie in .0, inf.,"),
        (lambda: maze_robot(max_speed="fast"), InvalidInputError, "must be a number"),
    ],
)
def test_nonsense_is_refused(make, error, text):
    with pytest.raises(error, match=text):
        make()
