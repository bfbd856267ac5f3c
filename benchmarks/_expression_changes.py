"""Operators of mutants that change one expression: signs, limits, constants, functions.

An operator is a function of a node and of the function around it. It yields nodes in its place.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
BOUNDARIES: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
}
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Add,
    ast.Pow: ast.Mult,
}
CONNECTIVES: dict[type[ast.boolop], type[ast.boolop]] = {
    ast.And: ast.Or,
    ast.Or: ast.And,
}
FUNCTIONS = {
    "sin": "cos",
    "cos": "sin",
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "argmin": "argmax",
    "argmax": "argmin",
    "floor": "ceil",
    "ceil": "floor",
    "any": "all",
    "all": "any",
    "mean": "sum",
    "sum": "mean",
    "zeros": "ones",
    "ones": "zeros",
    "zeros_like": "ones_like",
    "ones_like": "zeros_like",
}
BUILT_IN = ("min", "max", "any", "all")
ZEROED = ("Array", "FloatArray", "float", "int")
Changed = Iterator[ast.AST]


def _operands_hold_text(node: ast.BinOp) -> bool:
    """True for the joining of texts and lists, which is no arithmetic."""
    literal = (ast.JoinedStr, ast.List, ast.Tuple, ast.ListComp)
    for part in (node.left, node.right):
        is_text = isinstance(part, ast.Constant) and isinstance(part.value, str)
        if is_text or isinstance(part, literal):
            return True
    return False


def _with_comparison(
    node: ast.AST, table: dict[type[ast.cmpop], type[ast.cmpop]]
) -> Changed:
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        other = table.get(type(node.ops[0]))
        if other is not None:
            yield ast.Compare(node.left, [other()], node.comparators)


def comparison(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """The opposite comparison."""
    return _with_comparison(node, COMPARISONS)


def boundary(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """The same order, with the limit on the other side."""
    return _with_comparison(node, BOUNDARIES)


def _other_operation(node: ast.BinOp) -> Changed:
    other = ARITHMETIC.get(type(node.op))
    if other is not None and not _operands_hold_text(node):
        yield ast.BinOp(node.left, other(), node.right)


def arithmetic(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """Another operation on two numbers, in an expression or an assignment."""
    if isinstance(node, ast.BinOp):
        yield from _other_operation(node)
    if isinstance(node, ast.AugAssign) and type(node.op) in ARITHMETIC:
        yield ast.AugAssign(node.target, ARITHMETIC[type(node.op)](), node.value)


def constant(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """Another truth value, the next integer, or a number of twice the size."""
    if not isinstance(node, ast.Constant):
        return
    if isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node.value, int):
        yield ast.Constant(node.value + 1)
    elif isinstance(node.value, float):
        yield ast.Constant(2.0 * node.value or 1.0)


def negation(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """The opposite condition: ``not`` dropped."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield node.operand


def connective(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """``or`` for ``and``, and the other way round."""
    if isinstance(node, ast.BoolOp):
        yield ast.BoolOp(CONNECTIVES[type(node.op)](), node.values)


def sign(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """A number without its minus."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield node.operand


def function(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """Another function of the same arguments, such as the cosine for the sine."""
    if not isinstance(node, ast.Call):
        return
    called = node.func
    if isinstance(called, ast.Name) and called.id in BUILT_IN:
        name = ast.Name(FUNCTIONS[called.id])
        yield ast.Call(name, node.args, node.keywords)
    if isinstance(called, ast.Attribute) and called.attr in FUNCTIONS:
        attribute = ast.Attribute(called.value, FUNCTIONS[called.attr])
        yield ast.Call(attribute, node.args, node.keywords)


def result(node: ast.AST, around: ast.FunctionDef | None) -> Changed:
    """A neutral result, zero or false, by the annotation of the function."""
    if not isinstance(node, ast.Return) or node.value is None or around is None:
        return
    if around.returns is None or isinstance(node.value, ast.Constant):
        return
    annotation = ast.unparse(around.returns)
    if annotation == "bool":
        yield ast.Return(ast.Constant(False))
    if annotation in ZEROED:
        yield ast.Return(ast.BinOp(ast.Constant(0), ast.Mult(), node.value))
