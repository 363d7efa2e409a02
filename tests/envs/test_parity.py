"""The same scene and commands in both simulators end at the same places, within stated bounds."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "parity.py"
_spec = importlib.util.spec_from_file_location("parity_benchmark", BENCHMARK)
parity = importlib.util.module_from_spec(_spec)
sys.modules["parity_benchmark"] = parity
_spec.loader.exec_module(parity)


@pytest.mark.parametrize("case", parity.CASES, ids=lambda case: case.name)
def test_single_pushes_agree(case):
    found, _, _ = parity.compare(case)
    straight = "straight" in case.name and "clipped" not in case.name
    assert found["robot"] < 0.035
    assert np.degrees(found["heading"]) < 6.5
    assert found["boxes"].max(initial=0.0) < (0.035 if straight else 0.095)
    flat, solid = found["work"]
    assert solid == pytest.approx(flat, rel=0.08, abs=0.06)
