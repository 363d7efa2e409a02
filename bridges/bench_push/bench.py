"""Our policies in the original environments, scored by the original code and by ours.

    python bridges/bench_push/bench.py --python BENCHNPIN/bin/python [--scenes maze-5,ship_ice]
        [--policies straight,push-aware] [--seeds 0-29] [--out runs/bench_push] [--page PAGE.md]

``--python`` is the interpreter of a virtual environment that has ``benchnpin`` (see the README
beside this file). Each policy of ours runs in a process of `pushplan serve`, each scene in a
process of that interpreter; so do policies of theirs, ``theirs:NAME`` or ``theirs:FILE.py:CLASS``.
Episodes that are there already are not run again, nor those whose scores a file has that
``--scores`` names, to which the new ones are added.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from episodes import Run, file_of, keep, mend, read, recalled, whole
from tables import report, write

HERE = Path(__file__).parent
VARIATIONS = {
    "maze": ("3", "5", "10"),
    "ship_ice": ("10", "20", "30", "40", "50"),
    "area_clearing": ("clear_env", "clear_env_turning", "walled_env", "walled_env_with_columns"),
    "box_delivery": ("small_empty", "small_columns"),
}
POLICIES = {
    "maze": ("straight", "kinodynamic-rrt", "push-aware-constant-speed"),
    "ship_ice": ("straight", "ship-lattice", "ship-predictive"),
    "area_clearing": ("greedy", "gtsp-mpc"),
    "box_delivery": ("greedy", "gtsp-mpc"),
}
THEIRS = {"maze": ("theirs:rrt",), "ship_ice": ("theirs:lattice",)}
"""Needs a checkout of the original's repository."""
GTSP = {"area_clearing": ("theirs:gtsp",)}
"""Needs a solver, too."""
_REMEDY = f"""{{python}} cannot import benchnpin. With Python 3.10 or 3.11, make a virtual
environment for it:
  python -m venv benchnpin
  benchnpin/bin/pip install -r {HERE.relative_to(HERE.parents[1])}/requirements.txt
  benchnpin/bin/pip install --no-deps benchnpin==0.1.1
and give --python benchnpin/bin/python"""


def main() -> int:
    """Run what is missing and print the tables; 1 if episodes are missing then."""
    parser = parser_of()
    parser.add_argument("--scores", type=Path, metavar="FILE.csv", help="go on with these scores")
    options = parser.parse_args()
    try:
        scenes = chosen(options.scenes)
        first, last = (int(seed) for seed in options.seeds.split("-"))
        if not 0 <= first <= last:
            raise ValueError
    except ValueError as error:
        parser.error(str(error) or "--seeds are FIRST-LAST, such as 0-29")
    original = original_of(options, parser)
    say(f"original: {original}")
    options.out.mkdir(parents=True, exist_ok=True)
    seeds = range(first, last + 1)
    wanted = [
        Run(original, scene, variation, policy, seeds, options.most_steps)
        for scene, variation in scenes
        for policy in policies_for(scene, options)
    ]
    if options.scores:
        try:
            wanted = [recalled(run, options.scores) for run in wanted]
        except (OSError, ValueError) as error:
            parser.error(str(error))
    runs = []
    for run in wanted:
        runs.append(finished(run, options))
        if options.scores:
            keep(runs[-1], options.scores)
    for scene in dict.fromkeys(run.scene for run in runs if run.episodes):
        text = report([run for run in runs if run.scene == scene and run.episodes])
        say(text)
        if options.page:
            write(options.page, text, f"bench.py {scene}")
    lacking = [run for run in runs if run.missing]
    for run in lacking:
        say(f"{run.name}: {len(run.episodes)} of {len(run.seeds)} episodes; again to go on")
    return 1 if lacking else 0


