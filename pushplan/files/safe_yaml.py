"""YAML of plain values, bounded: PyYAML's safe loader on libyaml's parser, where it is built in.

Numbers are those of YAML 1.2 (core schema), as in JSON: ``1e3``, ``5e-2``, ``+.5``, ``0o17``, and
``012`` is twelve. ``1:30`` and dates are texts. Of YAML 1.1, whose files are many, ``1_000`` is a
number still, and ``yes`` and ``on`` are truth values, as yaml-cpp reads them too.
"""

from __future__ import annotations

import re
from typing import Any

import yaml
from yaml.composer import Composer

MAX_DEPTH = 64
"""Deepest nesting of lists and mappings, in JSON and YAML."""
LONGEST_NUMBER = 400
"""Most characters of a number in JSON and YAML: floats written out have 310."""
MAX_NODES = 60_000
"""Most values in a file, each counted as often as aliases repeat it."""
_WHOLE = "tag:yaml.org,2002:int"
_REAL = "tag:yaml.org,2002:float"
_TEXTS = ("tag:yaml.org,2002:timestamp", "tag:yaml.org,2002:value")
"""Tags of texts that YAML 1.1 takes for more than a text: dates and ``=``."""
_NUMBERS = {
    _WHOLE: re.compile(r"(?:[-+]?[0-9]+(?:_[0-9]+)*|0o[0-7]+|0x[0-9a-fA-F]+)\Z"),
    _REAL: re.compile(
        r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:_[0-9]+)*(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z"
    ),
}
"""YAML 1.2.2, section 10.3.2; what both take is a whole number."""
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
        before = self._nodes
        anchor = event.anchor
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
            name: Any = id(key)
            if isinstance(key, yaml.ScalarNode):
                name = (key.tag, key.value)
            if name in seen:
                raise _refusal(f"the key {key.value!r} stands in one mapping twice", key)
            seen.add(name)
        return node


class _Dumper(yaml.SafeDumper):
    """Quotes the texts that readers of either version would take for a number."""


_Loader.yaml_implicit_resolvers = {
    first: [(tag, rule) for tag, rule in rules if tag not in (*_NUMBERS, *_TEXTS)]
    for first, rules in _Safe.yaml_implicit_resolvers.items()
}
for _kind in (_Loader, _Dumper):
    for _tag, _rule in _NUMBERS.items():
        _kind.add_implicit_resolver(_tag, _rule, list("-+.0123456789"))


def _whole(loader: _Loader, node: Any) -> int:
    text = loader.construct_scalar(node)
    return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))


_Loader.add_constructor(_WHOLE, _whole)


def _refusal(problem: str, at: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=at.start_mark)


def load(text: str) -> Any:
    """The values of a text, or what PyYAML raises."""
    loader = _Loader(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def dump(data: Any, **style: Any) -> str:
    """A text that `load` reads back equal, with the keys in their order."""
    return str(yaml.dump(data, Dumper=_Dumper, sort_keys=False, **style))
