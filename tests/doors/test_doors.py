"""Files from strangers: whatever stands in them, the answer is a value or one short, clear line."""

from __future__ import annotations

import io
import json
import os
import stat
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import doors
import numpy as np
import pytest
import yaml
from doors import DOORS, check_message, feed, swapped

from pushplan.cli.common import variation
from pushplan.errors import LONGEST_MESSAGE, InvalidInputError, UnknownNameError, one_line
from pushplan.evaluation import Experiment
from pushplan.files.safe_files import parse_json, parse_yaml, read_bytes, read_npz
from pushplan.files.safe_yaml import dump
from pushplan.scenarios import load_scenarios
from pushplan.world import Episode, PushplanError, SchemaError, load_nav2_map, load_world
from pushplan.world.stored.nav2_map import read_nav2_grid

FILES = [name for name in DOORS if name not in ("policy-name", "variation")]


@pytest.mark.filterwarnings("ignore")  # of NumPy, of strange headers and values
@pytest.mark.parametrize("name", DOORS)
def test_mutations_give_a_value_or_one_line(name: str, tmp_path: Path) -> None:
    cost = feed(name, 6 if name == "experiment" else 30, tmp_path)
    assert cost.worst < 2.0 and cost.grown < 500.0


STRUCTURED = ("world-json", "scenarios", "ice-json", "map-yaml", "training", "specification")


@pytest.mark.filterwarnings("ignore::pushplan.world.outline_repair.OutlineWarning")
@pytest.mark.filterwarnings("error")  # nothing is said beside the one line
@pytest.mark.parametrize("name", STRUCTURED)
def test_any_value_of_any_key_may_be_wrong(name: str, tmp_path: Path) -> None:
    path, good = DOORS[name].make(tmp_path)
    write = json.dumps if path.suffix == ".json" else dump
    data = list(swapped(parse_yaml(good.decode())))
    picked = np.random.default_rng(1).permutation(len(data))[:50]
    for changed in (data[k] for k in picked.tolist()):
        path.write_text(write(changed))
        try:
            DOORS[name].read(path)
        except PushplanError as error:
            check_message(error)
        except BaseException as error:
            error.add_note(str(changed)[:2000])
            raise


def test_a_study_of_endless_episodes_is_one_line(tmp_path: Path) -> None:
    path, good = DOORS["experiment"].make(tmp_path)
    for wrong in (b"episodes: 2, seed", b"episodes: 2\n"):
        path.write_bytes(good.replace(wrong, wrong.replace(b"2", b"1" + b"0" * 30)))
        with pytest.raises(PushplanError, match=r"episodes must be in \[1, 100000\]"):
            DOORS["experiment"].read(path)
    path.write_bytes(good.replace(b"timeout_s: 60.0", b"timeout_s: 1e300"))
    assert DOORS["experiment"].read(path).jobs


