"""Hashes of code and files that results depend on and that are not pushplan's own."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.machinery import PathFinder
from pathlib import Path
from types import CodeType
from typing import Any

from pushplan.errors import PushplanError, is_a_users
from pushplan.files.safe_files import read_data
from pushplan.imports.named_objects import import_path
from pushplan.imports.observed_reads import version

_DATA = (".yaml", ".yml", ".json")
_IMPORTERS = ("import_module", "__import__")
counted: set[str] = set()
"""Paths of the files that were hashed since it was cleared."""


def source_digest(where: str) -> str:
    """A hash of a ``file.py`` or module and of the local modules that it imports, in words.

    Local is what belongs neither to pushplan nor to Python nor to an installed library. Imports
    are read from the source, wherever in it they stand. Nothing for modules of ours.
    """
    return _joined(_sources(where))


def imported_by(files: Iterable[str]) -> set[str]:
    """First parts of the names of all modules that files of source import."""
    sources = [Path(file) for file in files if file.endswith(".py")]
    found = (name for file in sources for _, name in _imports(file, version(file)))
    return {name.partition(".")[0] for name in found}


def file_digest(path: str | Path) -> str:
    """A hash of a file's content, in words; nothing if there is none.

    The files that a file of data names count with it: a world names a map, and the map a picture.
    """
    return _joined(_named_files(Path(path)))


def read_digests(names: Iterable[str], folder: str) -> dict[str, str]:
    """Hashes of what code of users has read, by name, as it is now; empty for what is missing.

    Args:
        names: paths of files, below ``folder`` or absolute, and environment variables with a ``$``.
        folder: of the policy's file.
    """
    found = {}
    for name in sorted(names):
        found[name] = ""
        with contextlib.suppress(OSError, ValueError):
            file = Path(folder, name)
            if not name.startswith("$"):
                found[name] = _content_hash(file, version(file)) if file.is_file() else ""
            elif (value := os.environ.get(name[1:])) is not None:
                found[name] = hashlib.sha256(os.fsencode(value)).hexdigest()[:12]
    return found


def code_digest(thing: Any) -> str:
    """A hash of the compiled code of a function or of the methods of a class, in words.

    It tells objects apart that have no file, or whose file has changed since it was loaded.
    """
    kinds = thing.__mro__[:-1] if isinstance(thing, type) else ()
    members = [getattr(one, "__func__", one) for kind in kinds for one in vars(kind).values()]
    codes = [getattr(one, "__code__", None) for one in (thing, *members)]
    text = "".join(_code_text(code) for code in codes if code is not None)
    if not text:
        return ""
    return f" code:{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def _code_text(code: CodeType) -> str:
    consts = (
        _code_text(one) if isinstance(one, CodeType) else repr(one)
        for one in code.co_consts
        if not isinstance(one, frozenset)  # their order is not the same in every process
    )
    return f"{code.co_code.hex()} {code.co_names} {list(consts)}"


def _joined(files: Iterable[Path]) -> str:
    """The hash of one file, or of several with their names."""
    hashes = {file: _content_hash(file, version(file)) for file in files if file.is_file()}
    counted.update(os.path.abspath(file) for file in hashes)
    if len(hashes) > 1:
        text = "".join(f"{file.name} {one}\n" for file, one in hashes.items())
        return f" sha256:{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    return "".join(f" sha256:{one}" for one in hashes.values())


@functools.lru_cache(maxsize=1024)
def _content_hash(file: Path, _version: object) -> str:
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()[:12]


def _sources(where: str) -> list[Path]:
    """The file of a ``file.py`` or module that is not ours, then the local ones it imports."""
    if where.endswith(".py"):
        first: Path | None = Path(where).resolve()
    else:
        first = _file_of(where)
    if first is None or not first.is_file():
        return []
    found = [first]
    path = _dated(import_path(str(first.parent)))
    for file in found:  # which grows meanwhile
        for level, name in _imports(file, version(file)):
            folders = _dated([str(file.parents[level - 1])]) if level else path
            found += [one for one in _modules(name, folders) if one not in found]
    return found


def _file_of(module: str) -> Path | None:
    """The file of a module that is not ours; None if there is none."""
    if not module or module.partition(".")[0] == "pushplan":
        return None
    try:
        if module in sys.modules:
            found = getattr(sys.modules[module], "__file__", None)
        else:
            spec = importlib.util.find_spec(module)
            found = None if spec is None else spec.origin
    except (ImportError, ValueError, AttributeError):
        return None
    return None if found is None else Path(found).resolve()


@functools.lru_cache(maxsize=1024)
def _imports(file: Path, _version: object) -> tuple[tuple[int, str], ...]:
    """Dots before and name of each module that a file of source may import."""
    found: list[tuple[int, str]] = []
    with contextlib.suppress(SyntaxError, ValueError):  # no source: an extension, for one
        for node in ast.walk(ast.parse(file.read_bytes())):
            match node:
                case ast.Import(names):
                    found += [(0, one.name) for one in names]
                case ast.ImportFrom(module, names, level):
                    start = f"{module}." if module else ""
                    found += [(level, start + one.name) for one in names]
                case ast.Call(function, [ast.Constant(name), *_]):
                    if ast.unparse(function).endswith(_IMPORTERS):
                        found.append((0, str(name)))
    return tuple(found)


def _modules(name: str, folders: Sequence[tuple[str, object]]) -> Iterator[Path]:
    """Local files of a module, and of the packages around it."""
    for part in name.split("."):
        if not folders or _is_installed(part, tuple(folders)):
            return
        spec = PathFinder.find_spec(part, [folder for folder, _ in folders])
        if spec is None:
            return
        if spec.has_location and spec.origin is not None:
            yield Path(spec.origin).resolve()
        folders = _dated(spec.submodule_search_locations or ())


def _dated(folders: Iterable[str]) -> tuple[tuple[str, object], ...]:
    """Folders, and versions that change when something is put into one or taken out of it."""
    return tuple((folder, version(folder or os.curdir)) for folder in folders)


@functools.lru_cache(maxsize=1024)
def _is_installed(part: str, folders: tuple[tuple[str, object], ...]) -> bool:
    """True if the first module of this name in these folders is none of a user's."""
    spec = PathFinder.find_spec(part, [folder for folder, _ in folders])
    if spec is None or not spec.has_location or spec.origin is None:
        return False
    return not is_a_users(spec.origin)


@functools.lru_cache(maxsize=1024)
def _named(file: Path, _version: object) -> tuple[str, ...]:
    """Every text in a file of data."""
    texts: list[str] = []
    with contextlib.suppress(PushplanError):
        waiting = [read_data(file)] if file.suffix in _DATA else []
        for one in waiting:  # which grows meanwhile
            if isinstance(one, str):
                texts.append(one)
            elif isinstance(one, Mapping | list):
                waiting += one.values() if isinstance(one, Mapping) else one
    return tuple(texts)


def _named_files(path: Path) -> list[Path]:
    found = [path] if os.path.isfile(path) else []
    for file in found:  # which grows meanwhile
        paths = [file.parent / text for text in _named(file, version(file))]
        found += [one for one in paths if os.path.isfile(one) and one not in found]
    return found
