"""Controllers as C against those in Python: time of a step, size of code and memory.

python benchmarks/codegen.py [--steps 400]

Both get the same poses, recorded with the controller in Python in closed loop; C is timed in a
loop of its own, so that calls from Python do not count. gcc must be installed.
"""

from __future__ import annotations

import argparse
import ctypes
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "codegen"))
from generated_controller import Generated
from test_codegen import AREA, SQUARE, push, track

from pushplan.codegen import write_pushing_mpc, write_tracking_mpc
from pushplan.control import MpcConfig, MpcTracker
from pushplan.planners.pushing import PushingConfig, PushingMpc

WALLS = [[(3.0, -6.0), (4.0, -6.0), (4.0, -5.0), (3.0, -5.0)]]


def main() -> None:
    """Print one row for each controller."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=400)
    steps = parser.parse_args().steps
    print(
        "| controller | N | flags | Python [µs] | C [µs] | ratio "
        "| code [kB] | struct [kB] | stack [kB] |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for count in (10, 20, 40):
        config = MpcConfig(horizon=count)
        worlds, plan, _, _ = track(AREA, config, 0.005, steps)
        row("tracking-mpc", count, worlds, plan, lambda: MpcTracker(config))  # noqa: B023
    for count in (10, 20, 40):
        config = PushingConfig(horizon=count, moves=min(count, 10))
        worlds, plan, _, _ = push(AREA, 1.0, config, 0.002, steps, WALLS)
        row("pushing-mpc", count, worlds, plan, lambda: PushingMpc(config))  # noqa: B023


def row(name, count, worlds, plan, make) -> None:
    """Print times and sizes of one controller."""
    times = []
    for _ in range(2):  # the first round loads what is loaded once
        controller, times = make(), []
        for world in worlds:
            began = time.thread_time()
            controller.command(world, plan)
            times.append(time.thread_time() - began)
    python = 1e6 * float(np.median(times))
    for flags in (["-O2"], ["-O3", "-march=native"]):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            if name == "tracking-mpc":
                write_tracking_mpc(path, AREA, controller.config)
            else:
                write_pushing_mpc(path, AREA, SQUARE, controller.config)
            stem = name.replace("-", "_")
            taken = timed(path, stem, worlds, plan, flags)
            code, stack = sizes(path, stem, flags)
            struct = Generated(path, stem, 0 if "push" in name else None).bytes
        print(
            f"| {name} | {count} | {' '.join(flags)} | {python:.0f} | {taken:.1f} | "
            f"{python / taken:.1f} | {code / 1e3:.0f} | {struct / 1e3:.0f} | {stack / 1e3:.1f} |",
            flush=True,
        )


def timed(folder: Path, name: str, worlds, plan, flags: list[str]) -> float:
    """Median time of a step [µs], each one timed in C."""
    pushes = name == "pushing_mpc"
    generated = Generated(folder, name, 0 if pushes else None)
    generated.arguments(worlds[0], plan)
    inputs = [np.concatenate([[w.time], w.robot_pose, w.movables.poses[0]]) for w in worlds]
    inputs = np.array(inputs).ravel()
    box = ", in + 7 * i + 4" if pushes else ""
    argument = f"const {name}_obstacles *map, " if pushes else ""
    (folder / "timed.c").write_text(
        f"""#define _POSIX_C_SOURCE 199309L
#include "{name}.h"
#include <time.h>
void run({name} *c, const {name}_path *path, {argument}const double *in, double *ns, int n) {{
    for (int i = 0; i < n; i++) {{
        struct timespec a, b;
        double out[2];
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
        {name}_step(c, path, {"map, " if pushes else ""}in[7 * i], in + 7 * i + 1{box}, out);
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
        ns[i] = 1e9 * (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec);
    }}
}}
"""
    )
    library = folder / "timed.so"
    sources = [folder / "timed.c", folder / f"{name}.c"]
    subprocess.run(
        ["gcc", "-std=c99", *flags, "-shared", "-fPIC", "-o", library, *sources, "-lm"], check=True
    )
    taken = np.zeros(len(worlds))
    pointer = ctypes.POINTER(ctypes.c_double)
    maps = [ctypes.byref(generated._map)] if pushes else []
    data, times = inputs.ctypes.data_as(pointer), taken.ctypes.data_as(pointer)
    path = ctypes.byref(generated._path)
    ctypes.CDLL(str(library)).run(generated._struct, path, *maps, data, times, len(worlds))
    return float(np.median(taken)) / 1e3


def sizes(folder: Path, name: str, flags: list[str]) -> tuple[int, int]:
    """Bytes of code with constants, and of all stack frames together (no function calls itself)."""
    subprocess.run(
        ["gcc", "-std=c99", *flags, "-fstack-usage", "-c", f"{name}.c", "-o", "sized.o"],
        check=True,
        cwd=folder,
    )
    listed = subprocess.check_output(["size", "sized.o"], cwd=folder, text=True).splitlines()[1]
    usage = next(folder.glob("*.su")).read_text()
    frames = [int(found) for found in re.findall(r"\t(\d+)\t", usage)]
    return int(listed.split()[0]), sum(frames)


if __name__ == "__main__":
    main()
