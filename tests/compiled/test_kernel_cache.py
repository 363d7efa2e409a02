"""The cache of compiled kernels: kept, shared, damaged, and where none can be."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

_TWICE = """
import logging
logging.basicConfig(format="%(message)s")
from pushplan.compiled import kernel, watching

@kernel
def half(x):
    return 0.5 * x

@kernel
def twice(x):
    return 4.0 * half(x)

ready = []
with watching(lambda name, loaded: ready.append((name.rpartition(".")[2], loaded))):
    assert twice(3.0) == 6.0
print(ready)
"""


@pytest.fixture
def module(tmp_path: Path) -> Path:
    path = tmp_path / "doubling.py"
    path.write_text(_TWICE)
    return path


def _run(path: Path, cache: Path | str, **more: str) -> tuple[str, str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), **more}
    done = subprocess.run(
        [sys.executable, path], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.strip(), done.stderr


_COMPILED = "[('twice', False)]"
_LOADED = "[('twice', True)]"


def test_a_second_process_loads_what_the_first_compiled(module: Path, tmp_path: Path) -> None:
    assert _run(module, tmp_path / "cache") == (_COMPILED, "")
    assert _run(module, tmp_path / "cache") == (_LOADED, "")


@pytest.mark.slow
def test_on_a_disk_without_locks_nobody_waits(module: Path, tmp_path: Path) -> None:
    module.write_text(
        "import errno, fcntl, time\n"
        "def refuse(*arguments):\n"
        "    raise OSError(errno.ENOLCK, 'no locks')\n"
        "def wait(seconds):\n"
        "    raise AssertionError('it waits')\n"
        "fcntl.flock, time.sleep = refuse, wait\n" + _TWICE
    )
    assert _run(module, tmp_path / "cache") == (_COMPILED, "")
    assert _run(module, tmp_path / "cache") == (_LOADED, "")


@pytest.mark.slow
def test_a_kernel_is_compiled_anew_when_one_that_it_calls_changes(
    module: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    _run(module, cache)
    module.write_text(_TWICE.replace("0.5 * x", "0.25 * x").replace("== 6", "== 3"))
    assert _run(module, cache) == (_COMPILED, "")
    assert len(list(cache.rglob("*.nbc"))) == 2  # those of the old code are gone


_TUPLES = """
import sys
sys.path.insert(0, {folder!r})
from {home} import Pair
from pushplan.compiled import kernel, watching

@kernel
def total(pair):
    return pair.a + pair.b

ready = []
with watching(lambda name, loaded: ready.append((name.rpartition(".")[2], loaded))):
    assert total(Pair(1.0, 2.0)) == 3.0
print(ready)
"""


@pytest.mark.slow
def test_a_class_of_arguments_that_has_moved_is_no_error(tmp_path: Path) -> None:
    module, cache = tmp_path / "totals.py", tmp_path / "cache"
    for home, said in (("one", "False"), ("other", "False"), ("other", "True")):
        for path in tmp_path.glob("*.py"):
            path.unlink()
        classes = (
            "from typing import NamedTuple\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"
        )
        (tmp_path / f"{home}.py").write_text(classes)
        module.write_text(_TUPLES.format(folder=str(tmp_path), home=home))
        assert _run(module, cache) == (f"[('total', {said})]", "")


@pytest.mark.slow
def test_damaged_files_are_one_warning_each_and_replaced(module: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    _run(module, cache)
    for number, path in enumerate(sorted(cache.rglob("*.nbc"))):
        content = path.read_bytes()
        path.write_bytes((b"garbage", content[: len(content) // 2])[number % 2])
    out, errors = _run(module, cache)
    assert out == _COMPILED
    assert errors.count("\n") == errors.count("is damaged, and compiled anew") == 1
    assert _run(module, cache) == (_LOADED, "")


_HOST = """
import llvmlite.binding
llvmlite.binding.get_host_cpu_name = lambda: {name!r}
"""


@pytest.mark.slow
def test_kernels_for_a_generic_processor_load_on_every_one(module: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    generic = {"NUMBA_CPU_NAME": "generic"}
    for host, said in (("one", _COMPILED), ("other", _LOADED)):
        module.write_text(_HOST.format(name=host) + _TWICE)
        assert _run(module, cache, **generic) == (said, "")
    module.write_text(_TWICE)
    assert _run(module, cache) == (_COMPILED, "")  # and those of this one are others
    assert _run(module, cache, **generic) == (_LOADED, "")  # which take nothing away


def test_a_folder_that_cannot_be_made_is_one_warning(module: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    out, errors = _run(module, tmp_path / "file" / "cache")
    assert out == _COMPILED
    assert errors.count("\n") == 1
    assert "cannot be written to" in errors and str(tmp_path / "file") in errors


@pytest.mark.slow
def test_processes_that_start_at_once_compile_each_kernel_once(
    module: Path, tmp_path: Path
) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    started = [
        subprocess.Popen(
            [sys.executable, module],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(3)
    ]
    outputs = [process.communicate() for process in started]
    assert [errors for _, errors in outputs] == 3 * [""]
    assert sorted(out.strip() for out, _ in outputs) == sorted([_COMPILED, _LOADED, _LOADED])


@pytest.mark.slow
def test_an_exception_of_a_called_kernel_reaches_python_from_the_cache(tmp_path: Path) -> None:
    module = tmp_path / "raising.py"
    module.write_text(
        "from pushplan.compiled import kernel\n"
        "@kernel\ndef check(x):\n    if x < 0.0:\n        raise ValueError('negative', 3)\n"
        "@kernel\ndef use(x):\n    check(x)\n    return x\n"
        "assert use(1.0) == 1.0\n"
        "try:\n    use(-1.0)\nexcept ValueError as error:\n    print(error.args)\n"
    )
    for _ in range(2):
        assert _run(module, tmp_path / "cache") == ("('negative', 3)", "")


@pytest.mark.slow
def test_without_a_chosen_folder_kernels_lie_beside_their_source(
    module: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    for expected in (_COMPILED, _LOADED):
        done = subprocess.run([sys.executable, module], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == expected
    assert (module.parent / "__pycache__").is_dir()
