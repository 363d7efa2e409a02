"""Our policies in the original environments, scored by the original code and by ours.

    python bridges/bench_push/bench.py --python BENCHNPIN/bin/python [--scenes maze-5,ship_ice]
        [--policies straight,push-aware] [--seeds 0-29] [--out runs/bench_push] [--page PAGE.md]

``--python`` is the interpreter of a virtual environment that has ``benchnpin`` (see the README
beside this file). Each policy runs in a process of `pushplan serve`, each scene in a process of
that interpreter. Episodes that are there already are not run again.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.evaluation.statistics import Estimate, estimate
from pushplan.metrics import compute
from pushplan.world import Episode, world_from_dict

HERE = Path(__file__).parent
VARIATIONS = {
    "maze": ("3", "5", "10"),
    "ship_ice": ("10", "20", "30", "40", "50"),
    "area_clearing": ("clear_env", "walled_env", "walled_env_with_columns"),
    "box_delivery": ("small_empty", "small_columns"),
}
POLICIES = {
    "maze": ("straight", "kinodynamic-rrt", "push-aware-constant-speed"),
    "ship_ice": ("straight", "ship-lattice", "ship-predictive"),
    "area_clearing": ("greedy", "gtsp-mpc"),
    "box_delivery": ("greedy", "gtsp-mpc"),
}
"""The first is what the others are compared with."""
_REMEDY = f"""{{python}} cannot import benchnpin. With Python 3.10 or 3.11, make a virtual
environment for it:
  python -m venv benchnpin
  benchnpin/bin/pip install -r {HERE.relative_to(HERE.parents[1])}/requirements.txt
  benchnpin/bin/pip install --no-deps benchnpin==0.1.1
and give --python benchnpin/bin/python"""


@dataclass(frozen=True)
class Run:
    """What one policy did in one scene, by seed."""

    scene: str
    variation: str
    policy: str
    episodes: dict[int, dict[str, Any]]

    def values(self, by: str, name: str) -> dict[int, float]:
        """A score of every seed, by ``"theirs"`` or by ``"ours"``."""
        return {seed: one[by][name] for seed, one in self.episodes.items()}


def main() -> int:
    """Run what is missing and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--python", required=True, help="interpreter that has benchnpin")
    parser.add_argument("--scenes", default=",".join(VARIATIONS), metavar="A,B")
    parser.add_argument("--policies", metavar="A,B", help="default: those that suit the scene")
    parser.add_argument("--seeds", default="0-29", metavar="FIRST-LAST")
    parser.add_argument("--most-steps", type=int, default=20_000, help="of an episode")
    parser.add_argument("--out", type=Path, default=Path("runs/bench_push"))
    parser.add_argument("--page", type=Path, help="also write the tables there, as Markdown")
    options = parser.parse_args()
    try:
        scenes = chosen(options.scenes)
        first, last = (int(seed) for seed in options.seeds.split("-"))
        if not 0 <= first <= last:
            raise ValueError
    except ValueError as error:
        parser.error(str(error) or "--seeds are FIRST-LAST, such as 0-29")
    there = subprocess.run(
        [options.python, "-c", "import benchnpin"], capture_output=True, env=without_python()
    )
    if there.returncode:
        parser.error(_REMEDY.format(python=options.python))
    options.out.mkdir(parents=True, exist_ok=True)
    runs = []
    for scene, variation in scenes:
        policies = options.policies.split(",") if options.policies else POLICIES[scene]
        for policy in policies:
            out = options.out / f"{scene}-{variation}-{policy}-{first}-{last}.jsonl"
            if not complete(out, last - first + 1):
                say(f"{scene} {variation}: {policy}")
                drive(options.python, scene, variation, policy, (first, last), out, options)
            runs.append(read(scene, variation, policy, out))
    text = report(runs, (first, last))
    say(text)
    if options.page:
        options.page.write_text(text, encoding="utf-8")
    return 0


