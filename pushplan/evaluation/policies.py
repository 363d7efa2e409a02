"""Which policy a job runs: a name, a text that names a class, or a factory."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from pushplan.world import InvalidInputError, Policy, UnknownNameError
from pushplan.world.named_objects import load_object

_LABEL = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+@-]{0,63}")


@dataclass(frozen=True)
class PolicySpec:
    """How to make a policy, in whatever process the job runs.

    Args:
        label: what results call it: letters, digits and ``_ . + @ -``, 64 at most.
        source: a name of `policy_names`, ``"onnx:FILE"`` or ``"sb3:FILE"``
            (`pushplan.learned.load_policy`), ``"module:Class"``, ``"path/to/file.py:Class"``, or a
            callable without required arguments. The class or callable gives a policy, a planner,
            which is then wrapped in the default policy, or an object with ``predict``.
        options: keyword arguments for it.
    """

    label: str
    source: str | Callable[..., Any]
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not _LABEL.fullmatch(self.label):
            raise InvalidInputError(
                "a policy's label is 1 to 64 letters, digits and '_.+@-', "
                f"not beginning with '.+@-', got {self.label!r}"
            )

    @property
    def identity(self) -> str:
        """A text that tells sources apart, with a hash of the file that holds them.

        A file that has been edited is another policy, one that was moved is not; what it imports
        does not count.
        """
        options = "".join(f" {key}={value!r}" for key, value in sorted(self.options.items()))
        if isinstance(self.source, str):
            if (file := _network_file(self.source)) is not None:
                return f"{file.name}{file_digest(file)}{options}"
            where, _, name = self.source.rpartition(":")
            shown = Path(where).name if where.endswith(".py") else where
            return f"{shown}{':' if where else ''}{name}{source_digest(where)}{options}"
        source: Any = self.source
        while isinstance(source, functools.partial):
            options += f" {source.args!r} {sorted(source.keywords.items())!r}"
            source = source.func
        where = getattr(source, "__module__", type(source).__module__)
        name = getattr(source, "__qualname__", type(source).__qualname__)
        return re.sub(r"0x[0-9a-f]+", "0x", f"{where}:{name}{source_digest(where)}{options}")

    @property
    def is_ours(self) -> bool:
        """Whether it runs code of pushplan only: a name, or the file of a network."""
        if not isinstance(self.source, str):
            return False
        return ":" not in self.source or self.network is not None

    @property
    def group(self) -> str:
        """What may share a process: code of ours, else this policy alone."""
        ours = self.is_ours and not str(self.source).startswith("sb3:")  # such a file holds code
        return "" if ours else self.label

    @property
    def network(self) -> Path | None:
        """The file of the network, if it is one."""
        return _network_file(self.source) if isinstance(self.source, str) else None

    def warm_up(self) -> None:
        """Load, once in a process, what a planner of ours may need in any step of an episode."""
        if isinstance(self.source, str) and self.is_ours and self.network is None:
            from pushplan.planners import warm_up

            warm_up(self.source)

    def make(self) -> Policy:
        """A fresh policy.

        Raises:
            UnknownNameError: if there is no policy of that name.
            InvalidInputError: if the source gives neither a policy nor a planner.
        """
        if not isinstance(self.source, str):
            return as_policy(self.source(**self.options), self.label)
        if _network_file(self.source) is not None:
            from pushplan.learned import load_policy

            return load_policy(self.source, self.label, **self.options)
        if ":" in self.source:
            return as_policy(load_object(self.source)(**self.options), self.label)
        from pushplan.planners import make_policy

        return make_policy(self.source, **self.options)


def as_policy(thing: Any, label: str) -> Policy:
    """A policy as it is; a planner, or an object with ``predict``, wrapped as one.

    Raises:
        InvalidInputError: if it is neither.
    """
    if callable(getattr(thing, "act", None)) and callable(getattr(thing, "reset", None)):
        return cast(Policy, thing)
    if callable(getattr(thing, "plan", None)):
        from pushplan.planners.following.plan_follower import policy_for

        return policy_for(thing)
    if callable(getattr(thing, "predict", None)):
        from pushplan.learned import ObjectPolicy

        return ObjectPolicy(thing, label)
    raise InvalidInputError(
        f"policy {label!r} is a {type(thing).__name__}, which has neither the methods of a policy "
        "(reset, act) nor of a planner (plan) nor of a network (predict)"
    )


def policy_names() -> tuple[str, ...]:
    """The names of all policies that come with pushplan: classical, then trained."""
    from pushplan.learned import learned_names
    from pushplan.planners import policy_names as classical_names

    return (*classical_names(), *learned_names())


def source_digest(where: str) -> str:
    """A hash of what a ``file.py`` or a module holds, in words; nothing for modules of ours."""
    return file_digest(Path(where) if where.endswith(".py") else _file_of(where))


def file_digest(file: Path | None) -> str:
    """A hash of a file's content, in words; nothing for none."""
    if file is None or not file.is_file():
        return ""
    found = file.stat()
    return _content_hash(file, found.st_mtime_ns, found.st_size, found.st_ino)


