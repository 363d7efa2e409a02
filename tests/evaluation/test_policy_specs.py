from __future__ import annotations

import functools
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from evaluation_doubles import HERE, Ahead, plain_policy

from pushplan.evaluation import PolicySpec, parse_policies, parse_policy
from pushplan.world import InvalidInputError, Policy, UnknownNameError

PLANNER = """
class Lazy:
    def plan(self, world, *, stop=None, rng=None):
        raise NotImplementedError

class Neither:
    pass
"""


def test_names_texts_and_callables_make_policies() -> None:
    for given in ("straight", f"{HERE}:Ahead", "evaluation_doubles:Ahead", Ahead, plain_policy):
        assert isinstance(parse_policy(given).make(), Policy)


def test_labels() -> None:
    assert parse_policy("straight").label == "straight"
    assert parse_policy(f"{HERE}:Ahead").label == "Ahead"
    assert parse_policy(f"mine={HERE}:Ahead").label == "mine"
    assert parse_policy(plain_policy).label == "plain_policy"
    with pytest.raises(InvalidInputError, match="label"):
        PolicySpec("a/b", "straight")
    with pytest.raises(InvalidInputError, match="two policies are labelled 'straight'"):
        parse_policies("straight,straight")
    assert [spec.label for spec in parse_policies("straight, b=straight")] == ["straight", "b"]


def test_a_thread_waits_for_the_file_that_another_one_loads(tmp_path: Path) -> None:
    path = tmp_path / "slow.py"
    path.write_text(f"import time\ntime.sleep(0.2)\n{PLANNER}")
    with ThreadPoolExecutor(4) as pool:
        made = list(pool.map(lambda _: parse_policy(f"{path}:Lazy").make(), range(4)))
    assert len({type(policy.planner) for policy in made}) == 1


def test_a_planner_is_wrapped(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(PLANNER)
    assert isinstance(parse_policy(f"{file}:Lazy").make(), Policy)
    with pytest.raises(InvalidInputError, match="neither the methods of a policy"):
        parse_policy(f"{file}:Neither").make()
    assert str(tmp_path) in sys.path  # so that the file can import its neighbours


def test_what_does_not_exist_is_named() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'straight'"):
        parse_policy("strait")
    with pytest.raises(InvalidInputError, match=r"no file nowhere\.py"):
        parse_policy("nowhere.py:Policy")
    with pytest.raises(InvalidInputError, match="did you mean 'Ahead'"):
        parse_policy(f"{HERE}:Ahed").make()
    with pytest.raises(InvalidInputError, match="cannot load"):
        parse_policy("no_such_module:Policy").make()
    with pytest.raises(InvalidInputError, match="at least one"):
        parse_policies("")


def test_identity_follows_the_code_and_not_the_place(tmp_path: Path) -> None:
    one, two = tmp_path / "a" / "mine.py", tmp_path / "b" / "mine.py"
    for file in (one, two):
        file.parent.mkdir()
        file.write_text(PLANNER)
    before = parse_policy(f"{one}:Lazy").identity
    assert parse_policy(f"{two}:Lazy").identity == before
    one.write_text(PLANNER + "\n# changed\n")
    assert parse_policy(f"{one}:Lazy").identity != before
    with_option = PolicySpec("p", functools.partial(plain_policy, speed=2.0))
    assert with_option.identity != PolicySpec("p", plain_policy).identity