def original_of(options: argparse.Namespace, parser: argparse.ArgumentParser) -> str:
    """Name and version of the installed package, of which the checkout has to be, too."""

    def ask(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [options.python, *arguments]
        return subprocess.run(command, capture_output=True, env=without_python(), text=True)

    try:
        there = ask("-c", "import benchnpin").returncode == 0
    except OSError:
        there = False
    if not there:
        parser.error(_REMEDY.format(python=options.python))
    checkout = [str(options.original)] if options.original else []
    asked = ask(str(HERE / "versions.py"), *checkout)
    if asked.returncode:
        said = asked.stderr.strip().splitlines() or ["versions.py failed"]
        parser.exit(2, f"bench.py: {said[-1]}\n")
    return asked.stdout.strip()


def parser_of() -> argparse.ArgumentParser:
    """The options."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--python", required=True, help="interpreter that has benchnpin")
    parser.add_argument("--scenes", default=",".join(VARIATIONS), metavar="A,B")
    parser.add_argument("--policies", metavar="A,B", help="default: those that suit the scene")
    parser.add_argument("--seeds", default="0-29", metavar="FIRST-LAST")
    parser.add_argument("--most-steps", type=int, default=20_000, help="of an episode")
    parser.add_argument("--out", type=Path, default=Path("runs/bench_push"))
    parser.add_argument("--page", type=Path, help="also put the tables there, as Markdown")
    parser.add_argument(
        "--original",
        type=Path,
        metavar="FOLDER",
        help="checkout of the original's repository, for its planners theirs:rrt, theirs:lattice",
    )
    parser.add_argument(
        "--glns",
        metavar="COMMAND",
        help="the solver that theirs:gtsp calls; 'ours' has it call that of pushplan instead",
    )
    parser.add_argument("--only-report", action="store_true", help="tables of what is there")
    return parser


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


def policies_for(scene: str, options: argparse.Namespace) -> Sequence[str]:
    """Those that were asked for, or that suit the scene and can run."""
    if options.policies:
        return options.policies.split(",")
    theirs = THEIRS.get(scene, ()) if options.original else ()
    gtsp = GTSP.get(scene, ()) if options.original and options.glns else ()
    return (*POLICIES[scene], *theirs, *gtsp)


def finished(run: Run, options: argparse.Namespace) -> Run:
    """A run with all of its episodes, as far as they can be had."""
    out = file_of(options.out, run.scene, run.variation, run.policy)
    lines = whole(out, run)
    missing = [seed for seed in run.missing if seed not in lines]
    if missing and not options.only_report:
        say(f"{run.name}: {len(missing)} episodes")
        mend(out, lines)
        drive(run, missing, out, options)
    return read(run, out)


def drive(run: Run, seeds: Sequence[int], out: Path, options: argparse.Namespace) -> None:
    """Drive these seeds, and say what failed; each episode is in the file once it is over."""
    arguments = ["--scene", run.scene, "--variation", run.variation, "--out", str(out.resolve())]
    arguments += ["--seeds", ",".join(map(str, seeds)), "--most-steps", str(options.most_steps)]
    arguments += ["--named", run.original]
    if options.original:
        arguments += ["--original", str(options.original.resolve())]
    if options.glns:
        ours = f"{sys.executable} {HERE.resolve() / 'glns.py'}"
        arguments += ["--glns", ours if options.glns == "ours" else options.glns]
    with served(run.policy) as policy, tempfile.TemporaryDirectory() as scratch:
        done = subprocess.run(
            [options.python, "-W", "ignore", str(HERE.resolve() / "drive.py"), policy, *arguments],
            env=without_python(),
            cwd=scratch,  # their planners leave files behind
            stderr=subprocess.PIPE,
            text=True,
        )
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"ended with {done.returncode}"]
        traceback = [line for line in said if not line.startswith(("seed ", "theirs:"))]
        complaints = [line for line in said if line.startswith(("seed ", "theirs:"))]
        for line in complaints or traceback[-1:]:
            say(f"{run.name}: {line}")


def without_python() -> dict[str, str]:
    """The variables of this process for another interpreter, which has packages of its own."""
    return {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}


@contextmanager
def served(policy: str) -> Iterator[str]:
    """What `drive.py` takes for a policy: the address of a server of it, which ends with the block.

    Policies of theirs need no server.
    """
    if policy.startswith("theirs:"):
        name, colon, kind = policy.removeprefix("theirs:").rpartition(":")
        yield f"theirs:{Path(name).resolve()}:{kind}" if colon else policy
        return
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


if __name__ == "__main__":
    sys.exit(main())
