"""YAML of plain values, bounded: PyYAML's safe loader on libyaml's parser, where it is built in."""

from __future__ import annotations

from typing import Any

import yaml
from yaml.composer import Composer

from pushplan.world.safe_files import LONGEST_NUMBER, MAX_DEPTH

MAX_NODES = 60_000
"""Most values in a file, each counted as often as aliases repeat it."""
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
if hasattr(yaml, "CSafeLoader"):

    class _Safe(Composer, yaml.CSafeLoader):
        """The composer of libyaml recurses without a bound: Python's composes its events."""

        def __init__(self, text: str) -> None:
            yaml.CSafeLoader.__init__(self, text)
            Composer.__init__(self)

else:
    _Safe = yaml.SafeLoader  # type: ignore[misc,assignment]


class _Loader(_Safe):
    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._nodes = 0
        self._depth = 0
        self._sizes: dict[str, int] = {}  # nodes below an anchor, once it has been composed

    def compose_node(self, parent: Any, index: Any) -> Any:
        event: Any = self.peek_event()
        before, anchor = self._nodes, event.anchor
        alias = self.check_event(yaml.AliasEvent)
        if alias and anchor in self.anchors and anchor not in self._sizes:
            raise _refusal(f"the alias {anchor!r:.40} is a part of itself", event)
        self._nodes += self._sizes.get(anchor, 1) if alias else 1
        if self._nodes > MAX_NODES:
            raise _refusal(f"{MAX_NODES:,} values are the most", event)
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise _refusal(f"lists and mappings may be nested {MAX_DEPTH} deep", event)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if not alias and anchor is not None:
            self._sizes[anchor] = self._nodes - before
        return node

    def construct_scalar(self, node: Any) -> Any:
        if node.tag in _NUMBERS and len(node.value) > LONGEST_NUMBER:
            raise _refusal(f"a number may have {LONGEST_NUMBER} digits at most", node)
        return super().construct_scalar(node)

    def compose_mapping_node(self, anchor: Any) -> Any:
        node = super().compose_mapping_node(anchor)
        seen = set()
        for key, _ in node.value:
            name = (key.tag, key.value) if isinstance(key, yaml.ScalarNode) else id(key)
            if name in seen:
                raise _refusal(f"the key {key.value!r} stands in one mapping twice", key)
            seen.add(name)
        return node


def _refusal(problem: str, at: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=at.start_mark)


def load(text: str) -> Any:
    """The values of a text, or what PyYAML raises."""
    loader = _Loader(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()
