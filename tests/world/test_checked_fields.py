from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest

import pushplan.evaluation
import pushplan.planners
from pushplan.imports.on_demand import look_up
from pushplan.world import InvalidInputError, UnknownNameError
from pushplan.world.checked_fields import (
    CheckedFields,
    Each,
    Fraction,
    Limits,
    NonNegativeFloat,
    OneOf,
    PositiveInt,
)


@dataclass(frozen=True)
class Settings(CheckedFields):
    field_prefix = "test "

    speed: NonNegativeFloat = 0.5
    rounds: PositiveInt = 3
    fraction: Fraction | None = None
    careful: bool = True
    kind: Annotated[str, OneOf(("fast", "slow"))] = "fast"
    turn: Annotated[float, Limits(-1.0, 1.0, open_low=True)] = 0.0
    free: tuple[int, ...] = ()
    names: Annotated[tuple[str, ...], Each(least=0)] = ()
    sides: Annotated[tuple[float, float], Each(Limits(0.0))] = (1.0, 1.0)
    counts: Annotated[tuple[int, ...], Each(Limits(1))] = (1,)


@dataclass(frozen=True)
class MoreSettings(Settings):
    speed: NonNegativeFloat = 0.7
    size: Annotated[int, Limits(2, 4)] = 2


def test_values_become_what_the_type_says():
    made = Settings(speed=2, rounds=np.int64(4), fraction=np.float64(0.25), careful=np.bool_(False))
    kinds = [type(value) for value in (made.speed, made.rounds, made.fraction, made.careful)]
    assert kinds == [float, int, float, bool]
    assert Settings(fraction=None).fraction is None
    made = Settings(names=["a"], sides=[2, 3], counts=(np.int64(4), 5))  # type: ignore[arg-type]
    assert (made.names, made.sides, made.counts) == (("a",), (2.0, 3.0), (4, 5))
    assert [type(value) for value in (*made.sides, *made.counts)] == [float, float, int, int]
    assert Settings(free="whatever").free == "whatever"  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "bad, text",
    [
        ({"speed": -1.0}, r"test speed must lie in \[0, inf\), got -1"),
        ({"speed": float("nan")}, r"test speed must lie in \[0, inf\), got nan"),
        ({"speed": None}, "test speed must be a number"),
        ({"rounds": 0}, "test rounds must be at least 1, got 0"),
        ({"rounds": 1.5}, "test rounds must be a whole number"),
        ({"fraction": 1.5}, r"test fraction must lie in \[0, 1\]"),
        ({"careful": 1}, "test careful must be true or false, got 1"),
        ({"kind": "fsat"}, "fast"),
        ({"turn": -1.0}, r"test turn must lie in \(-1, 1\]"),
        ({"names": "ab"}, "test names must be a list of names, got 'ab'"),
        ({"names": [3]}, r"test names\[0\] must be"),
        ({"sides": (1.0,)}, r"test sides must be a list of 2 numbers, got \(1.0,\)"),
        ({"sides": (1.0, -1.0)}, r"test sides\[1\] must lie in \[0, inf\), got -1"),
        ({"counts": []}, r"test counts must be a list of one or more numbers, got \[\]"),
    ],
)
def test_an_error_names_field_value_and_rule(bad, text):
    with pytest.raises(InvalidInputError, match=text):
        Settings(**bad)


def test_a_subclass_checks_its_own_fields_and_those_of_its_base():
    assert MoreSettings().speed == 0.7
    for bad in ({"size": 5}, {"rounds": 0}):
        with pytest.raises(InvalidInputError):
            MoreSettings(**bad)


def test_every_lazy_name_can_be_imported():
    for package in (pushplan.evaluation, pushplan.planners):
        assert set(dir(package)) == set(package.__all__)
        assert all(getattr(package, name) is not None for name in package.__all__)
        with pytest.raises(AttributeError, match="no attribute 'nothing'"):
            _ = package.nothing


def test_a_table_of_names_is_looked_up():
    table = {"one": "math:inf"}
    assert look_up("number", table, "one") == float("inf")
    for name in ("on", 1):
        with pytest.raises(UnknownNameError, match="unknown number"):
            look_up("number", table, name)
