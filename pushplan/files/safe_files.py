"""Files that strangers wrote: every door reads through here, within limits and with one error.

A file is a regular one below a size; YAML and JSON are bounded in depth and number of values and
name no key twice; arrays are those that their file has room for.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import stat
import sys
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from pushplan.errors import InvalidInputError, SchemaError, describe, short, unknown_name_message
from pushplan.files.safe_yaml import LONGEST_NUMBER, MAX_DEPTH, load

MAX_BYTES = 200_000_000
"""Greatest size of a file, and of the arrays that are packed in it."""
MAX_TEXT = 32_000_000
"""Greatest size of a file of text [bytes]."""
MAX_VALUES = 1_000_000
"""Most values in a JSON file."""
_MEMBERS = 1000
"""Most arrays in a file."""
_PIECE_BYTES = 2**20
"""Bytes that are read at a time from an array in a file."""
_TEXT = re.compile(rb'"[^"\\]*(?:\\.[^"\\]*)*(?:"|\\?\Z)', re.DOTALL)
"""A text in JSON; one that does not end reaches to the end of all, else searching is quadratic."""
_STEPS = np.zeros(256, dtype=np.int8)
_STEPS[[ord("["), ord("{")]] = 1
_STEPS[[ord("]"), ord("}")]] = -1
_NO_DIGITS = np.ones(256, dtype=np.bool_)
_NO_DIGITS[ord("0") : ord("9") + 1] = False


class UnusedInputWarning(UserWarning):
    """A file holds something that its reader does not use."""


def read_bytes(path: str | Path, what: str = "file", limit: int = MAX_BYTES) -> bytes:
    """The content of a regular file.

    Args:
        path: the file.
        what: what errors call it, such as ``"world file"``.
        limit: its greatest size [bytes].

    Raises:
        SchemaError: if it cannot be read, is no regular file, or is greater.
    """
    if not isinstance(path, str | os.PathLike):
        raise InvalidInputError(f"the path of a {what} must be a text, got {short(path)}")
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                kind = "a pipe" if stat.S_ISFIFO(status.st_mode) else "a device"
                raise OSError(0, f"it is {kind}, not a regular file")
            if status.st_size > limit:
                raise OSError(
                    0, f"it has {status.st_size:,} bytes, {limit:,} are the greatest size"
                )
            return file.read(status.st_size)  # no more, should it grow meanwhile
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise SchemaError(f"cannot read {what} {path}: {why}") from error


def _open_at_once(path: str, flags: int) -> int:
    """Open without waiting for who writes to a pipe."""
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


def read_text(path: str | Path, what: str = "file", limit: int = MAX_TEXT) -> str:
    """The content of a text file in UTF-8, with or without a byte order mark.

    Raises:
        SchemaError: as `read_bytes`, or if it is not UTF-8.
    """
    try:
        return read_bytes(path, what, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SchemaError(f"cannot read {what} {path}: it is not UTF-8: {error}") from error


def read_data(path: str | Path, what: str = "file") -> Any:
    """Values of a JSON file, by the ending ``.json``, or a YAML file.

    Raises:
        SchemaError: as `read_text`, `parse_json` and `parse_yaml`.
    """
    text = read_text(path, what)
    parse = parse_json if str(path).endswith(".json") else parse_yaml
    return parse(text, f"{what} {path}")


def parse_json(text: str, what: str = "text") -> Any:
    """Values of a text in JSON.

    Raises:
        SchemaError: if it is not JSON, names a key twice, or is over `MAX_VALUES`, `MAX_DEPTH` or
            `LONGEST_NUMBER`.
    """
    try:
        _check_json(text.encode("utf-8"))
        return json.loads(text, object_pairs_hook=_without_doubles)
    except (ValueError, RecursionError) as error:
        raise SchemaError(f"cannot read {what}: it is not valid JSON: {error}") from error


def parse_yaml(text: str, what: str = "text") -> Any:
    """Values of a text in YAML, of plain types; see `pushplan.files.safe_yaml`.

    Raises:
        SchemaError: if it is not YAML, names a key twice, or is over a limit.
    """
    try:
        return load(text)
    except Exception as error:  # what PyYAML makes values with raises errors of many kinds
        raise SchemaError(f"cannot read {what}: it is not valid YAML: {error}") from error


def read_npz(
    path: str | Path,
    what: str,
    required: Sequence[str],
    optional: Sequence[str] = (),
    limit: int = MAX_BYTES,
) -> dict[str, NDArray[Any]]:
    """The arrays of a ``.npz`` file: numbers, truth values and texts, never pickles.

    Args:
        path: the file.
        what: what errors call it.
        required: names of arrays that must be there.
        optional: names that may be there; no others may.
        limit: greatest size of the file, and of its arrays together [bytes].

    Raises:
        SchemaError: if it is no such file, or an array is not what its header says.
    """
    data = read_bytes(path, what, limit)
    try:
        if data[:2] != b"PK":
            raise SchemaError("it is no .npz archive")
        if data.count(b"PK\1\2") > _MEMBERS:  # each entry costs memory before it can be counted
            raise SchemaError(f"it has more than {_MEMBERS} members")
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            if len(members) < len(archive.infolist()):  # readers differ in which of two they take
                raise SchemaError("an array is there twice")
            if members and members.keys().isdisjoint(required):
                raise SchemaError(f"it holds {', '.join(map(short, [*members][:3]))}: no {what}")
            known_keys("it", members, (*required, *optional), required)
            arrays: dict[str, NDArray[Any]] = {}
            for name, info in members.items():
                if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                    raise SchemaError(f"{name!r} must be stored or deflated")
                with archive.open(info) as member:
                    arrays[name] = _array(member, limit)
                limit -= arrays[name].nbytes  # one limit for all arrays together
            return arrays
    except SchemaError as error:
        raise SchemaError(f"cannot read {what} {path}: {error}") from error
    except Exception as error:  # a zip file can be broken in many ways
        raise SchemaError(f"cannot read {what} {path}: {describe(error)}") from error


def read_npy(path: str | Path, what: str) -> NDArray[Any]:
    """The array of a ``.npy`` file, as `read_npz` reads its arrays."""
    data = read_bytes(path, what)
    try:
        return _array(io.BytesIO(data), MAX_BYTES)
    except Exception as error:
        raise SchemaError(f"cannot read {what} {path}: {describe(error)}") from error


def known_keys(
    kind: str, data: object, valid: Sequence[str] | None, required: Sequence[str]
) -> Mapping[str, Any]:
    """Check the keys of a mapping from a file, of which ``valid`` may be there, and return it.

    Any key may be there if ``valid`` is None: the caller passes on to `name_unused` what it leaves.

    Raises:
        SchemaError: if it is no mapping, a required key is missing, or a key is unknown.
    """
    if not isinstance(data, Mapping):
        raise SchemaError(f"{kind} must be a mapping, got {short(data)}")
    for key in data:
        if valid is not None and key not in valid:
            raise SchemaError(unknown_name_message(f"key in {kind}", key, valid))
    for key in required:
        if key not in data:
            raise SchemaError(f"{kind} lacks the required key {key!r}")
    return data


def name_unused(kind: str, names: Iterable[str]) -> None:
    """Warn once, by an `UnusedInputWarning`, of all that a file holds and its reader does not use.

    Args:
        kind: the file, or the part of it.
        names: what is not used, such as keys; nothing is said if there are none.
    """
    unused = sorted({short(name).strip("'") for name in names})
    if unused:
        text = f"{kind}: not used: {', '.join(unused)}"
        warnings.warn(text, UnusedInputWarning, stacklevel=4)


def _array(file: IO[bytes], limit: int) -> NDArray[Any]:
    """An array, after its header has been compared with the limit."""
    version = np.lib.format.read_magic(file)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        raise SchemaError(f"this pushplan reads .npy files of version 1.0 and 2.0, got {version}")
    shape, fortran, kind = readers[version](file)
    if kind.kind not in "biufU":
        raise SchemaError(f"arrays hold numbers, truth values or texts, got {kind}")
    count = math.prod(shape)
    size = count * max(kind.itemsize, 1)
    if min(shape, default=0) < 0 or size > limit:
        raise SchemaError(f"an array of shape {shape} needs {size:,} bytes, {limit:,} are left")
    values = np.empty(count, kind)
    room = values.view(np.uint8)
    filled = 0
    while filled < room.size:
        got = file.readinto(room[filled : filled + _PIECE_BYTES])  # type: ignore[attr-defined]
        if not got:
            raise SchemaError(f"an array of shape {shape} needs {size:,} bytes, got {filled:,}")
        filled += got
    if kind.kind == "U" and values.size:
        # NumPy keeps four bytes a character and fails late where they are none
        codes = values.view(np.dtype(np.uint32).newbyteorder(kind.byteorder))
        if int(codes.max(initial=0)) > sys.maxunicode:
            raise SchemaError(f"a text holds {codes.max():#x}, which is no character")
    return values.reshape(shape, order="F" if fortran else "C")


def _check_json(data: bytes) -> None:
    """Refuse what would take much memory or a deep stack, before it is parsed."""
    for strip in (False, True):  # what stands in texts counts only if it must
        text = _TEXT.sub(b'""', data) if strip else data
        count = text.count(b",") + text.count(b"[") + text.count(b"{")
        depth = 0
        digits = 0
        if count <= MAX_VALUES:
            codes = np.frombuffer(b" %b " % text, dtype=np.uint8)
            steps = _STEPS[codes]
            depth = int(np.cumsum(steps[steps != 0], dtype=np.int64).max(initial=0))
            # the longest row of digits lies between two neighbours that are none
            others = np.flatnonzero(_NO_DIGITS[codes])
            digits = int((others[1:] - others[:-1]).max()) - 1
        if count <= MAX_VALUES and depth <= MAX_DEPTH and digits < LONGEST_NUMBER:
            return
    if count > MAX_VALUES:
        raise ValueError(f"{MAX_VALUES:,} values are the most, got {count:,}")
    if digits >= LONGEST_NUMBER:
        raise ValueError(f"a number may have {LONGEST_NUMBER} digits at most")
    raise ValueError(f"lists and mappings may be nested {MAX_DEPTH} deep, got {depth:,}")


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) < len(pairs):
        ((twice, _),) = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"the key {twice!r} stands in one mapping twice")
    return data
