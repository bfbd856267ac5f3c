"""Small changes of the meaning of Python source: operators, their sites, the changed text.

A site is one expression or statement that one operator changes. Left out are docstrings, other
texts, annotations, raised errors, assertions, decorators (but those of caches) and ``__repr__``.
The changed expression replaces the original in the text; all other lines stay.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from benchmarks import _call_changes as calls
from benchmarks import _expression_changes as expressions
from benchmarks import _place_changes as places
from benchmarks._place_changes import Edit, Edits

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


NODES: dict[str, Callable[[ast.AST, ast.FunctionDef | None], Iterator[ast.AST]]] = {
    "comparison": expressions.comparison,
    "boundary": expressions.boundary,
    "arithmetic": expressions.arithmetic,
    "constant": expressions.constant,
    "negation": expressions.negation,
    "connective": expressions.connective,
    "sign": expressions.sign,
    "function": expressions.function,
    "result": expressions.result,
    "axis": calls.axis,
    "arguments": calls.arguments,
    "keyword": calls.keyword,
    "slice": calls.slice_bound,
    "unit": calls.unit,
}
PLACES: dict[str, Callable[[ast.AST, ast.FunctionDef | None], Edits]] = {
    "order": places.order,
    "cache key": places.cache_key,
}
OPERATORS = (*NODES, *PLACES)
# the kinds of bugs that others found in the tests of 0.16.0
OF_OTHERS = ("arguments", "keyword", "slice", "order", "unit", "axis", "cache key")


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
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            if node.name in HIDDEN_FUNCTIONS:
                return
            names = (*names, node.name)
        yield from self._changes(node, names, around)
        if isinstance(node, ast.FunctionDef):
            around = node
        for child in _meaningful(node):
            yield from self.of(child, names, around)

    def _changes(
        self, node: ast.AST, names: tuple[str, ...], around: ast.FunctionDef | None
    ) -> Iterator[Site]:
        function = ".".join(names)
        for operator, changes in NODES.items():
            for changed in changes(node, around):
                assert isinstance(node, ast.expr | ast.stmt)
                text = ast.unparse(ast.fix_missing_locations(changed))
                edit = Edit(first=node, last=node, text=text)
                yield self._site(operator, edit, function)
        for operator, edits in PLACES.items():
            for edit in edits(node, around):
                yield self._site(operator, edit, function)

    def _site(self, operator: str, edit: Edit, function: str) -> Site:
        first, last = edit.first, edit.last
        assert last.end_lineno is not None
        assert last.end_col_offset is not None
        original = ast.unparse(first)
        if last is not first:
            original += f"; {ast.unparse(last)}"
        return Site(
            operator=operator,
            function=function,
            line=first.lineno,
            text=self.lines[first.lineno - 1].decode().strip(),
            start=self.begins[first.lineno - 1] + first.col_offset,
            end=self.begins[last.end_lineno - 1] + last.end_col_offset,
            original=original,
            mutated=edit.text,
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
    if _is_expression(change):
        change = f"({change})"
    changed = content[: site.start] + change.encode() + content[site.end :]
    text = changed.decode()
    if ast.dump(ast.parse(text)) == ast.dump(ast.parse(source)):
        raise ValueError(f"line {site.line}: the change changes nothing: {change}")
    return text


def _is_expression(text: str) -> bool:
    """True for one expression, which parentheses leave as it is."""
    statements = ast.parse(text).body
    return len(statements) == 1 and isinstance(statements[0], ast.Expr)
