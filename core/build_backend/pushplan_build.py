"""The build backend: scikit-build-core, with zig's compiler where the machine has none.

Hooks of PEP 517 and PEP 660. Where no C++ compiler is found, the wheel ``ziglang`` becomes a build
requirement, and scripts in the temporary folder call it by the names that CMake looks for.
``CXX=zig`` asks for it: such a wheel runs with an older C library than that of the machine.

The wheel ``osqp`` is a build requirement too, for the C sources in it. They are kept in ``build``:
the wheel brings NumPy and SciPy along, which a second installation should not wait for.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import stat
import sys
import tempfile
from importlib import metadata
from pathlib import Path
from typing import Any

from scikit_build_core import build as _build

_COMPILERS = ("c++", "g++", "clang++")
_TARGET = f"{platform.machine()}-linux-gnu.2.28"  # the oldest C library of the dependencies' wheels
_TOOLS = {"CC": "cc", "CXX": "c++", "AR": "ar", "RANLIB": "ranlib"}
_OSQP = Path("build", "osqp")  # its package, as far as the core needs it


def _needs_zig() -> bool:
    named = os.environ.get("CXX")
    if sys.platform != "linux":
        return False
    return named == "zig" or (named is None and not any(map(shutil.which, _COMPILERS)))


def _requirements(ask: Any, settings: dict[str, Any] | None) -> list[str]:
    needed = list(ask(settings))
    if _needs_zig():
        needed.append("ziglang>=0.13")
    if not _OSQP.is_dir():
        needed.append("osqp>=1.1,<1.2")
    return needed


def _with_compiler(build: Any, *arguments: Any) -> str:
    if _needs_zig():
        _use_zig()
    _keep_osqp()
    return str(build(*arguments))


def _use_zig() -> None:
    """Write scripts that call zig as a compiler, and name them in the environment."""
    folder = Path(tempfile.mkdtemp(prefix="pushplan-zig-"))
    for variable, tool in _TOOLS.items():
        script = folder / tool
        options = f" -target {_TARGET}" if tool in ("cc", "c++") else ""
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ziglang {tool}{options} "$@"\n')
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
        os.environ[variable] = str(script)
    _ask_cmake(
        f"-DCMAKE_AR={folder / 'ar'}",
        f"-DCMAKE_RANLIB={folder / 'ranlib'}",
        "-DCMAKE_CXX_SCAN_FOR_MODULES=OFF",
    )


def _keep_osqp() -> None:
    """Copy OSQP's sources and licence out of its package, and name the place to CMake."""
    if not _OSQP.is_dir():
        try:
            package = metadata.distribution("osqp")
        except metadata.PackageNotFoundError:  # CMake says what to do
            return
        partial = _OSQP.with_name("osqp.partial")
        shutil.rmtree(partial, ignore_errors=True)
        for file in package.files or []:
            if "codegen_src" in file.parts or "licenses" in file.parts:
                target = partial / file
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(file.locate(), target)
        partial.rename(_OSQP)
    _ask_cmake(f"-DPUSHPLAN_OSQP={_OSQP.resolve() / 'osqp'}")


def _ask_cmake(*arguments: str) -> None:
    quoted = map(shlex.quote, arguments)
    os.environ["CMAKE_ARGS"] = " ".join([os.environ.get("CMAKE_ARGS", ""), *quoted]).strip()


def get_requires_for_build_wheel(settings: dict[str, Any] | None = None) -> list[str]:
    """Requirements of a wheel."""
    return _requirements(_build.get_requires_for_build_wheel, settings)


def get_requires_for_build_editable(settings: dict[str, Any] | None = None) -> list[str]:
    """Requirements of an editable installation."""
    return _requirements(_build.get_requires_for_build_editable, settings)


def get_requires_for_build_sdist(settings: dict[str, Any] | None = None) -> list[str]:
    """Requirements of a source distribution, which compiles nothing."""
    return list(_build.get_requires_for_build_sdist(settings))


def prepare_metadata_for_build_wheel(folder: str, settings: Any = None) -> str:
    """Write the metadata of a wheel, for which nothing is compiled."""
    return str(_build.prepare_metadata_for_build_wheel(folder, settings))


def prepare_metadata_for_build_editable(folder: str, settings: Any = None) -> str:
    """Write the metadata of an editable installation, for which nothing is compiled."""
    return str(_build.prepare_metadata_for_build_editable(folder, settings))


def build_wheel(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    """Build a wheel."""
    return _with_compiler(_build.build_wheel, folder, settings, metadata)


def build_editable(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    """Build the module, and a wheel that leads to the tree."""
    return _with_compiler(_build.build_editable, folder, settings, metadata)


def build_sdist(folder: str, settings: Any = None) -> str:
    """Build a source distribution."""
    return str(_build.build_sdist(folder, settings))
