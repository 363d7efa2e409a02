"""Checks of many outlines at once, against those of one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.world import InvalidInputError
from pushplan.world.outline import (
    areas_and_centroids,
    centroid,
    convex_outline,
    convex_outlines,
    flatten,
    signed_area,
    well_formed,
)

coordinates = st.integers(-3, 3).map(float)
outlines = st.lists(
    st.lists(st.tuples(coordinates, coordinates), min_size=0, max_size=6), min_size=0, max_size=5
)


def is_good(corners):
    try:
        return np.array_equal(convex_outline("outline", corners), corners)
    except InvalidInputError:
        return False


@settings(max_examples=60)
@given(outlines)
def test_the_same_are_well_formed(many):
    points = [np.array(corners).reshape(-1, 2) for corners in many]
    flags = well_formed(*flatten(points))
    assert flags.tolist() == [is_good(corners) for corners in points]
    good = [corners for corners, flag in zip(points, flags, strict=True) if flag]
    areas, centres = areas_and_centroids(*flatten(good))
    np.testing.assert_allclose(areas, [signed_area(corners) for corners in good])
    if good:
        np.testing.assert_allclose(centres, [centroid(corners) for corners in good], atol=1e-12)


def test_bad_ones_are_named():
    square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    found = convex_outlines("floe", [square, square[::-1]])
    assert all(signed_area(corners) == 1.0 for corners in found)
    arrow = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.2], [1.0, 2.0]]
    with pytest.raises(InvalidInputError, match="floe 1 must be convex"):
        convex_outlines("floe", [square, arrow])
    with pytest.raises(InvalidInputError, match="floe 2 must have at least 3 corners"):
        convex_outlines("floe", [square, square, square[:2]])
    assert convex_outlines("floe", []) == []
    assert well_formed(np.zeros((2, 2)), np.array([0, 0, 2])).tolist() == [False, False]