@functools.lru_cache(maxsize=256)
def _content_hash(file: Path, *_version: int) -> str:
    """`file_digest` of a file as it is; jobs by the thousand ask for the same one."""
    return f" sha256:{hashlib.sha256(file.read_bytes()).hexdigest()[:12]}"


def _file_of(module: str) -> Path | None:
    """The file of a module that is not ours; None if there is none."""
    if not module or module.partition(".")[0] == "pushplan":
        return None
    try:
        if module in sys.modules:
            found = getattr(sys.modules[module], "__file__", None)
        else:
            spec = importlib.util.find_spec(module)
            found = None if spec is None else spec.origin
    except (ImportError, ValueError, AttributeError):
        return None
    return None if found is None else Path(found)


def _network_file(source: str) -> Path | None:
    """The file of a network, if a source names one."""
    from pushplan.learned.loading import LEARNED_PREFIXES, learned_file, learned_names, weights_of

    if source.startswith(LEARNED_PREFIXES):
        return learned_file(source)
    return weights_of(source) if source in learned_names() else None


def parse_policy(given: str | Callable[..., Any] | PolicySpec) -> PolicySpec:
    """Read one policy as users give it.

    A text may begin with ``label=``; without it the label is the name, or the class's name.

    Raises:
        UnknownNameError: if it looks like a name and is not one.
        InvalidInputError: if it can be no policy at all.
    """
    if isinstance(given, PolicySpec):
        return given
    if isinstance(given, str):
        from pushplan.learned.loading import LEARNED_PREFIXES, learned_file

        label, equals, source = given.partition("=")
        if not equals:
            label, source = "", given
        if source.startswith(LEARNED_PREFIXES):
            path = learned_file(source)
            name = re.sub(r"[^A-Za-z0-9_.+@-]", "_", path.stem).lstrip(".+@-")[:64]
            return PolicySpec(label or name or "policy", f"{source.partition(':')[0]}:{path}")
        if ":" in source:
            where, _, name = source.rpartition(":")
            if where.endswith(".py"):
                path = Path(where).expanduser().resolve()
                if not path.is_file():
                    raise InvalidInputError(f"policy {given!r}: there is no file {where}")
                source = f"{path}:{name}"
            return PolicySpec(label or name, source)
        if source not in policy_names():
            raise UnknownNameError("policy", source, policy_names())
        return PolicySpec(label or source, source)
    if not callable(given):
        raise InvalidInputError(
            "a policy is given as a name, 'onnx:FILE', 'sb3:FILE', 'module:Class', "
            f"'file.py:Class' or a callable that makes one, got {type(given).__name__}"
        )
    name = getattr(given, "__name__", type(given).__name__)
    return PolicySpec(re.sub(r"[^A-Za-z0-9_.-]", "", name) or "policy", given)


def parse_policies(
    given: str | Sequence[str | Callable[..., Any] | PolicySpec],
) -> list[PolicySpec]:
    """Read several policies: a list, or one text with commas.

    Raises:
        InvalidInputError: if there is none, or two share a label.
    """
    items: Sequence[Any] = given.split(",") if isinstance(given, str) else given
    specs = [
        parse_policy(item.strip() if isinstance(item, str) else item)
        for item in items
        if not isinstance(item, str) or item.strip()
    ]
    if not specs:
        raise InvalidInputError("at least one policy is needed")
    labels = [spec.label for spec in specs]
    for label in labels:
        if labels.count(label) > 1:
            raise InvalidInputError(
                f"two policies are labelled {label!r}: tell them apart as 'label=policy'"
            )
    return specs
