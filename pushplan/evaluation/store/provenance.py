"""Provenance of results: code, machine, packages and command of each call that ran jobs."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import shlex
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import pushplan
from pushplan import core
from pushplan.evaluation.store.rows import instant

PACKAGES = (
    *("casadi", "gymnasium", "mujoco", "numpy", "ompl", "onnxruntime"),
    *("pymunk", "ruckig", "scipy", "shapely", "torch"),
)
"""Packages that results may depend on; those that are installed are named."""
_ENGINES = ("mujoco", "pymunk")
_GIT_S = 5.0
UNSEEN = frozenset(
    {
        *("cli", "ros", "training", "evaluation/report", "evaluation/statistics"),
        *("evaluation/store/merging", "evaluation/store/rescoring"),
        *("evaluation/store/status", "evaluation/run/reproduction"),
    }
)
"""Rooms and files of the package that no episode runs through. All others count."""
_CORE = "_core"  # the module and its stubs; `versions` names it by its sources and compiler


def provenance(workers: int) -> dict[str, Any]:
    """Collect the provenance of a run that begins now, as JSON values.

    Args:
        workers: processes that run the jobs.

    Returns:
        ``began`` (ISO 8601, UTC), ``command``, ``pushplan`` (version), ``commit`` and ``changed``
        (whether files differ from it; both None outside of a checkout), ``python``, ``system``,
        ``machine``, ``cores``, ``load`` (of the last minute, None if unknown), ``workers`` and
        ``packages`` (name -> version).
    """
    commit, changed = _checkout(Path(pushplan.__file__).resolve().parents[1])
    command = ""
    if sys.argv[0]:  # empty in an interactive session
        command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])
    load = None
    if hasattr(os, "getloadavg"):  # not on Windows
        load = round(os.getloadavg()[0], 2)
    return {
        "began": instant(),
        "command": command,
        "pushplan": pushplan.__version__,
        "commit": commit,
        "changed": changed,
        "python": platform.python_version(),
        "system": platform.platform(terse=True),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "load": load,
        "workers": workers,
        "packages": dict(packages()),
    }


def in_words(run: dict[str, Any]) -> str:
    """One line of what `provenance` gave."""
    packages = ", ".join(f"{name} {version}" for name, version in run["packages"].items())
    return (
        f"{run['began']}: {run['command'] or 'Python'}; pushplan "
        f"{code_in_words(run)}; {run['workers']} workers on "
        f"{run['cores']} cores at load {run['load']}, {run['system']} {run['machine']}, Python "
        f"{run['python']}; {packages}"
    )


def code_in_words(run: dict[str, Any]) -> str:
    """Version and commit of the code of a run: of what `provenance` gave."""
    commit = f" at {run['commit'][:12]}" if run["commit"] else ""
    return f"{run['pushplan']}{commit}{' with changes' if run['changed'] else ''}"


@functools.cache
def packages() -> dict[str, str]:
    """Versions of those of `PACKAGES` that are installed."""
    found = {}
    for name in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@functools.cache
def versions(simulator: str) -> dict[str, str]:
    """Versions that an episode's bytes may depend on: of our code and of what is below it.

    Args:
        simulator: name of the simulator; versions of other ones do not count.

    Returns:
        ``python``, ``pushplan``, ``code`` (a hash of the package without `UNSEEN`), ``core`` (a
        hash of the sources of the compiled core, its compiler, and the OSQP in it) and installed
        packages by name.
    """
    others = {"torch", *_ENGINES} - {simulator}
    return {
        "python": platform.python_version(),
        "pushplan": pushplan.__version__,
        "code": package_digest(),
        "core": f"{core.SOURCES} {core.COMPILER}",
        **{name: version for name, version in packages().items() if name not in others},
    }


@functools.cache
def package_digest() -> str:
    """A hash of the files of the package that episodes may depend on: code, data and weights."""
    root = Path(pushplan.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        where = path.relative_to(root)
        name = where.as_posix()
        rooms = {where.parts[0], "/".join(where.parts[:2]), name.removesuffix(".py")}
        is_core = where.parts[0].partition(".")[0] == _CORE
        left_out = is_core or rooms & UNSEEN or path.suffix == ".md" or name.startswith(".")
        if path.is_file() and "__pycache__" not in where.parts and not left_out:
            digest.update(f"{name}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


def _checkout(root: Path) -> tuple[str | None, bool | None]:
    """Commit of the code that runs, and whether it has been changed; None outside of a checkout."""
    if not (root / ".git").exists():  # Git would take that of a folder above
        return None, None
    said = []
    for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--untracked-files=no"]):
        command = ["git", "-C", str(root), *words]
        try:
            done = subprocess.run(command, capture_output=True, check=True, timeout=_GIT_S)
        except (OSError, subprocess.SubprocessError):
            return None, None
        said.append(done.stdout.decode().strip())
    return said[0], bool(said[1])
