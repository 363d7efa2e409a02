"""What compilation costs: CPU time from an empty cache, and time until ready with a full one.

    python -m benchmarks.startup [NAME ...] [--write]

Each figure is of a process of its own that imports pushplan and calls `warm_up(NAME)`; `everything`
is `pushplan compile`. With ``--write`` the names of the kernels of each policy go into the package,
so that its progress knows how many are to come.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

_NAMES = ("straight", "kinodynamic-rrt", "push-aware", "greedy", "gtsp-mpc", "ship-lattice")
_EVERYTHING = "everything"
_MANIFEST = Path(__file__).parents[1] / "pushplan" / "cli" / "kernel_names.json"
_SCRIPT = """
import json, sys, time
began, busy = time.perf_counter(), time.process_time()
from pushplan.compiled import watching
kernels = []
with watching(lambda kernel, loaded: kernels.append((kernel, loaded))):
    if sys.argv[1] == "everything":
        from pushplan.evaluation.policies import policy_names
        from pushplan.evaluation.warmup import OTHERS, warm_up
        for name in (*policy_names(), *OTHERS):
            warm_up(name)
    else:
        from pushplan.planners import warm_up
        warm_up(sys.argv[1])
print(json.dumps([time.process_time() - busy, time.perf_counter() - began, kernels]))
"""


def measure(name: str, cache: str) -> tuple[float, float, list[str]]:
    """Warm up in a new process.

    Returns:
        CPU time [s], time [s] and the names of the kernels that Python called.
    """
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, name],
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    busy, took, kernels = json.loads(done.stdout.splitlines()[-1])
    return busy, took, sorted({kernel for kernel, _ in kernels})


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=(*_NAMES, _EVERYTHING))
    parser.add_argument("--write", action="store_true", help="write the names of the kernels")
    options = parser.parse_args()
    known = json.loads(_MANIFEST.read_text()) if options.write else {}
    print("| policy | kernels | cold [s of CPU] | warm [s of CPU] | warm [s] |")
    print("|---|---|---|---|---|")
    for name in options.names:
        with tempfile.TemporaryDirectory() as cache:
            cold, _, kernels = measure(name, cache)
            busy, took, _ = measure(name, cache)
        print(f"| {name} | {len(kernels)} | {cold:.1f} | {busy:.1f} | {took:.1f} |", flush=True)
        if name != _EVERYTHING:
            known[name] = kernels
    if options.write:
        _MANIFEST.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
