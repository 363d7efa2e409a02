"""Curves of Dubins, and of Reeds and Shepp, against OMPL's."""

from __future__ import annotations

import numpy as np
import pytest
from ompl import base

from pushplan.core import motion as core

SPACES = {False: base.DubinsStateSpace, True: base.ReedsSheppStateSpace}


@pytest.mark.parametrize("radius", [0.1, 1.3, 7.0])
@pytest.mark.parametrize("reverses", SPACES)
def test_lengths_and_ends_agree_with_ompl(reverses, radius):
    space = SPACES[reverses](radius)
    bounds = base.RealVectorBounds(2)
    bounds.setLow(-100)
    bounds.setHigh(100)
    space.setBounds(bounds)
    first, second = space.allocState(), space.allocState()
    rng = np.random.default_rng(0)
    pieces, poses, curvatures = np.zeros((5, 2)), np.zeros((5000, 3)), np.zeros(5000)
    for _ in range(1000):
        start = np.array([*rng.uniform(-4, 4, 2), rng.uniform(-4, 4)])
        end = np.array([*rng.uniform(-4, 4, 2), rng.uniform(-4, 4)])
        for state, pose in ((first, start), (second, end)):
            state.setX(pose[0])
            state.setY(pose[1])
            state.setYaw(pose[2])
        length = core.shortest_curve(start, end, radius, reverses, pieces)
        assert length == pytest.approx(space.distance(first, second), abs=1e-9)
        assert length == pytest.approx(np.abs(pieces[:, 0]).sum())
        assert reverses or (pieces[:, 0] >= 0.0).all()
        count = core.sample_pieces(start, pieces, 0.05 * radius, poses, curvatures)
        miss = poses[count - 1] - end
        miss[2] = (miss[2] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(miss).max() < 1e-9 * max(1, radius)
        assert np.abs(curvatures[:count]).max() <= 1 / radius + 1e-12


@pytest.mark.parametrize("reverses", SPACES)
def test_equal_poses_need_no_path(reverses):
    pieces = np.full((5, 2), np.nan)
    pose = np.array([1.0, 2.0, 0.5])
    length = core.shortest_curve(pose, pose, 1.0, reverses, pieces)
    assert length == pytest.approx(0.0, abs=1e-6)
    assert np.isfinite(pieces).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_car_that_may_reverse_shifts_sideways_by_cusps(side):
    pieces = np.empty((5, 2))
    end = np.array([0.0, 0.2 * side, 0.0])
    forward = core.shortest_curve(np.zeros(3), end, 1.0, False, pieces)
    length = core.shortest_curve(np.zeros(3), end, 1.0, True, pieces)
    assert length < 0.3 * forward
    assert (np.sign(pieces[pieces[:, 0] != 0.0, 0]) < 0.0).any()


def test_a_quarter_turn():
    end = np.empty(3)
    core.along_arc(np.zeros(3), np.pi / 2, 1.0, end)
    assert end == pytest.approx([1.0, 1.0, np.pi / 2])
