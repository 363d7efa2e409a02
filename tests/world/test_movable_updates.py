"""Objects that are changed, added and removed by their ids: the same as if all were made anew."""

from dataclasses import fields

import numpy as np
import pytest
from conftest import make_u_maze
from hypothesis import given
from hypothesis import strategies as st

from pushplan.world import InvalidInputError, Movables


def some(ids: list[int], rng: np.random.Generator) -> Movables:
    """Regular outlines of 3 to 7 corners, anywhere."""
    outlines = []
    for corners in rng.integers(3, 8, size=len(ids)).tolist():
        angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
        outlines.append(np.column_stack([np.cos(angles), np.sin(angles)]) * rng.uniform(0.1, 1.0))
    return Movables.from_outlines(
        outlines,
        rng.normal(size=(len(ids), 3)),
        twists=rng.normal(size=(len(ids), 3)),
        masses=rng.uniform(0.1, 2.0, size=len(ids)),
        wheeled=rng.random(len(ids)) < 0.5,
        ids=np.array(ids, dtype=np.int64),
    )


def rebuilt(parts: list[tuple[Movables, int]]) -> Movables:
    """Objects, each given by where it comes from, made and checked anew."""
    names = ("masses", "wheeled", "twists", "ids")
    values = {name: np.array([getattr(m, name)[k] for m, k in parts]) for name in names}
    if not parts:
        return Movables.empty()
    return Movables.from_outlines(
        [m.outline(k) for m, k in parts], np.array([m.poses[k] for m, k in parts]), **values
    )


@given(
    st.lists(st.integers(0, 20), unique=True, max_size=8),
    st.lists(st.integers(0, 20), unique=True, max_size=8),
    st.integers(0, 10**6),
)
def test_updated_objects_equal_those_made_anew(old: list[int], new: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    before, changes = some(old, rng), some(new, rng)
    _ = before.radii, hash(before)  # what was worked out for the old ones must not stay
    removed = [label for label in old if label not in new and rng.random() < 0.5]
    parts = [
        (changes, new.index(label)) if label in new else (before, k)
        for k, label in enumerate(old)
        if label not in removed
    ]
    parts += [(changes, j) for j, label in enumerate(new) if label not in old]
    after, expected = before.updated(changes, removed), rebuilt(parts)
    assert after == expected and hash(after) == hash(expected)
    assert np.array_equal(after.radii, expected.radii)
    assert not any(getattr(after, field.name).flags.writeable for field in fields(after))


def test_objects_that_only_move_keep_the_arrays_of_their_outlines() -> None:
    rng = np.random.default_rng(0)
    before = some([5, 2, 9], rng)
    moved = before.select([1, 2]).moved_to(rng.normal(size=(2, 3)))
    after = before.updated(moved)
    assert after.vertices is before.vertices and after.offsets is before.offsets
    assert np.array_equal(after.poses[1:], moved.poses)
    assert np.array_equal(after.poses[0], before.poses[0])


def test_selected_objects_equal_those_made_anew() -> None:
    before = some([5, 2, 9, 4], np.random.default_rng(1))
    assert before.select([3, 0]) == rebuilt([(before, 3), (before, 0)])
    assert before.select([False, True, False, True]) == rebuilt([(before, 1), (before, 3)])
    with pytest.raises(InvalidInputError, match="once"):
        before.select([1, 1])


def test_a_world_is_updated_as_its_objects_are() -> None:
    world = make_u_maze([(1.0, 1.0, 0.0), (2.0, 1.0, 0.0)])
    change = world.movables.select([1]).moved_to([[2.5, 1.0, 0.3]])
    after = world.updated(change, removed=world.movables.ids[:1], time=3.0)
    assert after.time == 3.0 and after.movables == change and after.static is world.static
    with pytest.raises(InvalidInputError, match="removed"):
        world.updated(change, removed=[77])
    with pytest.raises(InvalidInputError, match="removed"):
        world.updated(change, removed=change.ids)
