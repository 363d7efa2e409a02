"""Dubins paths against OMPL's."""

from __future__ import annotations

import numpy as np
import pytest
from ompl import base

from pushplan.core import motion as core


@pytest.mark.parametrize("radius", [0.1, 1.3, 7.0])
def test_lengths_and_ends_agree_with_ompl(radius):
    space = base.DubinsStateSpace(radius)
    bounds = base.RealVectorBounds(2)
    bounds.setLow(-100)
    bounds.setHigh(100)
    space.setBounds(bounds)
    first, second = space.allocState(), space.allocState()
    rng = np.random.default_rng(0)
    pieces, poses, bends = np.zeros((3, 2)), np.zeros((5000, 3)), np.zeros(5000)
    for _ in range(1000):
        start = np.array([*rng.uniform(-4, 4, 2), rng.uniform(-4, 4)])
        end = np.array([*rng.uniform(-4, 4, 2), rng.uniform(-4, 4)])
        for state, pose in ((first, start), (second, end)):
            state.setX(pose[0])
            state.setY(pose[1])
            state.setYaw(pose[2])
        length = core.dubins(start, end, radius, pieces)
        assert length == pytest.approx(space.distance(first, second), abs=1e-9)
        count = core.sample_pieces(start, pieces, 0.05 * radius, poses, bends)
        miss = poses[count - 1] - end
        miss[2] = (miss[2] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(miss).max() < 1e-9 * max(1, radius)
        assert np.abs(bends[:count]).max() <= 1 / radius + 1e-12


def test_equal_poses_need_no_path():
    pieces = np.full((3, 2), np.nan)
    pose = np.array([1.0, 2.0, 0.5])
    assert core.dubins(pose, pose, 1.0, pieces) == pytest.approx(0.0, abs=1e-6)
    assert np.isfinite(pieces).all()


def test_a_quarter_turn():
    end = np.empty(3)
    core.along_arc(np.zeros(3), np.pi / 2, 1.0, end)
    assert end == pytest.approx([1.0, 1.0, np.pi / 2])
