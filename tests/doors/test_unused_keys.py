"""Readers refuse or name every key that they do not use."""

from __future__ import annotations

import io
import json
import warnings
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doors import DOORS, Door, recorded

from pushplan.files.safe_files import parse_yaml
from pushplan.files.safe_yaml import dump
from pushplan.interaction.contact_parameters import ContactParameters
from pushplan.scenarios.rearrangement import load_relopush
from pushplan.world import PushplanError
from pushplan.world.stored.robots import turtlebot3_burger

STRANGE = "strange_key"
FREE = {"about", "training", "variations", "parameters"}
"""Mappings of facts that nobody interprets, and of options that a task or a planner checks."""


def check_named(read: Callable[[], Any], key: str = STRANGE) -> None:
    """The key is named by an error or a warning."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            read()
        except PushplanError as error:
            assert key in str(error), error
            return
    assert any(key in str(one.message) for one in caught), key


def strangers(data: Any, free: set[str] = FREE) -> Iterator[Any]:
    """The data with the strange key in one of its mappings."""
    if isinstance(data, dict):
        yield {**data, STRANGE: 1}
        for key, value in data.items():
            if key not in free:
                yield from ({**data, key: one} for one in strangers(value, free))
    elif isinstance(data, list):
        for k, value in enumerate(data):
            yield from ([*data[:k], one, *data[k + 1 :]] for one in strangers(value, free))


def nrc_ice(folder: Path) -> tuple[Path, bytes]:
    floe = {"location": [2, 2], "yaw": 30.0, "type": "polygon"}
    floe["perimeter"] = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    data = {"properties": {"field_size": [9, 9]}, "ice": {"0": floe}}
    return folder / "nrc.json", json.dumps(data).encode()


def relopush(folder: Path) -> tuple[Path, bytes]:
    one: dict[str, Any] = {"robot": [1.0, 1.0, 0.0], "raw_other": {"assign": [["b1", "d1"]]}}
    one |= {"objects": {"b1": [2.0, 2.0, 0.0]}, "goals": {"d1": [3.0, 3.0, 0.0]}}
    return folder / "relopush.json", json.dumps([one]).encode()


def contact(folder: Path) -> tuple[Path, bytes]:
    data = asdict(ContactParameters())
    return folder / "contact.json", json.dumps(data, default=np.ndarray.tolist).encode()


def read_relopush(path: Path) -> Any:
    return load_relopush(path, 0, robot=turtlebot3_burger())


MORE = {
    "ice-nrc": Door(nrc_ice, DOORS["ice-json"].read),
    "relopush": Door(relopush, read_relopush),
    "contact": Door(contact, ContactParameters.load),
}
STRUCTURED = ("world-yaml", "world-json", "scenarios", "ice-json", "map-yaml", "training")
STRUCTURED += ("specification", "experiment")


@pytest.mark.parametrize("name", (*STRUCTURED, *MORE))
def test_no_key_of_a_mapping_is_passed_over(name: str, tmp_path: Path) -> None:
    door = {**DOORS, **MORE}[name]
    path, good = door.make(tmp_path)
    write = json.dumps if path.suffix == ".json" else dump
    # a training lists the variations of its task as scenarios
    free = FREE | {"scenarios"} if name == "training" else FREE
    changed = list(strangers(parse_yaml(good.decode()), free))
    assert changed
    for data in changed:
        if isinstance(data, dict) and STRANGE in data.get("ice", ()):
            continue  # the name of a floe, not a key
        path.write_text(write(data))
        try:
            check_named(lambda: door.read(path))
        except AssertionError as error:
            error.add_note(str(data)[:1000])
            raise


@pytest.mark.parametrize("name", ["ice-npz", "episode-npz"])
def test_no_array_is_passed_over(name: str, tmp_path: Path) -> None:
    path, good = DOORS[name].make(tmp_path)
    array = io.BytesIO()
    np.save(array, np.zeros(2))
    path.write_bytes(good)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(f"{STRANGE}.npy", array.getvalue())
    check_named(lambda: DOORS[name].read(path))


def test_no_key_of_the_header_of_an_episode_is_passed_over(tmp_path: Path) -> None:
    path, _ = DOORS["episode-npz"].make(tmp_path)
    with np.load(path) as file:
        arrays = dict(file)
    for header in strangers(json.loads(str(arrays["header"]))):
        np.savez(path, **{**arrays, "header": np.array(json.dumps(header))})
        check_named(lambda: DOORS["episode-npz"].read(path))


@pytest.mark.parametrize(
    ("name", "line", "key"),
    [
        ("gtsp", "STRANGE_KEY: 1", "STRANGE_KEY"),
        ("gtsp", "DISPLAY_DATA_TYPE: NO_DISPLAY", "DISPLAY_DATA_TYPE"),
        ("gtsp", "EDGE_WEIGHT_FORMAT: FULL_MATRIX", "EDGE_WEIGHT_FORMAT"),
        ("gtsp", "FIXED_EDGES_SECTION\n1 4\n-1", "FIXED_EDGES_SECTION"),
        ("tour", "STRANGE_KEY: 1", "STRANGE_KEY"),
        ("tour", "EDGE_WEIGHT_TYPE: EUC_2D", "EDGE_WEIGHT_TYPE"),
        ("tour", "DEMAND_SECTION\n1 4", "DEMAND_SECTION"),
    ],
)
def test_no_keyword_or_section_is_passed_over(
    name: str, line: str, key: str, tmp_path: Path
) -> None:
    path, good = DOORS[name].make(tmp_path)
    head, rest = good.decode().split("\n", 1)
    path.write_text(f"{head}\n{line}\n{rest}")
    check_named(lambda: DOORS[name].read(path), key)


def test_what_is_used_is_not_named(tmp_path: Path) -> None:
    doors = {**DOORS, **MORE}
    for name in (*STRUCTURED, *MORE, "gtsp", "tour", "ice-npz", "episode-npz", "episode-mcap"):
        path, good = doors[name].make(tmp_path)
        path.write_bytes(good)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            doors[name].read(path)


def test_no_topic_or_record_of_a_log_is_passed_over(tmp_path: Path) -> None:
    from pushplan.ros import load_episode
    from pushplan.ros.mcap_writer import EPISODE, McapWriter

    def add(writer: McapWriter, kind: str) -> None:
        library = writer._writer
        if kind == "topic":
            schema = library.register_schema("std_msgs/msg/Empty", "ros2msg", b"")
            channel = library.register_channel(STRANGE, "cdr", schema)
            library.add_message(channel, 0, b"\0\1\0\0", 0)
        elif kind == "metadata":
            library.add_metadata(STRANGE, {})
        elif kind == "attachment":
            library.add_attachment(0, 0, STRANGE, "text/plain", b"x")
        else:
            writer.episode(1.0, {"strange_key": 1})

    for kind in ("topic", "metadata", "attachment", "field"):
        path = tmp_path / f"{kind}.mcap"
        writer = McapWriter(path)
        writer.world(recorded().world)
        add(writer, kind)
        writer.close()
        if kind == "field":
            with pytest.raises(PushplanError, match="is not a log of this version"):
                load_episode(path)
        else:
            check_named(lambda path=path: load_episode(path))
    # a record that has the name of a topic is not taken for its messages
    path = tmp_path / "named.mcap"
    writer = McapWriter(path)
    writer.world(recorded().world)
    writer._writer.add_metadata(EPISODE, {})
    writer.close()
    check_named(lambda: load_episode(path), EPISODE)


def test_no_metadata_of_a_network_is_passed_over(tmp_path: Path) -> None:
    from pushplan.learned.loading import weights_of
    from pushplan.learned.onnx_policy import read_specification

    key = STRANGE.encode()
    pair = b"\x0a%c%b\x12\x011" % (len(key), key)
    path = tmp_path / "model.onnx"
    # one more entry of field 14 of the model, its metadata
    path.write_bytes(weights_of("maze-sac").read_bytes() + b"\x72%c%b" % (len(pair), pair))
    check_named(lambda: read_specification(path))
