"""GTSPLIB files and tours: TSPLIB 95 (Reinelt 1995) with a section for the clusters.

Keywords stand before the data; a colon after them is optional. Lines that begin with ``#`` are left
out, and so is the author after a type. An `UnusedInputWarning` names keywords and sections that are
not used. The short form of the solver GLNS is read too. Every complaint names the file, the line
and the rule that it breaks.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pushplan.errors import InvalidInputError, SchemaError, unknown_name_message
from pushplan.files import safe_files
from pushplan.gtsp.distances import COORDINATE_TYPES, LARGEST_DIMENSION
from pushplan.gtsp.instance import GtspInstance
from pushplan.world.checks import FloatArray, integer

TYPES = ("GTSP", "AGTSP", "TSP", "ATSP")
FORMATS = (
    "FULL_MATRIX",
    "LOWER_COL",
    "LOWER_DIAG_COL",
    "LOWER_DIAG_ROW",
    "LOWER_ROW",
    "UPPER_COL",
    "UPPER_DIAG_COL",
    "UPPER_DIAG_ROW",
    "UPPER_ROW",
)
_SECTIONS = (
    "DEMAND_SECTION",
    "DEPOT_SECTION",
    "DISPLAY_DATA_SECTION",
    "EDGE_DATA_SECTION",
    "EDGE_WEIGHT_SECTION",
    "FIXED_EDGES_SECTION",
    "GTSP_SET_SECTION",
    "NODE_COORD_SECTION",
    "TOUR_SECTION",
)
_KEYWORDS = (
    "COMMENT",
    "DIMENSION",
    "DISPLAY_DATA_TYPE",
    "EDGE_WEIGHT_FORMAT",
    "EDGE_WEIGHT_TYPE",
    "GTSP_SETS",
    "M",
    "N",
    "NAME",
    "NODE_COORD_TYPE",
    "TYPE",
)
Rows = list[tuple[int, list[str]]]
"""Lines as words, each with its number."""
_LONGEST_WHOLE = 1e15
"""Whole numbers below this are written without a decimal point, as other programs read them."""


@dataclass
class TsplibText:
    """The keywords and sections of a file, each with the line it stands in."""

    path: Path  # of the file
    # value and line number of each keyword
    keywords: dict[str, tuple[str, int]] = field(default_factory=dict)
    # the line number of its heading and what is below it
    sections: dict[str, tuple[int, Rows]] = field(default_factory=dict)
    # keywords and sections that nobody has asked for
    unread: set[str] = field(default_factory=set)

    def wrong(self, line: int, rule: str) -> SchemaError:
        """An error at a line."""
        return SchemaError(f"{self.path}, line {line}: {rule}")

    def value(self, key: str) -> tuple[str, int]:
        """The value of a keyword, and its line."""
        if key not in self.keywords:
            raise SchemaError(f"{self.path}: the keyword {key} is missing")
        self.unread.discard(key)
        return self.keywords[key]

    def choice(self, key: str, valid: tuple[str, ...]) -> str:
        """The value of a keyword, which must be one of these."""
        value, line = self.value(key)
        value = value.partition("(")[0].strip().upper()  # an author may follow
        if value not in valid:
            raise self.wrong(line, unknown_name_message(key, value, valid))
        return value

    def count(self, key: str, high: int) -> int:
        """The value of a keyword that counts something."""
        value, line = self.value(key)
        if value.isdecimal() and len(value) <= 18 and 1 <= int(value) <= high:
            return int(value)
        rule = f"{key} must be a whole number from 1 to {high}, got {value!r:.40}"
        raise self.wrong(line, rule)

    def section(self, name: str) -> tuple[int, Rows]:
        """Return the line at which a section begins, and its lines as words."""
        if name not in self.sections:
            raise SchemaError(f"{self.path}: the section {name} is missing")
        self.unread.discard(name)
        return self.sections[name]

    def whole_numbers(self, name: str) -> Iterator[tuple[int, int]]:
        """The line and the value of each word of a section."""
        for line, words in self.section(name)[1]:
            for word in words:
                yield line, self.whole(line, word)

    def name_unused(self) -> None:
        """Name what nobody has asked for, but for texts that only people read."""
        safe_files.name_unused(str(self.path), self.unread - {"NAME", "COMMENT"})

    def number(self, line: int, word: str) -> float:
        """A word as a number; NaN is none."""
        try:
            value = float(word)
        except ValueError:
            value = float("nan")
        if value != value:
            raise self.wrong(line, f"{word!r:.40} is not a number")
        return value

    def whole(self, line: int, word: str) -> int:
        """A word as a whole number."""
        try:
            return int(word if len(word) <= 18 else "too long")
        except ValueError:
            raise self.wrong(line, f"{word!r:.40} is not a whole number") from None


def read_text(path: str | Path) -> TsplibText:
    """Split a TSPLIB file into keywords and sections.

    Raises:
        SchemaError: if the file cannot be read, or a line is neither.
    """
    text = TsplibText(Path(path))
    data = safe_files.read_bytes(path, "instance", safe_files.MAX_TEXT)
    lines = data.decode("utf-8-sig", "replace").splitlines()  # names may be in any code
    rows: Rows | None = None
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        head = words[0].partition(":")[0].upper() or ":"
        if head == "EOF":
            break
        if head in text.sections or (head in text.keywords and head != "COMMENT"):
            raise text.wrong(number, f"{head} stands here a second time")
        if head in _SECTIONS:
            rows = []
            text.sections[head] = (number, rows)
            text.unread.add(head)
        elif head in _KEYWORDS:
            rest = line.strip()[len(head) :].strip()
            text.keywords[head] = (rest.removeprefix(":").strip(), number)
            text.unread.add(head)
            rows = None
        elif head[0].isalpha() and head not in ("INF", "INFINITY", "NAN"):
            meant = difflib.get_close_matches(head[:80], _KEYWORDS + _SECTIONS, n=1, cutoff=0.8)
            if meant or ":" not in line:
                rule = unknown_name_message("keyword", head, _KEYWORDS + _SECTIONS)
                raise text.wrong(number, rule)
            text.unread.add(head)
            rows = None
        elif rows is not None:
            rows.append((number, words))
        elif {"N", "M"} <= text.keywords.keys():
            rows = [(number, words)]
            text.sections["N"] = (number, rows)
        else:
            raise text.wrong(number, f"data outside of a section: {line.strip()[:40]!r}")
    return text


def _unfold(text: TsplibText) -> None:
    """Turn the short form of GLNS, a line for each set and then the matrix, into that of TSPLIB."""
    begin, rows = text.section("N")
    size, line = text.value("N")
    text.keywords |= {
        "TYPE": ("AGTSP", line),
        "DIMENSION": (size, line),
        "GTSP_SETS": text.value("M"),
        "EDGE_WEIGHT_TYPE": ("EXPLICIT", line),
        "EDGE_WEIGHT_FORMAT": ("FULL_MATRIX", line),
    }
    count = text.count("M", LARGEST_DIMENSION)
    sets = [(number, [*words, "-1"]) for number, words in rows[:count]]
    text.sections["GTSP_SET_SECTION"] = begin, sets
    text.sections["EDGE_WEIGHT_SECTION"] = begin, rows[count:]


def read_gtsp(path: str | Path) -> GtspInstance:
    """Read an instance.

    Weights may be EXPLICIT in any matrix format of TSPLIB, ``inf`` for a forbidden arc, or follow
    from coordinates: EUC_2D, CEIL_2D, MAN_2D, MAX_2D, ATT, GEO. Nodes are numbered from 1 in the
    file and from 0 in the result.

    Raises:
        SchemaError: if the file cannot be read or breaks a rule of the format; file, line and rule
            are named.
    """
    text = read_text(path)
    if {"N", "M"} <= text.keywords.keys():
        _unfold(text)
    text.choice("TYPE", TYPES)
    size = text.count("DIMENSION", LARGEST_DIMENSION)
    kind = text.choice("EDGE_WEIGHT_TYPE", ("EXPLICIT", *COORDINATE_TYPES))
    clusters = _clusters(text, size)
    name, _ = text.keywords.get("NAME", (text.path.stem, 0))
    comment, _ = text.keywords.get("COMMENT", ("", 0))
    read = _matrix if kind == "EXPLICIT" else _points
    given = read(text, size)
    text.name_unused()
    try:
        if kind == "EXPLICIT":
            return GtspInstance(name, given, clusters, comment=comment)
        return GtspInstance.from_coordinates(name, given, clusters, kind, comment)
    except SchemaError:
        raise
    except InvalidInputError as error:
        raise SchemaError(f"{text.path}: {error}") from error


def _clusters(text: TsplibText, size: int) -> tuple[tuple[int, ...], ...]:
    """Node lists, each a line or more: its number, its nodes, -1."""
    count = text.count("GTSP_SETS", size)
    line, _ = text.section("GTSP_SET_SECTION")
    found: dict[int, list[int]] = {}  # sets are numbered: their order carries nothing
    owner: dict[int, int] = {}
    current = 0  # number of the set that is being read, 0 between sets
    for line, value in text.whole_numbers("GTSP_SET_SECTION"):
        if not current:
            if value == -1 and len(found) == count:  # some writers close the section so
                continue
            if not 1 <= value <= count:
                raise text.wrong(line, f"sets are 1 to {count} (GTSP_SETS), got {value}")
            if value in found:
                raise text.wrong(line, f"set {value} stands here a second time")
            current = value
            found[current] = []
        elif value == -1:
            if not found[current]:
                raise text.wrong(line, f"set {current} has no node")
            current = 0
        elif not 1 <= value <= size:
            raise text.wrong(line, f"nodes are 1 to {size}, got {value}")
        elif value in owner:
            rule = f"node {value} is in set {owner[value]} already: sets must not overlap"
            raise text.wrong(line, rule)
        else:
            owner[value] = current
            found[current].append(value - 1)
    if current:
        raise text.wrong(line, f"set {current} does not end with -1")
    if len(found) != count:
        raise text.wrong(line, f"expected {count} sets, got {len(found)}")
    missing = next((node for node in range(1, size + 1) if node not in owner), None)
    if missing is not None:
        raise text.wrong(line, f"every node must be in a set, but node {missing} is in none")
    return tuple(tuple(found[number]) for number in sorted(found))


def _points(text: TsplibText, size: int) -> FloatArray:
    begin, rows = text.section("NODE_COORD_SECTION")
    points = np.full((size, 2), np.nan)
    for line, words in rows:
        if len(words) != 3:
            raise text.wrong(line, f"expected a node and two coordinates, got {len(words)} words")
        node = text.whole(line, words[0])
        if not 1 <= node <= size:
            raise text.wrong(line, f"nodes are 1 to {size}, got {node}")
        if not np.isnan(points[node - 1, 0]):
            raise text.wrong(line, f"node {node} has coordinates already")
        points[node - 1] = [text.number(line, word) for word in words[1:]]
    if len(rows) != size:
        raise text.wrong(begin, f"expected coordinates of {size} nodes, got {len(rows)}")
    return points


def _matrix(text: TsplibText, size: int) -> FloatArray:
    layout = text.choice("EDGE_WEIGHT_FORMAT", FORMATS)
    begin, rows = text.section("EDGE_WEIGHT_SECTION")
    full = layout == "FULL_MATRIX"
    shift = 0 if "DIAG" in layout else 1
    wanted = size * size if full else size * (size + 1 - 2 * shift) // 2
    values = [text.number(line, word) for line, words in rows for word in words]
    if len(values) != wanted:
        rule = f"{layout} of {size} nodes has {wanted} numbers, got {len(values)}"
        raise text.wrong(begin, rule)
    if full:
        return np.array(values).reshape(size, size)
    # columns of one triangle are the rows of the other
    upper = layout.startswith("UPPER") == layout.endswith("ROW")
    if upper:
        place = np.triu_indices(size, shift)
    else:
        place = np.tril_indices(size, -shift)
    result = np.zeros((size, size))
    result[place] = values
    result[place[::-1]] = values
    return result


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