@pytest.mark.slow
@pytest.mark.parametrize("name", DOORS)
def test_thousands_of_mutations_in_a_process_of_their_own(name: str) -> None:
    command = [sys.executable, "-W", "ignore", doors.__file__]
    done = subprocess.run(
        [*command, name, "500" if name == "experiment" else "4000"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-4000:]
    cost = doors.Cost(**json.loads(done.stdout))
    assert cost.worst < 2.0 and cost.grown < 500.0 and 0 < cost.accepted < 4000


def refusal(name: str, folder: Path, content: bytes | None = None) -> str:
    """What a door says of a file, in bounded time."""
    path, _ = DOORS[name].make(folder)
    if content is not None:
        path.write_bytes(content)
    begin = time.process_time()
    with pytest.raises(PushplanError) as caught:
        DOORS[name].read(path)
    assert time.process_time() - begin < 2.0
    check_message(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", FILES)
def test_only_regular_files_below_a_size_are_read(name: str, tmp_path: Path) -> None:
    path, _ = DOORS[name].make(tmp_path)
    path.unlink(missing_ok=True)
    for make, words in (
        (lambda: os.mkfifo(path), "a pipe, not a regular file"),
        (lambda: path.symlink_to("/dev/zero"), "a device, not a regular file"),
        (path.mkdir, "Is a directory"),
        (lambda: (path.touch(), os.truncate(path, 3 * 10**9)), "3,000,000,000 bytes"),
    ):
        make()
        begin = time.process_time()
        with pytest.raises(SchemaError, match=words) as caught:
            DOORS[name].read(path)
        check_message(caught.value)
        assert time.process_time() - begin < 2.0
        (path.rmdir if stat.S_ISDIR(path.stat().st_mode) else path.unlink)()
    with pytest.raises(SchemaError, match="No such file"):
        DOORS[name].read(path)


YAMLS = {
    "recursive": ("a: &a [*a, *a]", "part of itself"),
    "bomb": (
        "a0: &a0 [1]\n"
        + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)),
        "60,000 values",
    ),
    "merges": (
        "a0: &a0 {x: 1}\n"
        + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 12)),
        "60,000 values",
    ),
    "twice": ("movables: [1]\nmovables: []", "'movables' stands in one mapping twice"),
    "deep": ("[" * 500, "64 deep"),
    "deeper": ("[" * 100_000, "nest"),  # libyaml has a limit of its own since PyYAML 6.0.4
    "dashes": ("- " * 100_000, "64 deep"),
    "long": ("time: " + "9" * 5000, "400 digits"),
    "hexadecimal": ("time: 0x" + "f" * 5000, "400 digits"),
    "exponent": ("time: 1e" + "1" * 5000, "400 digits"),
    "many": ("[" + "1," * 60_000 + "1]", "60,000 values"),
    "escapes": ('"\\e[2J\\e[31m": 1', r"\x1b[2J"),
    "tag": ("!!bool maybe", "not valid YAML"),
    "object": ("!!python/object/apply:os.getcwd []", "not valid YAML"),
    "binary": ("\0", "not valid YAML"),
}  # fmt: skip


@pytest.mark.parametrize("attack", YAMLS)
def test_yaml_is_bounded(attack: str, tmp_path: Path) -> None:
    text, words = YAMLS[attack]
    for name in ("world-yaml", "scenarios", "map-yaml", "training"):
        if (attack, name) == ("escapes", "map-yaml"):
            continue  # which ignores keys that it does not know
        assert words in refusal(name, tmp_path, text.encode())


NUMBERS = {
    "1e3": 1000.0, "1E3": 1000.0, "1.0e3": 1000.0, "5e-2": 0.05, "-1e1": -10.0, "1e-09": 1e-9,
    "+.5": 0.5, ".5": 0.5, "1.": 1.0, "-.5e+3": -500.0, "12": 12, "+12": 12, "012": 12, "0o17": 15,
    "0x1F": 31, "1_000": 1000, "1_000.5": 1000.5, ".inf": float("inf"), "1e400": float("inf"),
    "1e3abc": "1e3abc", "1e": "1e", "e5": "e5", "1:30": "1:30", "0b1": "0b1", "1.2.3": "1.2.3",
    ".": ".", "2001-02-03": "2001-02-03", "=": "=", "'1e3'": "1e3", "yes": True, "Off": False,
    "~": None,
}  # fmt: skip


@pytest.mark.parametrize("written", NUMBERS)
def test_numbers_are_those_of_yaml_1_2(written: str) -> None:
    (found,) = parse_yaml(f"[{written}]")
    assert found == NUMBERS[written] and type(found) is type(NUMBERS[written])
    assert parse_yaml(dump([found, written])) == [found, written]
    assert yaml.safe_load(dump([written])) == [written]  # for readers of YAML 1.1 too


