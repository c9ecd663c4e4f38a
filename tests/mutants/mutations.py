"""Small changes of a module's syntax tree, one at a time: what `make mutation` tries the tests on.

Comparisons and their bounds, arithmetic, boolean clauses, bits, constants, minima, returned values, deleted
statements. Docstrings, annotations, imports and functions that only write documents are left alone.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import CodeType
from typing import Any

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,),
}  # fmt: skip
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult, ast.Pow: ast.Mult, ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr,
    ast.BitXor: ast.BitAnd,
    ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}  # fmt: skip
EXTREMES = {"min": "max", "max": "min"}
TESTED = (ast.If, ast.IfExp, ast.While)
At = tuple[str, int]
"""Top-level function ("" outside of any) and first line of the statement."""

DELETED = (ast.Assign, ast.AugAssign, ast.Expr, ast.If, ast.Break, ast.Continue, ast.Raise)


@dataclass(frozen=True)
class Mutation:
    """One change: `replacement` in the place `(parent, field, index)` of `tree`."""

    module: str
    function: str
    first_line: int
    line: int
    text: str
    tree: ast.Module
    parent: ast.AST
    field: str
    index: int | None
    replacement: ast.AST
    number: int = 1

    @property
    def key(self) -> str:
        """Name that stays when lines move; equal ones of a function are numbered."""
        where = f"{self.module}.{self.function}" if self.function else self.module
        return f"{where}: {self.text}" + (f" #{self.number}" if self.number > 1 else "")

    def _swap(self, new: ast.AST) -> ast.AST:
        holder: Any = getattr(self.parent, self.field)
        if self.index is None:
            setattr(self.parent, self.field, new)
            old: ast.AST = holder
        else:
            old, holder[self.index] = holder[self.index], new
        return old

    def source(self) -> str:
        """The whole changed module (comments lost)."""
        old = self._swap(self.replacement)
        text = ast.unparse(self.tree)
        self._swap(old)
        return text

    def code(self) -> CodeType:
        """The changed function, compiled as the original file's."""
        old = self._swap(self.replacement)
        whole = compile(ast.fix_missing_locations(self.tree), f"<{self.key}>", "exec")
        self._swap(old)
        return next(c for c in whole.co_consts if isinstance(c, CodeType) and c.co_name == self.function)


def mutations(path: Path) -> list[Mutation]:
    """All changes of the module at `path`, in order of lines."""
    tree = ast.parse(path.read_text())
    seen: Counter[tuple[str, str]] = Counter()
    made = []
    for (function, first), parent, field, index, node in _places(tree, ("", 1)):
        if not function and isinstance(parent, ast.BinOp) and isinstance(parent.op, ast.LShift):
            continue  # which bit an event has is of no meaning
        for text, replacement in _changes(node, parent, field):
            if not function and isinstance(replacement, ast.Pass):
                continue  # a name that is missing is noticed by the import
            ast.copy_location(replacement, node)
            seen[function, text] += 1
            line, number = getattr(node, "lineno", first), seen[function, text]
            place = (tree, parent, field, index, replacement)
            made.append(Mutation(path.stem, function, first, line, text, *place, number))
    return sorted(made, key=lambda m: m.line)


def _places(node: ast.AST, at: At) -> Iterator[tuple[At, ast.AST, str, int | None, ast.AST]]:
    """Every node that may change: function and statement it is in, and where it hangs."""
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list", "ctx", "ops", "op"):
            continue
        children = list(enumerate(value)) if isinstance(value, list) else [(None, value)]
        for index, child in children:
            if not isinstance(child, ast.AST) or isinstance(child, ast.Import | ast.ImportFrom):
                continue
            inner = (at[0], child.lineno) if isinstance(child, ast.stmt) else at
            if isinstance(node, ast.Module) and isinstance(child, ast.FunctionDef):
                inner = (child.name, child.lineno)
            yield inner, node, field, index, child
            yield from _places(child, inner)


def _changes(node: ast.AST, parent: ast.AST, field: str) -> Iterator[tuple[str, ast.AST]]:
    """Replacements of one node, each with its words."""
    if isinstance(node, ast.expr):
        for replacement in _expressions(node, field):
            yield f"{ast.unparse(node)} => {ast.unparse(replacement)}", replacement
    if isinstance(parent, TESTED) and field == "test":
        turned = ast.UnaryOp(ast.Not(), node)  # type: ignore[arg-type] # tests are expressions
        if not isinstance(node, ast.Compare | ast.UnaryOp):
            yield f"if {ast.unparse(node)} => if {ast.unparse(turned)}", turned
    if isinstance(node, DELETED) and field in ("body", "orelse"):
        documented = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if not documented and not (isinstance(node, ast.If) and node.orelse):
            yield f"deleted: {ast.unparse(node).splitlines()[0]}", ast.Pass()
    if isinstance(node, ast.AugAssign) and type(node.op) in OPERATORS:
        other = ast.AugAssign(node.target, OPERATORS[type(node.op)](), node.value)
        yield f"{ast.unparse(node)} => {ast.unparse(other)}", other
    if isinstance(node, ast.Return) and isinstance(node.value, ast.Name | ast.Call | ast.Attribute):
        yield f"{ast.unparse(node)} => return 0", ast.Return(ast.Constant(0))


def _expressions(node: ast.expr, field: str) -> Iterator[ast.expr]:
    if isinstance(node, ast.Compare):
        for i, op in enumerate(node.ops):
            for other in COMPARISONS[type(op)]:
                yield ast.Compare(node.left, [*node.ops[:i], other(), *node.ops[i + 1 :]], node.comparators)
    elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS and not _is_bit(node):
        yield ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
        for i in range(len(node.values)):
            left = node.values[:i] + node.values[i + 1 :]
            yield left[0] if len(left) == 1 else ast.BoolOp(node.op, left)
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.Constant):
        yield from _constants(node.value, field)
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        if node.func.id in EXTREMES:
            yield ast.Call(ast.Name(EXTREMES[node.func.id], ast.Load()), node.args, node.keywords)
        elif node.func.id == "abs":
            yield node.args[0]


def _is_bit(node: ast.BinOp) -> bool:
    """A constant like `1 << 3`."""
    parts = (node.left, node.right)
    return isinstance(node.op, ast.LShift) and all(isinstance(part, ast.Constant) for part in parts)


def _constants(value: object, field: str) -> Iterator[ast.expr]:
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int | float):
        yield ast.Constant(value + 1)
        yield ast.UnaryOp(ast.USub(), ast.Constant(1 - value)) if value < 1 else ast.Constant(value - 1)
