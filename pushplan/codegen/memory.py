"""The memory of a kernel as one plain struct of C."""

from __future__ import annotations

from typing import Any

import numpy as np

from pushplan.codegen.expressions import literal


class MemoryStruct:
    """A named tuple of parameters and arrays, flattened into the fields of a struct.

    An array that stands in two places is one field.

    Args:
        memory: named tuple with the values to begin with.
    """

    def __init__(self, memory: Any) -> None:
        self._memory = memory
        self._fields: dict[str, Any] = {}
        self._of_array: dict[int, str] = {}
        self._collect(memory, "")

    def _collect(self, value: Any, name: str) -> None:
        if isinstance(value, tuple):
            for field in value._fields:  # type: ignore[attr-defined]
                self._collect(getattr(value, field), f"{name}_{field}" if name else field)
        elif isinstance(value, np.ndarray):
            if id(value) not in self._of_array:
                self._of_array[id(value)] = name
                self._fields[name] = value
        else:
            self._fields[name] = value

    def name_of(self, array: Any) -> str:
        """The field that holds an array."""
        return self._of_array[id(array)]

    def declared(self) -> list[str]:
        """The fields, parameters first."""
        lines = []
        for name, value in self._fields.items():
            if not isinstance(value, np.ndarray):
                kind = "bool" if isinstance(value, bool) else "int" if _whole(value) else "double"
                lines.append(f"    {kind} {name};")
        for name, value in self._fields.items():
            if isinstance(value, np.ndarray):
                kind = "int" if value.dtype.kind == "i" else "double"
                shape = " x ".join(str(size) for size in value.shape)
                lines.append(f"    {kind} {name}[{max(value.size, 1)}]; /* {shape} */")
        return lines

    def set(self) -> list[str]:
        """Statements that set the fields that are not zero."""
        lines = []
        for name, value in self._fields.items():
            if not isinstance(value, np.ndarray):
                lines.append(f"    self->{name} = {literal(value)[0]};")
            elif value.size and (value == value.flat[0]).all():
                if value.flat[0] != 0:
                    each, size = literal(value.flat[0].item())[0], value.size
                    lines.append(f"    for (i = 0; i < {size}; i++) self->{name}[i] = {each};")
            elif value.size:
                for i, each in enumerate(value.ravel().tolist()):
                    if each != 0:
                        lines.append(f"    self->{name}[{i}] = {literal(each)[0]};")
        return lines

    def view(self) -> str:
        """The named tuple that the functions take, as an initialiser."""
        return self._view(self._memory, "")

    def _view(self, value: Any, name: str) -> str:
        if isinstance(value, tuple):
            parts = [
                self._view(getattr(value, field), f"{name}_{field}" if name else field)
                for field in value._fields  # type: ignore[attr-defined]
            ]
            return "{" + ", ".join(parts) + "}"
        if isinstance(value, np.ndarray):
            sizes = ", ".join(str(size) for size in value.shape)
            return f"{{self->{self.name_of(value)}, {sizes}}}"
        return f"self->{name}"


def _whole(value: Any) -> bool:
    return isinstance(value, int | np.integer)
