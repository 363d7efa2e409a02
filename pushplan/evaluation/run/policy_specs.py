"""Policy of a job: a name, a text that names a class, or a factory."""

from __future__ import annotations

import contextlib
import functools
import inspect
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

import numpy as np

from pushplan.errors import describe, place
from pushplan.evaluation.store.source_digests import (
    code_digest,
    file_digest,
    source_digest,
)
from pushplan.imports.named_objects import load_object, names_to_give
from pushplan.imports.on_demand import missing
from pushplan.world import (
    Deadline,
    InvalidInputError,
    Planner,
    Policy,
    PushplanError,
    Stop,
    UnknownNameError,
)

_LABEL = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+@-]{0,63}")


class UnusablePolicyError(InvalidInputError):
    """A policy cannot be made, or is made for nothing that it is asked to run."""


@dataclass(frozen=True)
class PolicySpec:
    """Recipe for a policy that works in whatever process the job runs.

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
            raise UnusablePolicyError(
                "a policy's label is 1 to 64 letters, digits and '_.+@-', "
                f"not beginning with '.+@-', got {self.label!r}"
            )

    @property
    def identity(self) -> str:
        """A text that tells sources apart, with a hash of the files that hold them.

        A file that has been edited is another policy, one that was moved is not. What it imports
        counts where it is local; see `source_digest`.
        """
        options = "".join(
            f" {key}={described(value)}" for key, value in sorted(self.options.items())
        )
        if not isinstance(self.source, str):
            return f"{described(self.source)}{options}"
        if (file := self.network) is not None:
            from pushplan.learned.sb3_policy import beside

            return f"{file.name}{file_digest(file)}{file_digest(beside(file))}{options}"
        where, _, name = self.source.rpartition(":")
        shown = Path(where).name if where.endswith(".py") else where
        return f"{shown}{':' if where else ''}{name}{source_digest(where)}{options}"

    @property
    def is_ours(self) -> bool:
        """True if the policy runs code of pushplan only: a name, or the file of a network."""
        named = isinstance(self.source, str) and ":" not in self.source
        return named or self.network is not None

    @property
    def group(self) -> str:
        """Key of the policies that may share a process: empty for our code, else this label."""
        ours = self.is_ours and not str(self.source).startswith("sb3:")  # such a file holds code
        return "" if ours else self.label

    @property
    def network(self) -> Path | None:
        """The file of the network, if it is one."""
        from pushplan.learned.loading import (
            LEARNED_PREFIXES,
            learned_file,
            learned_names,
            weights_of,
        )

        if not isinstance(self.source, str):
            return None
        if self.source.startswith(LEARNED_PREFIXES):
            return learned_file(self.source)
        if self.source in learned_names():
            return weights_of(self.source)
        return None

    def make(self) -> Policy:
        """A fresh policy.

        Raises:
            UnusablePolicyError: if the source gives neither a policy nor a planner, or raises: with
                what it raised and where.
        """
        with _saying_what_fails("policy", self.label):
            if not self.is_ours:
                return as_policy(self._made_object(), self.label, self.options.get("stop"))
            if self.network is not None:
                from pushplan.learned import load_policy

                return load_policy(str(self.source), self.label, **self.options)
            from pushplan.planners import make_policy

            return make_policy(str(self.source), **self.options)

    def make_planner(self) -> Planner:
        """A fresh planner, of a source that `parse_planner` read.

        Raises:
            UnusablePolicyError: if the source gives no planner, or raises: with what it raised and
                where.
        """
        with _saying_what_fails("planner", self.label):
            if self.is_ours:
                from pushplan.planners import make_planner

                return make_planner(str(self.source), **self.options)
            made = self._made_object()
        if callable(getattr(made, "plan", None)):
            return cast(Planner, made)
        if callable(getattr(made, "act", None)):
            raise UnusablePolicyError(_NO_PLANNER.format(self.label))
        raise UnusablePolicyError(
            f"planner {self.label!r} is a {type(made).__name__}, which has no method plan"
        )

    def _made_object(self) -> Any:
        """Call the source, or the callable that it names, and return the result."""
        source: Any = self.source
        if isinstance(source, str):
            source = load_object(source)
        options = dict(self.options)
        if "stop" in options and not _takes_stop(source):
            del options["stop"]  # a planner gets it with each call
        return source(**options)


def _takes_stop(source: Any) -> bool:
    parameters = inspect.signature(source).parameters
    return "stop" in parameters or any(p.kind is p.VAR_KEYWORD for p in parameters.values())


def with_deadline(spec: PolicySpec, seconds: float) -> PolicySpec:
    """The policy with a wall-clock limit of each planning call, or as it is if it takes none.

    Args:
        spec: a policy of ours, or a class or function of a user's that gives a policy or planner.
        seconds: the limit [s].

    Raises:
        InvalidInputError: if the limit is not a positive number.
        UnusablePolicyError: if the policy cannot be made.
    """
    limited = replace(spec, options={**spec.options, "stop": Deadline(seconds)})
    if spec.network is not None:
        return spec
    try:
        made = limited.make()
    except UnusablePolicyError as error:
        if spec.is_ours and isinstance(error.__cause__, UnknownNameError):
            return spec
        raise
    source: Any = spec.source
    if isinstance(source, str) and not spec.is_ours:
        source = load_object(source)
    takes = spec.is_ours or _takes_stop(source) or getattr(made, "stop", None) is not None
    return limited if takes else spec


def described(value: Any, depth: int = 8) -> str:
    """A text that tells values apart in whatever process: with the content of code and files."""
    if isinstance(value, PolicySpec):
        return value.identity
    if isinstance(value, str):
        return repr(value) + file_digest(value)
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape} sha256:{sha256(value.tobytes()).hexdigest()[:12]}"
    if depth == 0:
        return type(value).__name__  # an object may hold itself
    if isinstance(value, functools.partial):
        value = {"partial": value.func, **value.keywords, "args": value.args}
    if isinstance(value, Mapping):
        parts = [f"{key!r}: {described(one, depth - 1)}" for key, one in value.items()]
        return f"{{{', '.join(parts)}}}"
    if isinstance(value, list | tuple | set | frozenset):
        parts = [described(one, depth - 1) for one in value]
        if isinstance(value, set | frozenset):
            parts.sort()  # their order is not the same in every process
        return f"{type(value).__name__}({', '.join(parts)})"
    if is_dataclass(value) or callable(value) or " object at 0x" in repr(value):
        return _code_in_words(value, depth)
    return re.sub(r"0x[0-9a-f]+", "0x", repr(value))


def _code_in_words(thing: Any, depth: int) -> str:
    """A class, a function or another object: the name of its code, a hash, and what it holds."""
    kind = thing if hasattr(thing, "__qualname__") else type(thing)
    module = _module_of(kind)
    held = [cell.cell_contents for cell in getattr(thing, "__closure__", None) or ()]
    held += [getattr(thing, name, None) for name in ("__defaults__", "__kwdefaults__", "__self__")]
    if kind is not thing:
        held.append(getattr(thing, "__dict__", None))
    text = f"{module}:{kind.__qualname__}{source_digest(module)}"
    if module.partition(".")[0] not in ("pushplan", "builtins"):
        text += code_digest(kind)
    return text + "".join(f" {described(one, depth - 1)}" for one in held if one is not None)


def _module_of(thing: Any) -> str:
    """The module of a class or a function; that of a script is ``__main__`` in workers, too."""
    module = str(thing.__module__)
    return "__main__" if module == "__mp_main__" else module


_NO_PLANNER = (
    "{!r} is a policy, not a planner: give it to 'pushplan run' or 'pushplan bench', with "
    "--task room --set world_file=FILE for a world file"
)


@contextlib.contextmanager
def _saying_what_fails(kind: str, label: str) -> Iterator[None]:
    """Raise one error for whatever goes wrong while something of a user's is made.

    Raises:
        UnusablePolicyError: with what was raised, and where in the user's code.
    """
    try:
        yield
    except (MemoryError, UnusablePolicyError):
        raise
    except (Exception, SystemExit) as error:
        ours = None if place(error) else missing(error) or error
        said = describe(error)
        if isinstance(ours, PushplanError):
            said = str(ours)
        raise UnusablePolicyError(f"{kind} {label!r} cannot be made: {said}") from error


def as_policy(thing: Any, label: str, stop: Stop | None = None) -> Policy:
    """A policy as it is; a planner, or an object with ``predict``, wrapped as one.

    Args:
        thing: the object.
        label: what errors call it.
        stop: of each call of a planner; its own default if None.

    Raises:
        InvalidInputError: if it is neither.
    """
    if callable(getattr(thing, "act", None)) and callable(getattr(thing, "reset", None)):
        return cast(Policy, thing)
    if callable(getattr(thing, "plan", None)):
        from pushplan.planners.following.plan_follower import policy_for

        return policy_for(thing, stop)
    if callable(getattr(thing, "predict", None)):
        from pushplan.learned import ObjectPolicy

        return ObjectPolicy(thing, label)
    raise InvalidInputError(
        f"a {type(thing).__name__} has neither the methods of a policy (reset, act) nor of a "
        "planner (plan) nor of a network (predict)"
    )


def policy_names() -> tuple[str, ...]:
    """The names of all policies that come with pushplan: classical, then trained."""
    from pushplan.learned import learned_names
    from pushplan.planners import policy_names as classical_names

    return (*classical_names(), *learned_names())


def parse_policy(given: str | Callable[..., Any] | PolicySpec) -> PolicySpec:
    """Read one policy as users give it.

    A text may begin with ``label=``; without it the label is the name, or the class's name.

    Raises:
        UnknownNameError: if it looks like a name and is not one.
        UnusablePolicyError: if it can be no policy at all.
    """
    if isinstance(given, PolicySpec):
        return given
    if isinstance(given, str):
        return _parse_text(given, "policy", policy_names())
    if not callable(given):
        raise UnusablePolicyError(
            "a policy is given as a name, 'onnx:FILE', 'sb3:FILE', 'module:Class', "
            f"'file.py:Class' or a callable that makes one, got {type(given).__name__}"
        )
    name = getattr(given, "__name__", type(given).__name__)
    return PolicySpec(re.sub(r"[^A-Za-z0-9_.-]", "", name) or "policy", given)


def parse_planner(given: str) -> PolicySpec:
    """Read one planner as users give it: a text as for `parse_policy`.

    Raises:
        UnknownNameError: if it looks like a name and is not one.
        UnusablePolicyError: if it can be no planner at all, or is a policy's name.
    """
    from pushplan.planners import planner_names

    names = planner_names()
    source = given.rpartition("=")[2]
    if source not in names and source in policy_names():
        raise UnusablePolicyError(_NO_PLANNER.format(source))
    return _parse_text(given, "planner", names)


def _parse_text(given: str, kind: str, names: Sequence[str]) -> PolicySpec:
    """Read a name, ``"onnx:FILE"``, ``"module:Class"`` ...; errors as `parse_policy`."""
    from pushplan.learned.loading import LEARNED_PREFIXES, learned_file

    label, equals, source = given.partition("=")
    if not equals:
        label = ""
        source = given
    if source.startswith(LEARNED_PREFIXES):
        path = learned_file(source)
        name = re.sub(r"[^A-Za-z0-9_.+@-]", "_", path.stem).lstrip(".+@-")[:64]
        return PolicySpec(label or name or "policy", f"{source.partition(':')[0]}:{path}")
    where, colon, name = source.rpartition(":")
    file = where if colon else source
    if file.endswith(".py"):
        path = Path(file).expanduser().resolve()
        if not path.is_file():
            raise UnusablePolicyError(f"{kind} {given!r}: there is no file {file}")
        if not colon or not name:
            with _saying_what_fails("policy", file):
                named = names_to_give(file, {"act", "plan", "predict"})
            raise UnusablePolicyError(f"{kind} {given!r} {named}")
        return PolicySpec(label or name, f"{path}:{name}")
    if colon:
        return PolicySpec(label or name, source)
    if source not in names:
        raise UnknownNameError(kind, source, names)
    return PolicySpec(label or source, source)


def parse_policies(
    given: str | Sequence[str | Callable[..., Any] | PolicySpec],
) -> list[PolicySpec]:
    """Read several policies: a list, or one text with commas.

    Raises:
        UnusablePolicyError: if there is none, or two share a label.
    """
    items: Sequence[Any] = given.split(",") if isinstance(given, str) else given
    stripped = [item.strip() if isinstance(item, str) else item for item in items]
    specs = [parse_policy(item) for item in stripped if item != ""]
    if not specs:
        raise UnusablePolicyError("at least one policy is needed")
    for label, count in Counter(spec.label for spec in specs).items():
        if count > 1:
            raise UnusablePolicyError(
                f"two policies are labelled {label!r}: tell them apart as 'label=policy'"
            )
    return specs
