"""Episodes as MCAP files, and MCAP files as episodes."""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.files.safe_files import MAX_BYTES, name_unused, parse_json, read_bytes
from pushplan.imports.on_demand import need
from pushplan.ros.mcap_writer import (
    COMMAND,
    DROPPED,
    EPISODE,
    SCHEMA,
    STATE,
    TOPICS,
    WORLD,
    McapWriter,
)
from pushplan.ros.ros_messages import RosbagsTypes
from pushplan.world import Episode, SchemaError
from pushplan.world.checks import FloatArray
from pushplan.world.stored.world_files import world_from_dict

_READ = (WORLD, STATE, COMMAND, EPISODE)
_KEPT = ("completed", "actions", "rewards", "act_times_s", "plan_times_s")


def save_episode(episode: Episode, path: str | Path) -> None:
    """Write an episode as MCAP, which `load_episode` reads back exactly.

    Raises:
        InvalidInputError: if the file cannot be written.
        MissingDependencyError: if `mcap` or `rosbags` is not installed.
    """
    with closing(McapWriter(path)) as writer:
        writer.scene(episode.world)
        for index in range(len(episode.times)):
            writer.world(episode.world_at(index))
        content: dict[str, Any] = {key: getattr(episode, key).tolist() for key in _KEPT}
        content |= {"success": episode.success, "reason": episode.reason}
        content |= {"about": dict(episode.about), "action_size": episode.actions.shape[1]}
        writer.episode(float(episode.times[-1]), content)


def load_episode(path: str | Path) -> Episode:
    """Read an MCAP log as an episode: one that `save_episode` wrote, or of a `McapLog`.

    A robot's log does not say whether it succeeded: it did if the last world is at the goal. Its
    actions are the commands. An object that is not seen keeps its last pose, and one that
    is seen first later stands there from the start.

    Raises:
        SchemaError: if the file is missing, truncated, or no log of pushplan.
        MissingDependencyError: if `mcap` is not installed.
    """
    logged = _messages(Path(path))
    if not logged[WORLD] or not logged[STATE]:
        raise SchemaError(f"{path} holds no world: the robot's loop ended before the first one")
    try:
        return _episode(logged)
    except (KeyError, TypeError, ValueError) as error:
        why = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise SchemaError(f"{path} is not a log of this version of pushplan: {why}") from error


def _messages(path: Path) -> Mapping[str, list[Any]]:
    """The messages of our own topics, in the order of their times, and what was lost."""
    library = need("mcap.stream_reader")
    types = RosbagsTypes()
    data = read_bytes(path, "log")
    channels: dict[int, Any] = {}
    unused = set[str]()
    messages = []
    by_topic = defaultdict[str, list[Any]](list)
    with _whole(path):
        for record in _records(library, data):
            kind = type(record).__name__
            if kind == "Channel":
                channels[record.id] = record
            elif kind == "Message" and channels[record.channel_id].topic in _READ:
                messages.append(record)
            elif kind == "Metadata" and record.name == DROPPED:
                by_topic[DROPPED].append(record.metadata)
            elif kind in ("Metadata", "Attachment"):
                unused.add(f"{kind.lower()} {record.name}")
    found = {channel.topic: channel for channel in channels.values()}
    if WORLD not in found or found[WORLD].metadata.get("schema") != SCHEMA:
        raise SchemaError(
            f"{path} is no log of this version of pushplan: it needs topic {WORLD} with schema "
            f"{SCHEMA!r}, found {', '.join(sorted(found)) or 'no topic'}"
        )
    name_unused(str(path), unused | {f"topic {topic}" for topic in found.keys() - TOPICS.keys()})
    with _whole(path):
        for message in sorted(messages, key=lambda message: message.log_time):
            topic = channels[message.channel_id].topic
            by_topic[topic].append(types.deserialize(message.data, TOPICS[topic]))
    return by_topic


def _records(library: Any, data: bytes) -> Iterator[Any]:
    """All records of a file, one after the other: the summary at its end may be missing."""
    left = MAX_BYTES
    reader = library.StreamReader(
        io.BytesIO(data), emit_chunks=True, validate_crcs=True, record_size_limit=MAX_BYTES
    )
    for record in reader.records:
        if type(record).__name__ != "Chunk":
            yield record
            continue
        left -= record.uncompressed_size
        if left < 0:
            raise ValueError(f"its chunks hold more than {MAX_BYTES:,} bytes")
        yield from library.breakup_chunk(record, validate_crc=True)


@contextmanager
def _whole(path: Path) -> Iterator[None]:
    """Say that a file is damaged; the kind of error depends on where its bytes are wrong."""
    try:
        yield
    except Exception as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise SchemaError(
            f"{path} is not a whole MCAP file ({why}): it is damaged, or its recorder was stopped "
            "before it could close it; 'mcap recover' of the MCAP tools saves the part that is "
            "there"
        ) from error


def _episode(logged: Mapping[str, list[Any]]) -> Episode:
    first = parse_json(logged[WORLD][0].json)
    states = logged[STATE]
    for state in states:
        if state.new_objects:
            first["movables"] += parse_json(state.new_objects)
    world = world_from_dict(first)
    poses = np.empty((len(states), len(world.movables), 3))
    rows = {number: k for k, number in enumerate(world.movables.ids.tolist())}
    now: FloatArray = np.array(world.movables.poses)
    for index, state in enumerate(states):
        now[[rows[number] for number in state.ids.tolist()]] = state.object_poses.reshape(-1, 3)
        poses[index] = now
    recorded: dict[str, Any] = {
        "times": np.array([state.time for state in states]),
        "robot_poses": np.array([state.robot_pose for state in states]),
        "object_poses": poses,
    }
    if logged[EPISODE]:
        end = parse_json(logged[EPISODE][-1].json)
        actions = np.reshape(end.pop("actions"), (-1, end.pop("action_size")))
        return Episode(world=world, **recorded, actions=actions, **end)
    # a robot's own: from what it saw, and the commands that it got
    commands = logged[COMMAND]
    dropped = [int(one["notes"]) for one in logged[DROPPED]]
    names = ["linear", "angular"]
    if world.robot.slides:
        names = ["linear", "lateral", "angular"]
    last = world.moved(robot_pose=recorded["robot_poses"][-1], movable_poses=poses[-1])
    ended = commands[-1].status if commands else "no command"
    return Episode(
        world=world,
        **recorded,
        success=last.goal_reached,
        reason="goal" if last.goal_reached else ended,
        completed=last.completed if world.goal_kind == "objects" else None,
        actions=np.reshape(
            [[getattr(one, name) for name in names] for one in commands], (-1, len(names))
        ),
        about={"source": "a robot's log", "dropped": sum(dropped)},
    )
