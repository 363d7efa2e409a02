"""Objects named by text: ``"module:Name"`` or ``"path/to/file.py:Name"``."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.util
import sys
import threading
from collections.abc import Iterator, Mapping, Set
from pathlib import Path
from types import ModuleType
from typing import Any

from pushplan.errors import (
    MOST_CHOICES,
    InvalidInputError,
    describe,
    short,
    unknown_name_message,
)
from pushplan.imports.observed_reads import PREFIX, forget_modules, has_changed, kept, observing
from pushplan.imports.on_demand import look_up

_folders: list[str] = []
"""Folders of files that were loaded, the latest first: the end of the import path."""
_loading = threading.RLock()  # one thread runs a file, the others wait for what it makes
_DEEPEST = 32  # parts of a module's name: Python imports each within the one before it


def load_object(spec: str) -> Any:
    """Import what a text names.

    A file is imported once a process, and again when its content has changed or that of a local
    module that it imports or of what it reads, with its folder on the import path, so that it may
    import its neighbours. Whatever the file raises passes through.

    Raises:
        InvalidInputError: if the text has no such form, or there is no such file or name.
    """
    where, colon, name = spec.rpartition(":")
    relative = where.startswith(".") and not where.endswith(".py")
    if not colon or not where or relative or not name.isidentifier():
        raise InvalidInputError(f"expected 'module:Name' or 'path/to/file.py:Name', got {spec!r}")
    if where.count(".") >= _DEEPEST:
        raise InvalidInputError(f"a module has at most {_DEEPEST} parts in its name, got {spec!r}")
    if where.startswith("pushplan.") and where in sys.modules:  # each score is asked for so
        with contextlib.suppress(AttributeError):
            return getattr(sys.modules[where], name)
    if where.endswith(".py"):
        module = _load_file(Path(where))
    else:
        module = _load_module(where, spec)
    if not hasattr(module, name):
        shown = Path(where).name if where.endswith(".py") else where
        raise InvalidInputError(
            unknown_name_message(f"name in {shown}", name, _callables_of(module))
        )
    return getattr(module, name)


def absolute(spec: str, folder: str | Path = "") -> str:
    """A text with the path of its ``file.py:`` made absolute, from a folder on; others as is."""
    where, colon, name = spec.rpartition(":")
    if not where.endswith(".py"):
        return spec
    return f"{Path(folder, Path(where).expanduser()).resolve()}{colon}{name}"


def load_users(kind: str, spec: str) -> Any:
    """Import the class or function that a user's text names; ``kind`` is its name in errors.

    Raises:
        InvalidInputError: if there is no such thing, or its file raises: with what, and where.
    """
    try:
        if spec.endswith(".py"):
            raise InvalidInputError(names_to_give(spec))
        found = load_object(spec)
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:
        said = describe(error)
        if isinstance(error, InvalidInputError):
            said = str(error)
        raise InvalidInputError(f"cannot load {kind} {spec!r}: {said}") from error
    if not callable(found):
        raise InvalidInputError(
            f"{kind} {spec!r} must be a class or a function, got {short(found)}"
        )
    return found


def look_up_or_load(kind: str, table: Mapping[str, str], name: object) -> Any:
    """Import what a name stands for in a table, or what ``"file.py:Name"`` itself names.

    Raises:
        UnknownNameError: if it is neither in the table nor of that form.
        InvalidInputError: as `load_users`.
        MissingDependencyError: if a library that it needs is not installed.
    """
    if isinstance(name, str) and (":" in name or name.endswith(".py")):
        return load_users(kind, name)
    return look_up(kind, table, name)


def names_to_give(file: str, methods: Set[str] = frozenset()) -> str:
    """Say what to give instead of a file alone: what it defines, or classes with such a method."""
    found = _callables_of(_load_file(Path(file)))
    if methods:
        found = {name: one for name, one in found.items() if methods & {*dir(one)}}
    named = " or ".join([f"{file}:{name}" for name in found][:MOST_CHOICES])
    return f"names no class or function: give {named or 'one that has some'}"


def import_path(folder: str | None = None) -> list[str]:
    """The import path without folders of loaded files, and with this one at its end."""
    own = [] if folder is None else [folder]
    return [*(one for one in sys.path if one not in _folders), *own]


def _use_folder(folder: str) -> None:
    """Let modules be found in this folder, before those of the same name beside another file."""
    if folder not in import_path() and _folders[:1] != [folder]:
        forget_modules()
        sys.path[:] = import_path()
        _folders[:] = [folder, *(one for one in _folders if one != folder)]
        sys.path += _folders


@contextlib.contextmanager
def fresh_modules() -> Iterator[None]:
    """Observe imports of users' modules, after dropping all if one, or what it read, was edited."""
    if has_changed():
        forget_modules()
    with observing(kept):
        yield


def _callables_of(module: ModuleType) -> dict[str, Any]:
    """Classes and functions of a module, or of the modules in it."""
    name = module.__name__
    return {
        key: value
        for key, value in vars(module).items()
        if not key.startswith("_")
        and callable(value)
        and f"{getattr(value, '__module__', None)}.".startswith(f"{name}.")
    }


def _load_module(name: str, spec: str) -> ModuleType:
    is_ours = name.partition(".")[0] == "pushplan"
    try:
        with contextlib.nullcontext() if is_ours else fresh_modules():
            return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise  # the module is there, something that it imports is not
        raise InvalidInputError(f"cannot load {spec!r}: {error}") from error


def _load_file(path: Path) -> ModuleType:
    path = path.expanduser().resolve()
    if not path.is_file():
        raise InvalidInputError(f"there is no file {path}")
    _use_folder(str(path.parent))
    source = path.read_bytes()
    # files in two folders may share a name, and an edited one is another module
    digest = hashlib.sha256(str(path).encode() + b"\0" + source).hexdigest()[:8]
    name = f"{PREFIX}{path.stem}_{digest}"
    with _loading, fresh_modules():
        if name in sys.modules:
            return sys.modules[name]
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module  # before it runs: its dataclasses look their module up there
        try:
            # what was hashed, even if the file has changed since
            exec(compile(source, path, "exec"), module.__dict__)
        except BaseException:
            del sys.modules[name]  # else the next call would get what is half made
            raise
        return module
