"""Inputs are checked before the core sees them: no argument ends the process, or reads too far."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import core_calls
import numpy as np
import pytest
from core_doors import Door, make_doors, wrong_values

from pushplan import core
from pushplan.errors import LONGEST_MESSAGE, InvalidInputError
from pushplan.world import PushplanError

ROOMS = sorted(name for name in core.__all__ if isinstance(getattr(core, name), ModuleType))


def call_wrongly(rooms: list[str], random_calls: int, log: Path) -> None:
    """Call all that some rooms bind in a process of its own, which has to live."""
    done = subprocess.run(
        [sys.executable, core_calls.__file__, ",".join(rooms), str(random_calls), str(log)],
        capture_output=True,
        text=True,
        check=False,
    )
    last = log.read_text().strip() if log.exists() else ""
    assert done.returncode == 0, f"in {last}: {done.stderr[-3000:]}"
    for room, counts in zip(rooms, json.loads(done.stdout), strict=True):
        assert counts["invalid"] == [], f"{room}: valid calls are refused"
        # each parameter is refused in several ways
        assert counts["refusals"] > 5 * counts["parameters"], room
        assert counts["results"] > random_calls / 10, room


@pytest.mark.slow
@pytest.mark.parametrize("first", range(3))
def test_wrong_arguments_of_bindings_are_refused_or_give_a_result(
    first: int, tmp_path: Path
) -> None:
    call_wrongly(ROOMS[first::3], 100, tmp_path / "log")


@pytest.mark.slow
@pytest.mark.parametrize("room", ROOMS)
def test_thousands_of_wrong_calls_are_refused_or_give_a_result(room: str, tmp_path: Path) -> None:
    call_wrongly([room], 20_000, tmp_path / "log")


def test_every_binding_is_called() -> None:
    """No function or class of a room escapes the test above."""
    for room in ROOMS:
        module = getattr(core, room)
        called = {signature.name.split(".")[1] for signature in core_calls.signatures_of(module)}
        for name, bound in vars(module).items():
            if isinstance(bound, type) and not hasattr(bound.__init__, "__nb_signature__"):
                continue  # others make it
            assert name in called or not callable(bound) or name.startswith("_"), f"{room}.{name}"


def test_what_is_left_out_is_bound() -> None:
    names = {
        signature.name
        for room in ROOMS
        for signature in core_calls.signatures_of(getattr(core, room))
    }
    for left_out in core_calls.TABLES_OF_ONE_MAKER:
        assert any(f"{name}.".startswith(f"{left_out}.") for name in names), left_out


def test_a_refusal_names_the_argument_its_value_and_the_rule() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    out = np.zeros((3, 2))
    offsets = np.array([0, 4])
    with pytest.raises(InvalidInputError, match="offsets must be from 1 to 3, got 4"):
        core.geometry.transform_outlines(np.zeros((1, 3)), square, offsets, out)
    with pytest.raises(InvalidInputError, match="out must be at least 3 in number, got 2"):
        core.geometry.transform_points(np.zeros(3), square, out[:2])


DOORS = make_doors()


@pytest.mark.filterwarnings("ignore")  # of NumPy, of strange values
@pytest.mark.parametrize("name", DOORS)
def test_public_doors_give_a_result_or_one_clear_line(name: str) -> None:
    door: Door = DOORS[name]
    door.call(**door.valid)
    refused = 0
    for argument, right in door.valid.items():
        for wrong in wrong_values(right):
            try:
                door.call(**{**door.valid, argument: wrong})
            except PushplanError as error:
                message = str(error)
                assert "\n" not in message and 10 < len(message) <= LONGEST_MESSAGE
                refused += 1
            except BaseException as error:
                error.add_note(f"{argument} = {wrong!r:.200}")
                raise
    assert refused >= 5 * len(door.valid)
