"""Output that cannot be written as it is, and Ctrl-C at any time: a clean end, nothing lost."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

BENCH = ["bench", "maze-2d-3", "--policies", "straight", "--episodes", "2", "--workers", "1"]
WRITTEN = ("report.html", "summary.md", "summary.csv")


def pushplan(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "pushplan", *arguments],
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "timeout": 120, **options},
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run directory whose report was made for an output that knows ASCII alone."""
    out = tmp_path_factory.mktemp("streams") / "run"
    environ = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = pushplan(*BENCH, "--out", str(out), env=environ)
    assert done.returncode == 0 and b"Traceback" not in done.stderr, done.stderr
    assert all((out / name).is_file() for name in WRITTEN)
    return out


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_tables_are_shown_in_the_signs_that_an_output_has(run: Path, encoding: str):
    said = []
    for command in (["report"], ["runs", "compare", str(run)], ["report", "--format", "latex"]):
        environ = {**os.environ, "PYTHONIOENCODING": encoding}
        done = pushplan(*command, str(run), env=environ)
        assert done.returncode == 0 and not done.stderr, done.stderr
        said.append(done.stdout.decode(encoding))
    sign = "+-" if encoding == "ascii" else "±"
    rule = "─" if encoding == "utf-8" else "-"
    assert f" {sign} 0." in said[0] and 40 * rule in said[0] and 40 * rule in said[1]


def test_names_of_files_that_are_no_text_can_be_named(tmp_path: Path):
    out = os.fsencode(tmp_path) + b"/\xff.json"
    done = pushplan("ice", "--concentration", "0.1", "--out", out)
    assert done.returncode == 0 and os.path.isfile(out), done.stderr
    assert rb"\udcff.json" in done.stdout


@pytest.mark.parametrize("command", [["report", "RUN"], ["list", "all"], ["--help"]])
def test_a_reader_that_has_gone_is_no_error_to_tell(run: Path, command: list[str]):
    for name in WRITTEN:
        (run / name).unlink(missing_ok=True)
    reads, writes = os.pipe()
    os.close(reads)
    given = [str(run) if word == "RUN" else word for word in command]
    done = pushplan(*given, stdout=writes)
    os.close(writes)
    assert not done.stderr and done.returncode <= 1
    if "report" in command:
        assert all((run / name).is_file() for name in WRITTEN)


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_outputs_that_a_shell_has_closed_are_left_alone(closed: str):
    for command, code in (("list policies", 0), ("runs status nothing", 2)):
        line = f"'{sys.executable}' -m pushplan {command} {closed}"
        done = subprocess.run(["sh", "-c", line], capture_output=True, timeout=120)
        assert done.returncode == code and b"Traceback" not in done.stderr, done.stderr


INTERRUPTED = """
import os, signal, sys

class Interrupts:
    '''Presses Ctrl-C where a module is looked for, in an import that reports errors as its own.'''

    def find_spec(self, name, *_):
        if name == sys.argv[0]:
            try:
                os.kill(os.getpid(), signal.SIGINT)
                for _ in range(1000):
                    pass
            except KeyboardInterrupt:
                raise ImportError("a library could not be loaded") from None

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Interrupts())
sys.argv = [{name!r}, "run", "maze-3d-3", "--policy", "kinodynamic-rrt", "--seed", "1"]
from pushplan.cli import main
sys.exit(main())
"""


@pytest.mark.parametrize("name", ["argparse", "pushplan.cli.parser", "numpy", "ompl", "mujoco"])
def test_ctrl_c_in_an_import_ends_the_command_without_a_traceback(name: str):
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED.replace("{name!r}", repr(name))],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (130, "pushplan: interrupted\n")


def test_ctrl_c_that_python_drops_in_a_finalizer_comes_again(tmp_path: Path):
    own = tmp_path / "own.py"
    own.write_text(
        "import os, signal, time\n"
        "from pushplan.world import Twist\n"
        "class Finalized:\n"
        "    def __del__(self):\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "        time.sleep(0.0)\n"
        "class Own:\n"
        "    def reset(self, world, rng):\n"
        "        Finalized()\n"
        "    def act(self, world, observation):\n"
        "        time.sleep(0.01)\n"
        "        return Twist(0.0, 0.0)\n"
    )
    start = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    code = f"{start} from pushplan.cli import main; main()"
    words = ["run", "maze-2d-3", "--policy", f"{own}:Own", "--seed", "1"]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, timeout=120)
    assert done.stderr == b"pushplan: interrupted\n"
