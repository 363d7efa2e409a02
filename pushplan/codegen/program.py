"""Kernels and all that they call, as one C program."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from pushplan.codegen.c_types import CType, record_type, type_of, values_type
from pushplan.codegen.expressions import Term
from pushplan.codegen.functions import Function

_HELPERS = Path(__file__).with_name("helpers.c")


class Program:
    """Collects the functions and types that some kernels need, callees first.

    The C does what the kernels do, operation by operation. Kernels may use numbers, arrays of one
    and two dimensions, named tuples, and other such kernels; none may make an array.
    """

    def __init__(self) -> None:
        self._helpers = _HELPERS.read_text(encoding="utf-8").strip()
        self._taken = set(re.findall(r"(\w+)\(", self._helpers))
        self._functions: dict[Any, tuple[str, Function]] = {}
        self._records: dict[str, dict[str, CType]] = {}
        self._values: dict[str, CType] = {}

    def add(self, kernel: Any, arguments: list[Any]) -> str:
        """Translate a kernel for arguments such as these; returns its name in C.

        Raises:
            InvalidInputError: if a kernel does what has no translation.
        """
        for argument in arguments:
            self._know(argument)
        return self.call(kernel, [type_of(argument) for argument in arguments])[0]

    def call(self, kernel: Any, types: list[CType]) -> Term:
        """See `Library`."""
        if kernel not in self._functions:
            name = kernel.py_func.__name__.strip("_")
            while name in self._taken:
                name += "_"
            self._taken.add(name)
            function = Function(self, kernel, name, types)
            self._functions[kernel] = (name, function)
            if function.returns.kind == "values":
                self.values(list(function.returns.parts))
        name, function = self._functions[kernel]
        return name, function.returns

    def make(self, kind: type, types: list[CType]) -> CType:
        """See `Library`."""
        made = record_type(kind)
        fields: tuple[str, ...] = kind._fields  # type: ignore[attr-defined]
        self._records.setdefault(made.name, dict(zip(fields, types, strict=True)))
        return made

    def values(self, types: list[CType]) -> CType:
        """See `Library`."""
        kind = values_type(tuple(types))
        return self._values.setdefault(kind.name, kind)

    def fields(self, record: CType) -> dict[str, CType]:
        """See `Library`."""
        return self._records[record.name]

    def _know(self, example: Any) -> None:
        """Know the record types of an example."""
        if isinstance(example, tuple):
            for field in example:
                self._know(field)
            self.make(type(example), [type_of(field) for field in example])

    def text(self) -> str:
        """The program, without what the standard library declares."""
        records = [
            "\n".join(["typedef struct {", *_declared(fields.items()), f"}} {name};"])
            for name, fields in self._records.items()
        ]
        values = [
            "\n".join(
                [
                    "typedef struct {",
                    *_declared((f"f{i}", part) for i, part in enumerate(kind.parts)),
                    f"}} {name};",
                ]
            )
            for name, kind in self._values.items()
        ]
        functions = [function.code for _, function in self._functions.values()]
        return "\n\n".join([self._helpers, *records, *values, *functions]) + "\n"


def _declared(fields: Any) -> list[str]:
    return [f"    {kind.name} {name};" for name, kind in fields]
