"""Operators of mutants that change a call or an index: arguments, keywords, axes, slices, units.

An operator is a function of a node and of the function around it. It yields nodes in its place.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

COLUMN_OR_ROW = ("(:, None)", "(None, :)")  # as `ast.unparse` writes them
AXES = {0: 1, 1: 0, -1: 0}
# functions whose arguments may change places
SYMMETRIC = frozenset(
    (
        *("add", "allclose", "array_equal", "gcd", "hypot", "isclose", "lcm"),
        *("logical_and", "logical_or", "multiply", "print"),
        *("max", "maximum", "min", "minimum"),
    )
)
# Keywords that check or show something, and change no value.
OF_NO_VALUE = frozenset(
    (
        *("encoding", "errors", "strict", "description", "help", "metavar"),
        *("alpha", "color", "fontsize", "label", "linewidth", "loc", "style"),
        *("title", "xlabel", "ylabel"),
    )
)
UNIT_FACTORS = (1e-6, 1e-3, 24.0, 60.0, 100.0, 180.0, 360.0, 1e3, 3600.0, 1e6, 1e9)
TURNS = ("2.0 * math.pi", "2 * math.pi", "2.0 * np.pi", "2 * np.pi", "math.tau")
CONVERSIONS = ("to_si", "from_si", "radians", "degrees", "deg2rad", "rad2deg")
FIELDS = ("field", "unit")  # of dataclasses, where a default decides the order only

Changed = Iterator[ast.AST]


def called_name(node: ast.Call) -> str:
    """Last part of the name of what is called; '' for a call of another expression."""
    if isinstance(node.func, ast.Name):
        return node.func.id
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return ""


def axis(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """Another axis of an array: as a keyword, of its shape, of a new axis, or not transposed."""
    if isinstance(node, ast.Call):
        yield from _other_axis_keyword(node)
    if isinstance(node, ast.Attribute) and node.attr == "T":
        yield node.value
    if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
        yield from _other_axis_index(node)


def _other_axis_keyword(node: ast.Call) -> Changed:
    for index, keyword in enumerate(node.keywords):
        if keyword.arg != "axis":
            continue
        try:
            given = ast.literal_eval(keyword.value)
        except ValueError:
            continue
        if given in AXES:
            keywords = list(node.keywords)
            keywords[index] = ast.keyword("axis", ast.Constant(AXES[given]))
            yield ast.Call(node.func, node.args, keywords)


def _other_axis_index(node: ast.Subscript) -> Changed:
    """``shape[1]`` for ``shape[0]``, and ``a[None, :]`` for ``a[:, None]``."""
    of_shape = isinstance(node.value, ast.Attribute) and node.value.attr == "shape"
    index = node.slice
    if of_shape and not isinstance(index, ast.Slice | ast.Tuple):
        text = ast.unparse(index)
        for given, other in AXES.items():
            if text == str(given):
                yield ast.Subscript(node.value, ast.Constant(other), ast.Load())
    if isinstance(index, ast.Tuple) and ast.unparse(index) in COLUMN_OR_ROW:
        turned = ast.Tuple(index.elts[::-1], ast.Load())
        yield ast.Subscript(node.value, turned, ast.Load())


def arguments(node: ast.AST, around: ast.FunctionDef | None) -> Changed:
    """Two neighbouring arguments exchanged, by place or by keyword, that are of one type."""
    if not isinstance(node, ast.Call) or called_name(node) in SYMMETRIC:
        return
    types = {} if around is None else _types(around)
    for index in range(len(node.args) - 1):
        first, second = node.args[index : index + 2]
        if _are_alike(first, second, types):
            swapped = [*node.args[:index], second, first, *node.args[index + 2 :]]
            yield ast.Call(node.func, swapped, node.keywords)
    for index in range(len(node.keywords) - 1):
        one, other = node.keywords[index : index + 2]
        named = one.arg is not None and other.arg is not None
        if named and _are_alike(one.value, other.value, types):
            keywords = list(node.keywords)
            keywords[index] = ast.keyword(one.arg, other.value)
            keywords[index + 1] = ast.keyword(other.arg, one.value)
            yield ast.Call(node.func, node.args, keywords)


def _types(around: ast.FunctionDef) -> dict[str, str]:
    """Name -> its type: annotations of parameters, and names that one value is unpacked to."""
    parameters = (*around.args.args, *around.args.kwonlyargs)
    types = {
        parameter.arg: ast.unparse(parameter.annotation)
        for parameter in parameters
        if parameter.annotation is not None
    }
    for node in ast.walk(around):
        if not isinstance(node, ast.Assign) or isinstance(node.value, ast.Tuple):
            continue
        for target in node.targets:
            if isinstance(target, ast.Tuple):
                names = [part.id for part in target.elts if isinstance(part, ast.Name)]
                types |= {name: f"part of line {node.lineno}" for name in names}
    return types


def _are_alike(first: ast.expr, second: ast.expr, types: dict[str, str]) -> bool:
    """True for names of one type, numbers of one type, and attributes of one object."""
    if ast.dump(first) == ast.dump(second):
        return False
    if isinstance(first, ast.Name) and isinstance(second, ast.Name):
        return first.id in types and types[first.id] == types.get(second.id)
    if isinstance(first, ast.Constant) and isinstance(second, ast.Constant):
        is_text = isinstance(first.value, str)
        return type(first.value) is type(second.value) and not is_text
    if isinstance(first, ast.Attribute) and isinstance(second, ast.Attribute):
        return ast.dump(first.value) == ast.dump(second.value)
    return False


def keyword(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """A keyword argument dropped, so that a default takes its place.

    Left out are constructors, as most of their keywords have no default.
    """
    if not isinstance(node, ast.Call) or called_name(node) in FIELDS:
        return
    if called_name(node)[:1].isupper():
        return
    for index, given in enumerate(node.keywords):
        if given.arg is not None and given.arg not in OF_NO_VALUE:
            others = [*node.keywords[:index], *node.keywords[index + 1 :]]
            yield ast.Call(node.func, node.args, others)


def slice_bound(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """One element less at an end of a slice or of a range, or one that was left out."""
    if isinstance(node, ast.Subscript):
        yield from _other_slices(node)
    if isinstance(node, ast.Call) and called_name(node) == "range":
        if len(node.args) == 1:
            yield ast.Call(node.func, [_moved(node.args[0], ast.Sub())], [])
        if len(node.args) >= 2:
            first, last, *step = node.args
            yield ast.Call(node.func, [_moved(first, ast.Add()), last, *step], [])
            yield ast.Call(node.func, [first, _moved(last, ast.Sub()), *step], [])


def _other_slices(node: ast.Subscript) -> Changed:
    parts = [node.slice]
    if isinstance(node.slice, ast.Tuple):
        parts = node.slice.elts
    for index, part in enumerate(parts):
        if not isinstance(part, ast.Slice):
            continue
        for other in _other_bounds(part):
            changed: ast.expr = other
            if isinstance(node.slice, ast.Tuple):
                changed = ast.Tuple(
                    [*parts[:index], other, *parts[index + 1 :]], ast.Load()
                )
            yield ast.Subscript(node.value, changed, node.ctx)


def _other_bounds(part: ast.Slice) -> Iterator[ast.Slice]:
    """Slices without ``1:`` and ``:-1``, or with another bound moved inwards by one."""
    lower, upper = part.lower, part.upper
    if lower is not None and ast.unparse(lower) == "1":
        yield ast.Slice(None, upper, part.step)
    elif lower is not None:
        yield ast.Slice(_moved(lower, ast.Add()), upper, part.step)
    if upper is not None and ast.unparse(upper) == "-1":
        yield ast.Slice(lower, None, part.step)
    elif upper is not None:
        yield ast.Slice(lower, _moved(upper, ast.Sub()), part.step)


def _moved(bound: ast.expr, by: ast.operator) -> ast.expr:
    return ast.BinOp(bound, by, ast.Constant(1))


def unit(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """A number in another unit: its factor, or its conversion to or from SI, is left out."""
    if isinstance(node, ast.Call) and called_name(node) in CONVERSIONS and node.args:
        yield node.args[-1]
    if not isinstance(node, ast.BinOp):
        return
    if isinstance(node.op, ast.Mult | ast.Div) and _is_factor(node.right):
        yield node.left
    elif isinstance(node.op, ast.Mult) and _is_factor(node.left):
        yield node.right
    elif isinstance(node.op, ast.Div) and _is_factor(node.left):
        yield ast.BinOp(ast.Constant(1.0), ast.Div(), node.right)


def _is_factor(node: ast.expr) -> bool:
    """True for a factor between units, such as 60 or a turn in radians."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, float) and node.value in UNIT_FACTORS
    return ast.unparse(node) in TURNS
