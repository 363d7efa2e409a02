"""Expressions of a kernel as C."""

from __future__ import annotations

import ast
import math
from typing import Any, Protocol

from pushplan.codegen.c_types import (
    BOOL,
    DOUBLE,
    INT,
    CType,
    array_type,
    joined,
)
from pushplan.world import InvalidInputError

_BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/"}
_COMPARE = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_MATHS = {"arctan2": "atan2", "round": "rint", "isfinite": "isfinite", "abs": "fabs"}
_PLAIN = ("sin", "cos", "sqrt", "ceil", "floor", "hypot", "atan2")

Term = tuple[str, CType]


class Library(Protocol):
    """What expressions need to know of the program that they are part of."""

    def call(self, kernel: Any, types: list[CType]) -> Term:
        """Name and returned type of a kernel for arguments of these types."""

    def make(self, kind: type, types: list[CType]) -> CType:
        """Type of a record that is made of fields of these types."""

    def values(self, types: list[CType]) -> CType:
        """Type of a tuple of these types."""

    def fields(self, record: CType) -> dict[str, CType]:
        """Fields of a record."""


class Expressions:
    """Translates expressions of one function.

    Args:
        library: the program.
        names: what the function sees of its module.
        variables: types of its variables, by name.
    """

    def __init__(self, library: Library, names: dict[str, Any], variables: dict[str, CType]):
        self.library, self.names, self.variables = library, names, variables
        self.used: set[str] = set()
        """Variables that were read."""

    def of(self, node: ast.expr) -> Term:
        """C and type of an expression; of a record it is a pointer."""
        known, value = self.constant(node)
        if known:
            return literal(value)
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise unsupported(node)
        term: Term = method(node)
        return term

    def constant(self, node: ast.expr) -> tuple[bool, Any]:
        """Whether an expression is a number that the module knows, and it."""
        if isinstance(node, ast.Constant):
            return isinstance(node.value, bool | int | float), node.value
        found: Any = None
        if isinstance(node, ast.Name) and node.id not in self.variables:
            found = self.names.get(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.value.id not in self.variables:
                found = getattr(self.names.get(node.value.id), node.attr, None)
        return isinstance(found, bool | int | float), found

    def global_of(self, node: ast.expr) -> Any:
        """What a name of the module stands for; None for variables."""
        if isinstance(node, ast.Name) and node.id not in self.variables:
            return self.names.get(node.id)
        return None

    def _name(self, node: ast.Name) -> Term:
        if node.id not in self.variables:
            raise unsupported(node)
        self.used.add(node.id)
        return node.id, self.variables[node.id]

    def _binop(self, node: ast.BinOp) -> Term:
        (a, left), (b, right) = self.of(node.left), self.of(node.right)
        if isinstance(node.op, ast.Pow):
            if self.constant(node.right) != (True, 2):
                raise unsupported(node)
            return f"square({a})", DOUBLE
        if isinstance(node.op, ast.Mod):
            return f"({a} % {b})", INT
        kind = joined(left, right)
        if isinstance(node.op, ast.Div) and kind != DOUBLE:
            a, kind = f"(double)({a})", DOUBLE
        return f"({a} {_BINARY[type(node.op)]} {b})", kind

    def _unaryop(self, node: ast.UnaryOp) -> Term:
        code, kind = self.of(node.operand)
        if isinstance(node.op, ast.Not):
            return f"!({code})", BOOL
        return f"(-{code})", kind

    def _boolop(self, node: ast.BoolOp) -> Term:
        sign = " && " if isinstance(node.op, ast.And) else " || "
        return "(" + sign.join(self.of(value)[0] for value in node.values) + ")", BOOL

    def _compare(self, node: ast.Compare) -> Term:
        terms = [self.of(term)[0] for term in (node.left, *node.comparators)]
        parts = [
            f"({a} {_COMPARE[type(sign)]} {b})"
            for a, sign, b in zip(terms, node.ops, terms[1:], strict=False)
        ]
        return parts[0] if len(parts) == 1 else "(" + " && ".join(parts) + ")", BOOL

    def _tuple(self, node: ast.Tuple) -> Term:
        terms = [self.of(item) for item in node.elts]
        kind = self.library.values([each for _, each in terms])
        return f"({kind.name}){{{_joined(terms)}}}", kind

    def _ifexp(self, node: ast.IfExp) -> Term:
        test = self.of(node.test)[0]
        (a, one), (b, other) = self.of(node.body), self.of(node.orelse)
        return f"({test} ? {a} : {b})", joined(one, other)

    def _attribute(self, node: ast.Attribute) -> Term:
        base, kind = self.of(node.value)
        if kind.kind != "record":
            raise unsupported(node)
        field = self.library.fields(kind)[node.attr]
        code = f"{base[2:-1]}.{node.attr}" if base[:2] == "(&" else f"{base}->{node.attr}"
        return (f"(&{code})" if field.kind == "record" else code), field

    def _subscript(self, node: ast.Subscript) -> Term:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            base, _ = self.of(node.value.value)
            return f"{base}.{'nm'[self.constant(node.slice)[1]]}", INT
        if isinstance(node.value, ast.Tuple):
            items = ", ".join(self.of(item)[0] for item in node.value.elts)
            return f"((const double[]){{{items}}})[{self.of(node.slice)[0]}]", DOUBLE
        base, kind = self.of(node.value)
        if kind.kind == "values":
            place = self.constant(node.slice)[1]
            return f"{base}.f{place}", kind.parts[place]
        if isinstance(node.slice, ast.Slice):
            low = self.of(node.slice.lower)[0] if node.slice.lower else "0"
            high = self.of(node.slice.upper)[0] if node.slice.upper else f"{base}.n"
            return f"{'rows_of' if kind.rank == 2 else 'part_of'}({base}, {low}, {high})", kind
        indices = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        places = [self._place(base, "nm"[axis], index) for axis, index in enumerate(indices)]
        if kind.rank == 2 and len(places) == 1:
            return f"row_of({base}, {places[0]})", array_type(1)
        number = INT if kind.name == "ints" else DOUBLE
        if kind.rank == 2:
            return f"{base}.at[{places[0]} * {base}.m + {places[1]}]", number
        return f"{base}.at[{places[0]}]", number

    def _place(self, base: str, size: str, index: ast.expr) -> str:
        if isinstance(index, ast.UnaryOp) and isinstance(index.op, ast.USub):
            return f"({base}.{size} - {self.of(index.operand)[0]})"
        return self.of(index)[0]

    def _call(self, node: ast.Call) -> Term:
        if isinstance(node.func, ast.Attribute):
            return self._maths(node, node.func.attr)
        assert isinstance(node.func, ast.Name)
        name, target = node.func.id, self.global_of(node.func)
        if name in ("min", "max"):
            return self._extreme(name, node.args)
        terms = [self.of(argument) for argument in node.args]
        types = [kind for _, kind in terms]
        if name == "abs":
            return f"{'abs' if types[0] == INT else 'fabs'}({terms[0][0]})", types[0]
        if name in ("int", "float"):
            kind = INT if name == "int" else DOUBLE
            return f"(({kind.name})({terms[0][0]}))", kind
        if name == "len":
            return f"{terms[0][0]}.n", INT
        if name == "wrap_angle":
            return f"wrap_angle({terms[0][0]})", DOUBLE
        if isinstance(target, type):
            made = self.library.make(target, types)
            return f"({made.name}){{{_joined(terms, value=True)}}}", made._replace(kind="made")
        if not hasattr(target, "py_func"):
            raise unsupported(node)
        called, kind = self.library.call(target, types)
        if kind.kind == "record":
            kind = kind._replace(kind="made")
        return f"{called}({_joined(terms)})", kind

    def _maths(self, node: ast.Call, name: str) -> Term:
        arguments = ", ".join(self.of(argument)[0] for argument in node.args)
        if name == "searchsorted":
            right = any(
                isinstance(k.value, ast.Constant) and k.value.value == "right"
                for k in node.keywords
            )
            return f"search({arguments}, {'true' if right else 'false'})", INT
        if name not in _MATHS and name not in _PLAIN:
            raise unsupported(node)
        return f"{_MATHS.get(name, name)}({arguments})", BOOL if name == "isfinite" else DOUBLE

    def _extreme(self, name: str, arguments: list[ast.expr]) -> Term:
        code, kind = self.of(arguments[0])
        for argument in arguments[1:]:
            other, other_kind = self.of(argument)
            kind = joined(kind, other_kind)
            code = f"{name}_{kind.name}({code}, {other})"
        return code, kind


def unsupported(node: ast.AST) -> InvalidInputError:
    """An error that names what cannot be translated."""
    return InvalidInputError(
        f"no C for {ast.unparse(node)!r}: kernels for C use numbers, arrays of one or two "
        "dimensions, named tuples, loops over ranges and functions of math"
    )


def value_of(code: str) -> str:
    """The record that a pointer points to."""
    return code[2:-1] if code[:2] == "(&" else f"*{code}"


def _joined(terms: list[Term], value: bool = False) -> str:
    return ", ".join(
        value_of(code) if value and kind.kind == "record" else code for code, kind in terms
    )


def literal(value: bool | int | float) -> Term:
    """A number in C."""
    if isinstance(value, bool):
        return ("true" if value else "false"), BOOL
    if isinstance(value, int):
        return str(value), INT
    if math.isnan(value):
        return "NAN", DOUBLE
    if math.isinf(value):
        return ("INFINITY" if value > 0.0 else "(-INFINITY)"), DOUBLE
    return (repr(float(value)) if value >= 0.0 else f"({float(value)!r})"), DOUBLE
