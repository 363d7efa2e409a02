"""A kernel as a function in C."""

from __future__ import annotations

import ast
import inspect
import textwrap
from typing import Any, get_type_hints

from pushplan.codegen.c_types import (
    BOOL,
    DOUBLE,
    INT,
    VOID,
    CType,
    joined,
    record_type,
    values_type,
)
from pushplan.codegen.expressions import Expressions, Library, Term, unsupported

_SCALARS: dict[Any, CType] = {float: DOUBLE, int: INT, bool: BOOL}
_ROUNDS = 2  # passes over a function until the types of its variables are known


class Function:
    """Translates one kernel for arguments of given types.

    Args:
        library: the program that it becomes part of.
        kernel: a compiled kernel.
        name: of the function in C.
        types: of its arguments.
    """

    def __init__(self, library: Library, kernel: Any, name: str, types: list[CType]) -> None:
        source = textwrap.dedent(inspect.getsource(kernel.py_func))
        tree = ast.parse(source).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self._tree, self._library = tree, library
        self._names = kernel.py_func.__globals__
        self._parameters = [argument.arg for argument in tree.args.args]
        hints = get_type_hints(kernel.py_func)
        self.returns = _returned(hints.get("return"))
        self._types: dict[str, CType] = {}
        for parameter, kind in zip(self._parameters, types, strict=True):
            hint: Any = hints.get(parameter)
            self._types[parameter] = _SCALARS.get(hint, kind)
        self._all = dict(self._types)
        for _ in range(_ROUNDS):
            self._lines: list[str] = []
            self._temporaries: list[str] = []
            self._expressions = Expressions(library, self._names, self._all)
            for statement in tree.body:
                self._statement(statement, 1)
        self.code = self._text(name)

    def _text(self, name: str) -> str:
        parameters = ", ".join(self._types[p].declared(p) for p in self._parameters)
        returned = self.returns.name
        self.head = f"static {returned} {name}({parameters})"
        document = (ast.get_docstring(self._tree) or "").split("\n\n")[0].replace("\n", " ")
        lines = [f"/* {document} */"] if document else []
        lines.append(self.head + " {")
        for variable, kind in self._all.items():
            if variable in self._types:
                continue
            start = "NULL" if kind.kind == "record" else "0" if kind.kind == "scalar" else "{0}"
            start = "false" if kind == BOOL else start
            lines.append(f"    {kind.declared(variable)} = {start};")
        lines += [f"    {line}" for line in self._temporaries]
        lines += self._lines
        for variable in self._all:
            if variable not in self._expressions.used:
                place = len(lines) - 1 if lines[-1].startswith("    return") else len(lines)
                lines.insert(place, f"    (void){variable};")
        return "\n".join([*lines, "}"])

    def _put(self, text: str, depth: int) -> None:
        self._lines.append("    " * depth + text)

    def _temporary(self, kind: CType) -> str:
        name = f"t{len(self._temporaries)}_"
        zero = "0" if kind.kind == "scalar" else "{0}"
        self._temporaries.append(f"{kind.name} {name} = {zero};")
        return name

    def _statement(self, node: ast.stmt, depth: int) -> None:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return  # a docstring
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise unsupported(node)
        method(node, depth)

    def _block(self, statements: list[ast.stmt], depth: int) -> None:
        for statement in statements:
            self._statement(statement, depth)

    def _expr(self, node: ast.Expr, depth: int) -> None:
        call = node.value
        if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "copy_into":
            (a, kind), (b, _) = self._of(call.args[0]), self._of(call.args[1])
            size = f"{a}.n * {a}.m" if kind.rank == 2 else f"{a}.n"
            self._put(f"copy({a}.at, {b}.at, {size});", depth)
        else:
            self._put(f"{self._of(call)[0]};", depth)

    def _of(self, node: ast.expr) -> Term:
        return self._expressions.of(node)

    def _return(self, node: ast.Return, depth: int) -> None:
        if node.value is None:
            self._put("return;", depth)
        elif isinstance(node.value, ast.Tuple):
            items = ", ".join(self._of(item)[0] for item in node.value.elts)
            self._put(f"return ({self.returns.name}){{{items}}};", depth)
        else:
            self._put(f"return {self._of(node.value)[0]};", depth)

    def _if(self, node: ast.If, depth: int) -> None:
        self._put(f"if ({self._of(node.test)[0]}) {{", depth)
        self._block(node.body, depth + 1)
        if node.orelse:
            self._put("} else {", depth)
            self._block(node.orelse, depth + 1)
        self._put("}", depth)

    def _while(self, node: ast.While, depth: int) -> None:
        self._put(f"while ({self._of(node.test)[0]}) {{", depth)
        self._block(node.body, depth + 1)
        self._put("}", depth)

    def _for(self, node: ast.For, depth: int) -> None:
        assert isinstance(node.target, ast.Name)
        name, items = node.target.id, node.iter
        if isinstance(items, ast.Tuple):
            terms, count = [self._of(item)[0] for item in items.elts], len(items.elts)
            self._set(name, DOUBLE)
            i = self._temporary(INT)
            self._put(f"for ({i} = 0; {i} < {count}; {i}++) {{", depth)
            self._put(f"{name} = ((const double[]){{{', '.join(terms)}}})[{i}];", depth + 1)
        elif isinstance(items, ast.Call) and getattr(items.func, "id", "") == "range":
            bounds = [self._of(bound)[0] for bound in items.args]
            if len(bounds) > 2:
                raise unsupported(node.iter)
            self._set(name, INT)
            end = self._temporary(INT)
            self._put(f"{end} = {bounds[-1]};", depth)
            low = bounds[0] if len(bounds) == 2 else "0"
            name = self._temporary(INT) if name == "_" else name
            self._put(f"for ({name} = {low}; {name} < {end}; {name}++) {{", depth)
            self._expressions.used.add(name)
        else:
            raise unsupported(node.iter)
        self._block(node.body, depth + 1)
        self._put("}", depth)

    def _break(self, node: ast.Break, depth: int) -> None:
        self._put("break;", depth)

    def _continue(self, node: ast.Continue, depth: int) -> None:
        self._put("continue;", depth)

    def _assert(self, node: ast.Assert, depth: int) -> None:
        """Leave it out."""

    def _augassign(self, node: ast.AugAssign, depth: int) -> None:
        value = ast.BinOp(_read(node.target), node.op, node.value)
        self._assign_to(node.target, self._of(value), depth)

    def _annassign(self, node: ast.AnnAssign, depth: int) -> None:
        if node.value is not None:
            self._assign_to(node.target, self._of(node.value), depth)

    def _assign(self, node: ast.Assign, depth: int) -> None:
        target = node.targets[0]
        if isinstance(target, ast.Tuple):
            self._unpack(target, node.value, depth)
            return
        term = self._of(node.value)
        for one in reversed(node.targets):
            self._assign_to(one, term, depth)

    def _unpack(self, target: ast.Tuple, value: ast.expr, depth: int) -> None:
        if isinstance(value, ast.Tuple):
            terms = [self._of(item) for item in value.elts]
            if any(kind.kind == "scalar" for _, kind in terms):
                terms = [self._kept(term, depth) for term in terms]  # all before any is set
        else:
            code, kind = self._of(value)
            if kind.kind == "record":
                terms = [
                    self._of(ast.Attribute(value, name, ast.Load()))
                    for name in self._library.fields(kind)
                ]
            else:
                kept, _ = self._kept((code, kind), depth)
                terms = [(f"{kept}.f{i}", part) for i, part in enumerate(kind.parts)]
        for one, term in zip(target.elts, terms, strict=True):
            self._assign_to(one, term, depth)

    def _kept(self, term: Term, depth: int) -> Term:
        code, kind = term
        if kind.kind in ("record", "array") or (code.replace("_", "").isalnum() and code[0] == "t"):
            return term
        name = self._temporary(kind)
        self._put(f"{name} = {code};", depth)
        return name, kind

    def _assign_to(self, target: ast.expr, term: Term, depth: int) -> None:
        code, kind = term
        if isinstance(target, ast.Name):
            if target.id == "_":
                return
            if kind.kind == "made":
                kept = self._temporary(kind)
                self._put(f"{kept} = {code};", depth)
                code, kind = f"&{kept}", kind._replace(kind="record")
            self._set(target.id, kind)
            if code != target.id:
                self._put(f"{target.id} = {code};", depth)
        elif isinstance(target, ast.Subscript):
            if isinstance(target.slice, ast.Slice):
                base, array = self._of(target.value)
                size = f"{base}.n * {base}.m" if array.rank == 2 else f"{base}.n"
                self._put(f"fill({base}.at, {size}, {code});", depth)
            else:
                self._put(f"{self._of(target)[0]} = {code};", depth)
        else:
            raise unsupported(target)

    def _set(self, name: str, kind: CType) -> None:
        if name != "_" and name not in self._types:
            self._all[name] = joined(self._all.get(name), kind)


def _read(node: ast.expr) -> ast.expr:
    """A target as an expression."""
    read = ast.parse(ast.unparse(node), mode="eval").body
    return read


def _returned(hint: Any) -> CType:
    if hint is None or hint is type(None):
        return VOID
    if hint in _SCALARS:
        return _SCALARS[hint]
    if isinstance(hint, type) and hasattr(hint, "_fields"):
        return record_type(hint)
    return values_type(tuple(_returned(part) for part in hint.__args__))