def say(text: str) -> None:
    """Print."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def chosen(text: str) -> list[tuple[str, str]]:
    """Scenes and variations of ``"maze,ship_ice-20"``: all variations where none is given."""
    found = []
    for word in text.split(","):
        scene, dash, variation = word.strip().partition("-")
        valid = VARIATIONS.get(scene, ())
        if not valid or (dash and variation not in valid):
            names = [f"{one}-{each}" for one, them in VARIATIONS.items() for each in them]
            raise ValueError(f"no scene {word!r} (valid: {', '.join([*VARIATIONS, *names])})")
        found += [(scene, one) for one in ([variation] if dash else valid)]
    return found


def complete(out: Path, count: int) -> bool:
    """Whether a file has that many episodes."""
    return out.is_file() and len(out.read_text(encoding="utf-8").splitlines()) >= count


def drive(
    python: str,
    scene: str,
    variation: str,
    policy: str,
    seeds: tuple[int, int],
    out: Path,
    options: argparse.Namespace,
) -> None:
    """Drive all seeds of one scene with one policy; the file is there when all are done."""
    partial = out.with_suffix(".part")
    arguments = ["--scene", scene, "--variation", variation, "--out", str(partial)]
    arguments += ["--seeds", f"{seeds[0]}-{seeds[1]}", "--most-steps", str(options.most_steps)]
    with served(policy) as address:
        done = subprocess.run(
            [python, "-W", "ignore", str(HERE / "drive.py"), address, *arguments],
            env=without_python(),
            capture_output=True,
            text=True,
        )
    if done.returncode:
        raise SystemExit(f"{scene} {variation}, {policy}: drive.py failed\n{done.stderr[-2000:]}")
    partial.replace(out)


def without_python() -> dict[str, str]:
    """The variables of this process for another interpreter, which has packages of its own."""
    return {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}


@contextmanager
def served(policy: str) -> Iterator[str]:
    """The address of a server of that policy, which ends with the block."""
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/policy.sock"
        command = [sys.executable, "-m", "pushplan", "serve", policy, "--socket", address]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        try:
            if not any(address in line for line in server.stdout):
                raise SystemExit(f"pushplan serve {policy} did not start")
            yield address
        finally:
            server.terminate()
            server.wait()


def read(scene: str, variation: str, policy: str, path: Path) -> Run:
    """The episodes of a file, with our scores beside theirs."""
    episodes = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        one = json.loads(line)
        one["ours"] = ours(scored(one))
        episodes[int(one["seed"])] = one
    return Run(scene, variation, policy, episodes)


def scored(one: dict[str, Any]) -> Episode:
    """An episode of ours from what `drive.py` wrote."""
    count = len(one["times"])
    return Episode(
        world=world_from_dict(one["world"]),
        times=np.array(one["times"]),
        robot_poses=np.array(one["robot_poses"]),
        object_poses=np.array(one["object_poses"]).reshape(count, -1, 3),
        success=one["success"],
        reason=one["reason"],
        completed=np.array(one["completed"]) if one["completed"] else None,
    )


def ours(episode: Episode) -> dict[str, float]:
    """Success, E and I as `pushplan bench` has them, and the work [kg m]."""
    found = compute(episode)
    kind = "manip" if "E_manip" in found else "nav"
    return {
        "S": found.get("S_manip", float(episode.success)),
        "E": found[f"E_{kind}"],
        "I": found[f"I_{kind}"],
        "work": found["interaction_work_kg_m"],
    }


def report(runs: Sequence[Run], seeds: tuple[int, int]) -> str:
    """All tables as Markdown."""
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    lines = [
        f"Seeds {seeds[0]} to {seeds[1]}, {today}, {platform.machine()}, {os.cpu_count()} cores. "
        "Means with 95 % bootstrap intervals; S, E and I by the original's code, in brackets by "
        "ours on the same trajectory; differences to the first policy on the same starts.",
    ]
    for scene, variation in dict.fromkeys((run.scene, run.variation) for run in runs):
        group = [run for run in runs if (run.scene, run.variation) == (scene, variation)]
        lines += ["", f"### {scene}, {variation}", ""]
        lines += ["| policy | S | E | I | work [kg m] | ΔE | ΔI | decision median, max [ms] |"]
        lines += ["|---|---|---|---|--:|---|---|--:|"]
        lines += [row(run, group[0]) for run in group]
    return "\n".join(lines) + "\n"


def row(run: Run, first: Run) -> str:
    """One line of a table."""
    cells = [f"`{run.policy}`"]
    for name in ("S", "E", "I"):
        values, own = run.values("theirs", name), run.values("ours", name)
        cells.append(
            f"{shown(estimate(list(values.values())))} ({np.mean(list(own.values())):.3f})"
        )
    cells.append(f"{np.mean(list(run.values('ours', 'work').values())):.3g}")
    for name in ("E", "I"):
        mine, other = run.values("theirs", name), first.values("theirs", name)
        gaps = [mine[seed] - other[seed] for seed in mine.keys() & other.keys()]
        cells.append("" if run is first else shown(estimate(gaps), "+"))
    waits = [1e3 * wait for one in run.episodes.values() for wait in one["act_s"]]
    cells.append(f"{np.median(waits):.2g}, {max(waits):.0f}")
    return "| " + " | ".join(cells) + " |"


def shown(value: Estimate, sign: str = "") -> str:
    """A mean with its interval."""
    return f"{value.mean:{sign}.3f} [{value.low:{sign}.3f}, {value.high:{sign}.3f}]"


if __name__ == "__main__":
    sys.exit(main())
