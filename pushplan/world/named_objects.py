"""Objects named by text: ``"module:Name"`` or ``"path/to/file.py:Name"``."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from pushplan.world.errors import InvalidInputError, unknown_name_message

_DEEPEST = 32  # parts of a module's name: Python imports each within the one before it


def load_object(spec: str) -> Any:
    """Import what a text names.

    A file is imported once a process, and again when its content has changed, with its folder on
    the import path, so that it may import its neighbours. Whatever the file raises passes through.

    Raises:
        InvalidInputError: if the text has no such form, or there is no such file or name.
    """
    where, colon, name = spec.rpartition(":")
    relative = where.startswith(".") and not where.endswith(".py")
    if not colon or not where or relative or not name.isidentifier():
        raise InvalidInputError(f"expected 'module:Name' or 'path/to/file.py:Name', got {spec!r}")
    if where.count(".") >= _DEEPEST:
        raise InvalidInputError(f"a module has at most {_DEEPEST} parts in its name, got {spec!r}")
    module = _load_file(Path(where)) if where.endswith(".py") else _load_module(where, spec)
    if not hasattr(module, name):
        shown = Path(where).name if where.endswith(".py") else where
        raise InvalidInputError(
            unknown_name_message(f"name in {shown}", name, _callables_of(module))
        )
    return getattr(module, name)


def objects_of_file(path: str | Path) -> dict[str, Any]:
    """The classes and functions that a file defines, by name, in its order.

    What it imports from elsewhere, and what begins with an underscore, is left out. Errors are
    those of `load_object`.
    """
    return _callables_of(_load_file(Path(path)))


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
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise  # the module is there, something that it imports is not
        raise InvalidInputError(f"cannot load {spec!r}: {error}") from error


def _load_file(path: Path) -> ModuleType:
    path = path.expanduser().resolve()
    if not path.is_file():
        raise InvalidInputError(f"there is no file {path}")
    source = path.read_bytes()
    digest = hashlib.sha256(str(path).encode() + b"\0" + source).hexdigest()[:8]
    name = f"pushplan_user_{path.stem}_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    sys.modules[name] = module
    try:
        exec(compile(source, path, "exec"), module.__dict__)
    except BaseException:
        del sys.modules[name]
        raise
    return module