def test_every_door_reads_exponents(tmp_path: Path) -> None:
    path, good = DOORS["world-yaml"].make(tmp_path)
    path.write_bytes(
        good.replace(b"mass: 1.0", b"mass: 1e3").replace(b"radius: 1.0", b"radius: +5e-1")
    )
    world = load_world(path)
    assert world.robot.mass == 1000.0 == world.movables.masses[0] and world.goal.radius == 0.5
    path, good = DOORS["map-yaml"].make(tmp_path)
    path.write_bytes(good.replace(b"0.05", b"5e-2").replace(b"[0.0, 0.0", b"[-1e1, 1E-09"))
    _, side, origin = read_nav2_grid(path)
    assert side == 0.05 and origin.tolist() == [-10.0, 1e-9, 0.0]
    path, good = DOORS["scenarios"].make(tmp_path)
    path.write_bytes(good.replace(b"boxes: 3", b"time_limit: 1e3"))
    assert load_scenarios(path)[0].variations == {"time_limit": 1000.0}
    assert variation("time_limit=1e3") == ("time_limit", 1000.0)
    study = tmp_path / "study.yaml"
    study.write_text(
        "schema: pushplan-experiment/1\nsuites: [smoke]\npolicies:\n"
        "- {policy: straight, parameters: {spacing: 2e-1}}\n"
    )
    (policy,) = Experiment.load(study).policies
    assert policy.make().planner.spacing == 0.2


def test_what_yaml_may_hold() -> None:
    text = "a: &a {x: 1, y: [1.5, 2001-02-03]}\nb: *a\nc: {<<: *a, x: 2}\nd: !!str 5\n"
    data = parse_yaml(text)
    assert data["b"] == data["a"] and data["c"] == {**data["a"], "x": 2} and data["d"] == "5"
    assert parse_yaml("") is None
    assert parse_yaml("[" * 60 + "]" * 60) is not None


JSONS = {
    "deep": ("[" * 100_000, "64 deep"),
    "balanced": ("[" * 500 + "]" * 500, "64 deep"),
    "twice": ('{"movables": [1], "movables": []}', "'movables' stands in one mapping twice"),
    "long": ("9" * 5000, "400 digits"),
    "many": ("[" + "1," * 1_000_000 + "1]", "1,000,000 values"),
    "surrogate": ('{"\\ud800": 1}', ""),
    "no end of a text": ('"' + '\\"' * 1_000_000, "not valid JSON"),
    "no end of an escape": ('"\\"' * 300_000 + "\\", "not valid JSON"),
    "short numbers": ("[" + ("9" * 399 + "x") * 10_000, "not valid JSON"),
}


@pytest.mark.parametrize("attack", JSONS)
def test_json_is_bounded(attack: str, tmp_path: Path) -> None:
    text, words = JSONS[attack]
    for name in ("world-json", "ice-json", "specification"):
        if len(text) < 200_000 or name != "specification":  # which is shorter anyway
            assert words in refusal(name, tmp_path, text.encode())


def test_brackets_and_commas_in_texts_of_json_do_not_count() -> None:
    text = json.dumps({"a": '\\"[{' * 100 + "," * 1_100_000 + "9" * 500})
    assert parse_json(text) == json.loads(text)


