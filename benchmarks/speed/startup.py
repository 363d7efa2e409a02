"""What compilation costs: CPU time from an empty cache, and time until ready with a full one.

    python -m benchmarks.speed.startup [NAME ...] [--write]

Each figure is of a process of its own that imports pushplan and calls `warm_up(NAME)`; `everything`
is `pushplan compile`. With ``--write`` nothing is measured: the names of the kernels that
`pushplan compile NAME` makes ready go into the package, for the names given or else for all, so
that its progress knows how many are to come.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.reporting import command_line

_NAMES = ("straight", "kinodynamic-rrt", "push-aware", "greedy", "gtsp-mpc", "ship-lattice")
_EVERYTHING = "everything"
_MANIFEST = Path(__file__).parents[2] / "pushplan" / "cli" / "kernel_names.json"
_SCRIPT = """
import json, sys, time
began, busy = time.perf_counter(), time.process_time()
from pushplan.compiled import watching
kernels = set()
with watching(lambda kernel, loaded: kernels.add(kernel)):
    if sys.argv[1] == "everything":
        from pushplan.evaluation.run.warmup import names, warm_up
        for name in names():
            warm_up(name)
    else:
        from pushplan.planners import warm_up
        warm_up(sys.argv[1])
print(json.dumps([time.process_time() - busy, time.perf_counter() - began, len(kernels)]))
"""
_KERNELS = """
import json, sys
from pushplan.compiled import watching
from pushplan.evaluation.run.warmup import warm_up
kernels = set()
with watching(lambda kernel, loaded: kernels.add(kernel)):
    warm_up(sys.argv[1])
print(json.dumps(sorted(kernels)))
"""


def measure(name: str, cache: str) -> tuple[float, float, int]:
    """Warm up in a new process.

    Returns:
        CPU time [s], time [s] and how many kernels Python called.
    """
    busy, took, kernels = _last_line(_SCRIPT, name, {"NUMBA_CACHE_DIR": cache})
    return busy, took, kernels


def write_kernel_names(only: list[str]) -> None:
    """Write down which kernels each name of `pushplan compile` makes ready.

    Args:
        only: the names that are looked at; what is written of the others stays. All if empty.
    """
    from pushplan.evaluation.run.warmup import names

    kernels: dict[str, list[str]] = {name: [] for name in names()}
    for users, shared in json.loads(_MANIFEST.read_text()).items():
        for name in set(users.split()) & set(kernels) - set(only or kernels):
            kernels[name] += shared
    for name in only or list(kernels):
        kernels[name] = _last_line(_KERNELS, name, {})
    _write(kernels)


def _write(kernels: dict[str, list[str]]) -> None:
    """One line for each set of kernels that some names, and no others, make ready."""
    by_names: dict[str, list[str]] = {}
    for kernel in sorted(set().union(*kernels.values())):
        users = " ".join(name for name in kernels if kernel in kernels[name])
        by_names.setdefault(users, []).append(kernel)
    _MANIFEST.write_text(json.dumps(by_names, indent=1) + "\n")


def _last_line(script: str, name: str, settings: dict[str, str]) -> Any:
    done = subprocess.run(
        [sys.executable, "-c", script, name],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print the table, or write the names."""
    parser = command_line(__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--write", action="store_true", help="write the names of the kernels")
    options = parser.parse_args()
    if options.write:
        write_kernel_names(options.names)
        return
    print("| policy | kernels | cold [s of CPU] | warm [s of CPU] | warm [s] |")
    print("|---|---|---|---|---|")
    for name in options.names or (*_NAMES, _EVERYTHING):
        with tempfile.TemporaryDirectory() as cache:
            cold, _, kernels = measure(name, cache)
            busy, took, _ = measure(name, cache)
        print(f"| {name} | {kernels} | {cold:.1f} | {busy:.1f} | {took:.1f} |", flush=True)


if __name__ == "__main__":
    main()
