"""The compiled core: inner loops in C++ (`core/` in the repository), room for room as here."""

from __future__ import annotations

import copyreg
import hashlib
from enum import Enum
from pathlib import Path
from types import ModuleType

from pushplan.errors import PushplanError, refuse_copy

try:
    from pushplan import _core
    from pushplan._core import (
        COMPILER,
        SOURCES,
        audit_hook,
        control,
        envs,
        geometry,
        gtsp,
        interaction,
        motion,
        navigation,
        observation,
        perception,
        planners,
        pushing,
        rearrangement,
        scenarios,
        search,
    )
except ImportError as error:
    raise PushplanError(
        f"the compiled core of pushplan is not built for this tree ({error}): "
        f"run pip install -e . in it"
    ) from error

__all__ = [
    "COMPILER",
    "SOURCES",
    "audit_hook",
    "cmake_dir",
    "control",
    "envs",
    "geometry",
    "gtsp",
    "interaction",
    "is_stale",
    "motion",
    "navigation",
    "observation",
    "perception",
    "planners",
    "pushing",
    "rearrangement",
    "scenarios",
    "search",
]


for _room in filter(lambda one: isinstance(one, ModuleType), vars(_core).values()):
    for _kind in vars(_room).values():
        if isinstance(_kind, type) and not issubclass(_kind, Enum):
            copyreg.pickle(_kind, refuse_copy)
copyreg.pickle(pushing.BoxContact, lambda one: (type(one), one.numbers))
copyreg.pickle(rearrangement.PushingController, lambda one: (type(one), one.numbers))


def is_stale() -> bool:
    """Return True if the sources beside the package are not those that the core was built from."""
    top = Path(__file__).parents[1]
    files = {
        path.relative_to(top).as_posix(): path
        for room in ("include", "src", "bindings")
        for path in (top / "core" / room).rglob("*.[ch]*")
    }
    if not files:  # an installed package comes without them
        return False
    options = ("CMakeLists.txt", "core/CMakeLists.txt")
    files |= {name: top / name for name in options if (top / name).is_file()}
    listing = "".join(
        f"{name} {hashlib.sha256(files[name].read_bytes()).hexdigest()}\n" for name in sorted(files)
    )
    return hashlib.sha256(listing.encode()).hexdigest()[:12] != SOURCES


def cmake_dir() -> Path:
    """The folder from which CMake's ``find_package(pushplan)`` takes the core for C++ programs.

    Raises:
        PushplanError: if the module was not installed by pip, which puts the folder beside it.
    """
    folder = Path(_core.__file__).parent / "cpp" / "cmake"
    if not folder.is_dir():
        raise PushplanError(f"{str(folder)!r} is not there: run pip install, which installs it")
    return folder
