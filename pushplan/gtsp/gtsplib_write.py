"""Writing GTSPLIB files, and reading and writing tours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.gtsp.distances import LARGEST_DIMENSION
from pushplan.gtsp.gtsplib import read_text
from pushplan.gtsp.instance import GtspInstance
from pushplan.world.checks import integer

_LONGEST_WHOLE = 1e15
"""Whole numbers below this are written without a decimal point, as other programs read them."""


def write_gtsp(path: str | Path, instance: GtspInstance) -> None:
    """Write an instance so that `read_gtsp` gives the same one.

    Explicit costs are written as a full matrix with all their digits. A forbidden arc is written
    as ``inf``, which TSPLIB has no word for: put a large number there for other programs.

    Args:
        path: of the file.
        instance: what to write.

    Raises:
        InvalidInputError: if the file cannot be written.
    """
    symmetric = np.array_equal(instance.costs, instance.costs.T)
    lines = [
        f"NAME: {instance.name}",
        f"TYPE: {'GTSP' if symmetric else 'AGTSP'}",
        *([f"COMMENT: {instance.comment}"] if instance.comment else []),
        f"DIMENSION: {len(instance.costs)}",
        f"GTSP_SETS: {len(instance.clusters)}",
        f"EDGE_WEIGHT_TYPE: {instance.weight_type}",
    ]
    if instance.coordinates is None:
        lines += ["EDGE_WEIGHT_FORMAT: FULL_MATRIX", "EDGE_WEIGHT_SECTION"]
        lines += [" ".join(map(_text, row)) for row in instance.costs]
    else:
        lines += ["NODE_COORD_SECTION"]
        lines += [
            f"{node} {_text(x)} {_text(y)}"
            for node, (x, y) in enumerate(instance.coordinates, start=1)
        ]
    lines += ["GTSP_SET_SECTION"]
    lines += [
        " ".join(map(str, (number, *(node + 1 for node in nodes), -1)))
        for number, nodes in enumerate(instance.clusters, start=1)
    ]
    _write(path, [*lines, "EOF"])


def write_tour(path: str | Path, nodes: Sequence[int], *, name: str = "tour") -> None:
    """Write a tour as a TSPLIB tour file; nodes are numbered from 1 in it.

    Args:
        path: of the file.
        nodes: in visiting order, from 0.
        name: what it is called; one line.

    Raises:
        InvalidInputError: if there is no node or the file cannot be written.
    """
    order = [integer("tour node", node, low=0) + 1 for node in nodes]
    if not order:
        raise InvalidInputError("a tour file needs at least one node")
    if len(name.splitlines()) > 1:
        raise InvalidInputError(f"tour name must be one line of text, got {name!r}")
    head = [f"NAME: {name}", "TYPE: TOUR", f"DIMENSION: {len(order)}", "TOUR_SECTION"]
    _write(path, [*head, *map(str, order), "-1", "EOF"])


def read_tour(path: str | Path) -> tuple[int, ...]:
    """Read a TSPLIB tour file.

    Returns:
        The nodes in visiting order, from 0.

    Raises:
        InvalidInputError: if the file cannot be read.
        SchemaError: if it breaks a rule of the format; file, line and rule are named.
    """
    text = read_text(path)
    text.choice("TYPE", ("TOUR",))
    begin, _ = text.section("TOUR_SECTION")
    nodes: dict[int, None] = {}
    ended = False
    for line, value in text.whole_numbers("TOUR_SECTION"):
        if ended:
            raise text.wrong(line, f"expected nothing after -1, got {value}")
        if value == -1:
            ended = True
        elif value < 1:
            raise text.wrong(line, f"nodes are numbered from 1, got {value}")
        elif value - 1 in nodes:
            raise text.wrong(line, f"node {value} is visited twice")
        else:
            nodes[value - 1] = None
    if not nodes:
        raise text.wrong(begin, "the tour has no node")
    if "DIMENSION" in text.keywords:
        count = text.count("DIMENSION", LARGEST_DIMENSION)
        if count != len(nodes):
            raise text.wrong(begin, f"expected {count} nodes, as DIMENSION says, got {len(nodes)}")
    text.name_unused()
    return tuple(nodes)


def _text(value: float) -> str:
    number = float(value)
    if number.is_integer() and abs(number) < _LONGEST_WHOLE:
        return str(int(number))
    return repr(number)


def _write(path: str | Path, lines: Iterable[str]) -> None:
    try:
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error}") from error
