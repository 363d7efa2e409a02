"""The same scene and commands in both simulators end at the same places, within stated bounds."""

import numpy as np
import pytest

from benchmarks.accuracy import parity


@pytest.mark.parametrize("case", parity.CASES, ids=lambda case: case.name)
def test_single_pushes_agree(case):
    found, _, _ = parity.compare(case)
    straight = "straight" in case.name and "clipped" not in case.name
    assert found["robot"] < 0.035
    assert np.degrees(found["heading"]) < 6.5
    assert found["boxes"].max(initial=0.0) < (0.035 if straight else 0.095)
    flat, solid = found["work"]
    assert solid == pytest.approx(flat, rel=0.08, abs=0.06)
