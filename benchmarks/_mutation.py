"""Small changes of the meaning of Python source: operators, their sites, the changed text.

A site is one expression or statement that one operator changes. Left out are docstrings, other
texts, annotations, raised errors, assertions, decorators and ``__repr__``. The changed expression
replaces the original in the text; all other lines stay.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

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
AXES = {0: 1, 1: 0, -1: 0}
ZEROED = ("Array", "FloatArray", "float", "int")
HIDDEN_FUNCTIONS = ("__repr__", "__str__")
HIDDEN = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """One change of a source text.

    Attributes
    ----------
    operator : key of `OPERATORS`
    function : qualified name of the function or class around it; '' at the top of a module
    line : number of the first changed line, from 1
    text : that line without the spaces around it
    start, end : bytes of the source that are replaced
    original, mutated : the expression or statement, before and after
    """

    operator: str
    function: str
    line: int
    text: str
    start: int
    end: int
    original: str
    mutated: str


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


def axis(node: ast.AST, _: ast.FunctionDef | None) -> Changed:
    """Another axis of an array."""
    if not isinstance(node, ast.Call):
        return
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


def arguments(node: ast.AST, around: ast.FunctionDef | None) -> Changed:
    """Two neighbouring arguments exchanged: parameters of one type of the function around."""
    if not isinstance(node, ast.Call) or around is None:
        return
    parameters = (*around.args.args, *around.args.kwonlyargs)
    types = {
        parameter.arg: ast.unparse(parameter.annotation)
        for parameter in parameters
        if parameter.annotation is not None
    }
    for index in range(len(node.args) - 1):
        first, second = node.args[index : index + 2]
        if not (isinstance(first, ast.Name) and isinstance(second, ast.Name)):
            continue
        type_of_first = types.get(first.id)
        if type_of_first is not None and type_of_first == types.get(second.id):
            swapped = [*node.args[:index], second, first, *node.args[index + 2 :]]
            yield ast.Call(node.func, swapped, node.keywords)


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


OPERATORS: dict[str, Callable[[ast.AST, ast.FunctionDef | None], Changed]] = {
    "comparison": comparison,
    "boundary": boundary,
    "arithmetic": arithmetic,
    "constant": constant,
    "negation": negation,
    "connective": connective,
    "sign": sign,
    "function": function,
    "axis": axis,
    "arguments": arguments,
    "result": result,
}


class _Sites:
    """Walk over a module that remembers the function around a node."""

    def __init__(self, source: str) -> None:
        self.lines = source.encode().splitlines(keepends=True)
        self.begins = [0]
        for line in self.lines:
            self.begins.append(self.begins[-1] + len(line))

    def of(
        self, node: ast.AST, names: tuple[str, ...], around: ast.FunctionDef | None
    ) -> Iterator[Site]:
        """Sites of a node and of all below it."""
        if isinstance(node, HIDDEN) or _is_text(node):
            return
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            return
        yield from self._changes(node, names, around)
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            if node.name in HIDDEN_FUNCTIONS:
                return
            names = (*names, node.name)
        if isinstance(node, ast.FunctionDef):
            around = node
        for child in _meaningful(node):
            yield from self.of(child, names, around)

    def _changes(
        self, node: ast.AST, names: tuple[str, ...], around: ast.FunctionDef | None
    ) -> Iterator[Site]:
        for operator, changes in OPERATORS.items():
            for changed in changes(node, around):
                assert isinstance(node, ast.expr | ast.stmt)
                yield self._site(operator, node, changed, ".".join(names))

    def _site(
        self, operator: str, node: ast.expr | ast.stmt, changed: ast.AST, function: str
    ) -> Site:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return Site(
            operator=operator,
            function=function,
            line=node.lineno,
            text=self.lines[node.lineno - 1].decode().strip(),
            start=self.begins[node.lineno - 1] + node.col_offset,
            end=self.begins[node.end_lineno - 1] + node.end_col_offset,
            original=ast.unparse(node),
            mutated=ast.unparse(ast.fix_missing_locations(changed)),
        )


def _is_text(node: ast.AST) -> bool:
    """True for a docstring or another statement that is only a constant."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _meaningful(node: ast.AST) -> Iterator[ast.AST]:
    """Children of a node but annotations, decorators and base classes."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases"):
            continue
        children = value if isinstance(value, list) else [value]
        yield from (child for child in children if isinstance(child, ast.AST))


def sites(source: str) -> list[Site]:
    """Sites of a source text, in its order; of equal changes on one line the first only."""
    walk = _Sites(source)
    unique: dict[tuple[str, str, str, str], Site] = {}
    for site in walk.of(ast.parse(source), (), None):
        key = site.function, site.text, site.original, site.mutated
        if site.original != site.mutated:
            unique.setdefault(key, site)
    return list(unique.values())


def mutated_source(source: str, site: Site) -> str:
    """The source text with the change of a site."""
    content = source.encode()
    change = site.mutated
    if site.operator != "result" and not _is_statement(change):
        change = f"({change})"
    changed = content[: site.start] + change.encode() + content[site.end :]
    text = changed.decode()
    if ast.dump(ast.parse(text)) == ast.dump(ast.parse(source)):
        raise ValueError(f"line {site.line}: the change changes nothing: {change}")
    return text


def _is_statement(text: str) -> bool:
    """True for an assignment in place, which takes no parentheses."""
    return isinstance(ast.parse(text).body[0], ast.AugAssign)
