"""Motion primitives of state lattices, and the bound on the way to a line."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.core import motion as core
from pushplan.motion.state_lattice.lattice_builder import dubins_to_line
from pushplan.motion.state_lattice.primitives import PrimitiveConfig, generate, primitives
from pushplan.world import InvalidInputError


@pytest.mark.parametrize("headings", [8, 16, 32])
@pytest.mark.parametrize("radius", [2.0, 6.0, 11.5])
def test_primitives_join_lattice_states(headings: int, radius: float) -> None:
    motions = generate(PrimitiveConfig(headings, radius))
    assert (np.diff(motions.first) >= 1).all()
    for p in range(len(motions)):
        pose = np.array([0.0, 0.0, motions.angles[motions.heading_of(p)]])
        for length, bend in motions.pieces[p]:
            assert abs(bend) <= 1.0 / radius + 1e-12
            core.along_arc(pose.copy(), length, bend, pose)
        x, y, heading = motions.ends[p]
        assert pose[:2] == pytest.approx([x, y], abs=1e-6)
        turn = pose[2] - motions.angles[heading]
        assert abs((turn + np.pi) % (2 * np.pi) - np.pi) < 1e-6


def test_a_set_is_made_once() -> None:
    made = primitives(PrimitiveConfig(8, 4.0))
    assert made == generate(PrimitiveConfig(8, 4.0))
    assert primitives(PrimitiveConfig(8, 4.0)) is made


def test_config_is_checked() -> None:
    with pytest.raises(InvalidInputError):
        PrimitiveConfig(headings=7)
    with pytest.raises(InvalidInputError):
        PrimitiveConfig(radius=float("nan"))


@settings(max_examples=25)
@given(
    heading=st.floats(-3.1, 3.1),
    distance=st.floats(0.01, 20.0),
    bends=st.lists(st.floats(-1.0, 1.0), min_size=200, max_size=200),
)
def test_no_drivable_path_is_shorter_than_the_bound(
    heading: float, distance: float, bends: list[float]
) -> None:
    pose = np.array([0.0, 0.0, heading])
    bound = float(dubins_to_line(np.array(distance), np.array(heading), 1.0))
    for k, bend in enumerate(bends):
        # half of the steps steer home, so that some paths are nearly the shortest
        turn = bend if k % 2 else -np.sign(pose[2])
        core.along_arc(pose.copy(), 0.1, float(turn), pose)
        if pose[0] >= distance:
            assert 0.1 * (k + 1) >= bound - 1e-6
            return
