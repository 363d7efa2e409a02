"""``pushplan doctor``: what is installed and missing, how the core was built, what can draw."""

from __future__ import annotations

import argparse
import ctypes.util
import os
import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from importlib.util import find_spec
from typing import Any

from pushplan import __version__
from pushplan.cli.common import has_screen, say, say_json
from pushplan.errors import PushplanError
from pushplan.imports.on_demand import EXTRAS

BASE = ("numpy", "ompl", "yaml", "ruckig", "scipy", "shapely")
"""Libraries that come with pushplan itself; Ruckig where it has a wheel."""
_DISPLAYS = ("EGL", "OSMesa")
"""Libraries with which MuJoCo draws where there is no screen."""


def run(options: argparse.Namespace) -> int:
    """Look and tell; 1 if a library without which nothing works is missing."""
    found = examine()
    if options.json:
        say_json(found)
    else:
        _tell(found)
    # without ruckig a limit of jerk is left out, and nothing else
    needed = [found["libraries"][name] for name in BASE if name != "ruckig"]
    return 1 if None in needed or found["core"]["problem"] else 0


def examine() -> dict[str, Any]:
    """Facts about this installation, as JSON values."""
    owners = packages_distributions()
    libraries = {name: _version(name, owners) for name in (*BASE, *EXTRAS)}
    missing = {
        extra: [one for one in EXTRAS if EXTRAS[one] == extra and libraries[one] is None]
        for extra in dict.fromkeys(EXTRAS.values())
    }
    return {
        "pushplan": __version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "cores": os.cpu_count(),
        "libraries": libraries,
        "extras": {
            extra: {
                "missing": lost,
                "install": f"pip install 'pushplan[{extra}]'" if lost else None,
            }
            for extra, lost in missing.items()
        },
        "core": _core(),
        "drawing": {
            **{name: ctypes.util.find_library(name) is not None for name in _DISPLAYS},
            "screen": has_screen(),
            "MUJOCO_GL": os.environ.get("MUJOCO_GL"),
        },
    }


def _version(module: str, owners: Any) -> str | None:
    """The version of a library; None if it is not installed, "unknown" if it does not say."""
    if find_spec(module) is None:
        return None
    try:
        return version(owners.get(module, [module])[0])
    except PackageNotFoundError:
        return "unknown"


def _core() -> dict[str, Any]:
    """Compiler and sources of the compiled core, and what is wrong with it."""
    try:
        from pushplan import core
    except PushplanError as error:
        return {"compiler": None, "sources": None, "problem": str(error)}
    problem = None
    if core.is_stale():
        problem = "core/ has changed since the compiled core was built: run pip install -e . again"
    return {"compiler": core.COMPILER, "sources": core.SOURCES, "problem": problem}


def _tell(found: dict[str, Any]) -> None:
    say(f"pushplan {found['pushplan']}, Python {found['python']}, {found['system']}, ", end="")
    say(f"{found['cores']} cores")
    versions = found["libraries"]

    def said(names: Iterable[str]) -> str:
        return ", ".join(f"{name} {versions[name]}" for name in names if versions[name] is not None)

    lost = [name for name in BASE if versions[name] is None]
    say(f"base: {said(BASE)}" + (f"; missing: {', '.join(lost)}" if lost else ""))
    for extra, one in found["extras"].items():
        if one["missing"]:
            say(f"{extra}: missing {', '.join(one['missing'])}; type: {one['install']}")
        else:
            say(f"{extra}: {said(name for name in EXTRAS if EXTRAS[name] == extra)}")
    core = found["core"]
    say(f"core: {core['problem'] or 'built by ' + core['compiler']}")
    drawing = found["drawing"]
    usable = [f"{name} {'yes' if drawing[name] else 'no'}" for name in (*_DISPLAYS, "screen")]
    say(f"MuJoCo's camera and windows: {', '.join(usable)}")
    if not any(drawing[name] for name in (*_DISPLAYS, "screen")):
        say("  render_mode 'camera' needs one of them: on Debian 'apt install libegl1'")