def npz(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return path


def npy(shape: object, kind: str, data: bytes = b"") -> bytes:
    file = io.BytesIO()
    header = {"descr": kind, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)  # type: ignore[arg-type]
    return file.getvalue() + data


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (npy((10**10,), "<f8"), "80,000,000,000 bytes"),
        (npy((10**12,), "<U0"), "1,000,000,000,000 bytes"),
        (npy((2**62, 2**62, 4), "<f8"), "bytes"),
        (npy((-1, 3), "<f8"), "bytes"),
        (npy((4,), "<f8", b"1234"), "needs 32 bytes, got 4"),
        (npy((1,), "|O", b"cos\nsystem\n."), "numbers, truth values or texts"),
        (npy((1,), "<M8[s]", b"12345678"), "numbers, truth values or texts"),
        (npy((25_000_001,), "<f8", bytes(200_000_008)), "200,000,000 are left"),
        (b"\x93NUMPY\x01\x00\xff\xff" + b"(" * 65535, "Header"),
        (b"\x93NUMPY\x07\x00", "version"),
        (npy((1,), "<U1", b"\0\0\x11\0"), "0x110000, which is no character"),
        (npy((1,), ">U1", b"\0\x11\0\0"), "0x110000, which is no character"),
        (b"", "EOF"),
    ],
    ids=range(13),
)
def test_arrays_are_what_their_file_has_room_for(
    content: bytes, words: str, tmp_path: Path
) -> None:
    path = npz(tmp_path / "a.npz", values=content)
    begin = time.process_time()
    with pytest.raises(SchemaError) as caught:
        read_npz(path, "episode", ["values"])
    check_message(caught.value)
    assert words in str(caught.value)
    assert time.process_time() - begin < 2.0


def test_archives_have_the_members_that_they_need_and_no_others(tmp_path: Path) -> None:
    good = npy((2,), "<f8", np.array([1.0, 2.0]).tobytes())
    path = npz(tmp_path / "a.npz", a=good, b=good)
    assert read_npz(path, "file", ["a", "b"])["b"].tolist() == [1.0, 2.0]
    for names, words in ((["a"], "unknown key in it 'b'"), (["a", "b", "c"], "required key 'c'")):
        with pytest.raises(SchemaError, match=words):
            read_npz(path, "file", names)
    many = npz(tmp_path / "many.npz", **{f"a{i}": b"" for i in range(1001)})
    with pytest.raises(SchemaError, match="1000 members"):
        read_npz(many, "file", ["a"])
    path.write_bytes(b"PK")
    with pytest.raises(SchemaError, match="zip"):
        Episode.load(path)


def test_pictures_have_a_greatest_size(tmp_path: Path) -> None:
    from PIL import Image

    path, text = DOORS["map-yaml"].make(tmp_path)
    path.write_bytes(text.replace(b"map.pgm", b"great.png"))
    Image.new("1", (4097, 4096)).save(tmp_path / "great.png")
    with pytest.raises(SchemaError, match="16,777,216"):
        load_nav2_map(path)
    path.write_bytes(text.replace(b"map.pgm", b"map.gif"))
    Image.new("L", (4, 4)).save(tmp_path / "map.gif")
    with pytest.raises(SchemaError, match=r"map\.gif"):
        load_nav2_map(path)


def test_paths_that_are_none() -> None:
    for path in (None, 3, b"x"):
        with pytest.raises(InvalidInputError, match="must be a text"):
            read_bytes(path)  # type: ignore[arg-type]
    for text in ("a\0b", "x" * 5000, "\ud800"):
        with pytest.raises(SchemaError) as caught:
            load_world(text)
        check_message(caught.value)


def test_messages_are_short_and_printable() -> None:
    error = InvalidInputError("\x1b[2J\n" + "x" * 10**6 + "\u202e\udc80 the end")
    check_message(error)
    assert str(error).startswith("\\x1b[2J xxx") and str(error).endswith("\\u202e\\udc80 the end")
    check_message(UnknownNameError("suite", "\x07" * 1000, ["a" * 1000]))
    assert one_line("\x1b" * 1000) and len(one_line("\x1b" * 1000)) <= LONGEST_MESSAGE


def test_of_many_choices_the_nearest_are_named() -> None:
    names = [f"suite-{i}" for i in range(40)]
    text = str(UnknownNameError("suite", "suite-1x", names))
    assert "did you mean 'suite-1'" in text and "nearest of 40: suite-1" in text
    assert text.count("suite-") == 1 + 1 + 3
    assert "40 are valid, such as suite-0" in str(UnknownNameError("suite", "?", names))
    assert str(UnknownNameError("kind", "?", ["b", "a"])) == "unknown kind '?' (valid: a, b)"
