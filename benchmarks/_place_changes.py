"""Operators of mutants that change other places than one expression: order of calls, cache keys.

An operator is a function of a node and of the function around it. It yields edits: the first and
the last node of what is replaced, and the text in its place.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from benchmarks._call_changes import called_name

BLOCKS = ("body", "orelse", "finalbody")
# Conversions, which may come before or after another function, and what takes other types.
CONVERSIONS = frozenset(
    (
        *("array", "asarray", "ascontiguousarray", "from_iterable", "from_numpy"),
        *("bool", "dict", "float", "list", "repr", "set", "str", "tuple"),
        *("dumps", "enumerate", "len", "loads", "range"),
    )
)
# Calls whose order decides nothing but which mistake is told first, or how a picture is drawn.
OF_NO_ORDER = re.compile(r"^_?(add_|check_|require_|set_|plot|axhline|axvline|legend)")
CACHES = ("cache", "lru_cache")
HELPER = "_stale_cache"  # the module beside this one that a copy of the tree can import
KEY = re.compile(r"(^|_)keys?$")
DIGESTS = ("_digest", "identity_hash")


@dataclass(frozen=True, slots=True, kw_only=True)
class Edit:
    """One change: ``text`` in the place of all from the node ``first`` to the node ``last``."""

    first: ast.expr | ast.stmt
    last: ast.expr | ast.stmt
    text: str


Edits = Iterator[Edit]


def order(node: ast.AST, _: ast.FunctionDef | None) -> Edits:
    """Two calls in the other order: neighbouring statements, or one inside the other."""
    for block in BLOCKS:
        statements = getattr(node, block, None)
        if not isinstance(statements, list):
            continue
        for first, second in pairwise(statements):
            if _is_ordered_call(first) and _is_ordered_call(second):
                text = f"{ast.unparse(second)}; {ast.unparse(first)}"
                yield Edit(first=first, last=second, text=text)
    inner = _only_argument(node)
    innermost = _only_argument(inner)
    if isinstance(node, ast.Call) and isinstance(inner, ast.Call) and innermost:
        changed = ast.Call(inner.func, [ast.Call(node.func, [innermost], [])], [])
        yield Edit(first=node, last=node, text=ast.unparse(changed))


def _is_ordered_call(node: ast.stmt) -> bool:
    """True for a statement that is a call with an effect."""
    if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Call):
        return False
    return not OF_NO_ORDER.match(called_name(node.value))


def _only_argument(node: ast.AST | None) -> ast.expr | None:
    """The argument of a call that has one, given by place, and is no mere conversion."""
    if not isinstance(node, ast.Call) or node.keywords or len(node.args) != 1:
        return None
    if isinstance(node.args[0], ast.Starred | ast.GeneratorExp):
        return None
    return None if called_name(node) in CONVERSIONS else node.args[0]


def cache_key(node: ast.AST, around: ast.FunctionDef | None) -> Edits:
    """A key that forgets a part: a parameter of a cached function, of a tuple, of a digest."""
    if isinstance(node, ast.FunctionDef):
        yield from _blind_caches(node)
    if isinstance(node, ast.Assign) and KEY.search(ast.unparse(node.targets[0])):
        yield from _shorter_keys(node.value)
    if isinstance(node, ast.Return) and around is not None and KEY.search(around.name):
        yield from _shorter_keys(node.value)
    if isinstance(node, ast.Call) and called_name(node) in DIGESTS:
        for index in range(len(node.args) * (len(node.args) > 1)):
            others = [*node.args[:index], *node.args[index + 1 :]]
            changed = ast.Call(node.func, others, node.keywords)
            yield Edit(first=node, last=node, text=ast.unparse(changed))
    if isinstance(node, ast.keyword) and node.arg == "key":
        yield from _shorter_keys(node.value)
    if isinstance(node, ast.Expr) and ast.unparse(node).startswith("digest.update("):
        yield Edit(first=node, last=node, text="pass")


def _blind_caches(node: ast.FunctionDef) -> Edits:
    """A cached function of several parameters whose cache does not see one of them."""
    names = [parameter.arg for parameter in (*node.args.args, *node.args.kwonlyargs)]
    for decorator in node.decorator_list:
        called = decorator.func if isinstance(decorator, ast.Call) else decorator
        if ast.unparse(called).rpartition(".")[2] not in CACHES or len(names) < 2:
            continue
        for name in names:
            text = f"__import__('{HELPER}').blind('{name}', {ast.unparse(decorator)})"
            yield Edit(first=decorator, last=decorator, text=text)


def _shorter_keys(value: ast.expr | None) -> Edits:
    if isinstance(value, ast.Tuple) and len(value.elts) > 1:
        for index in range(len(value.elts)):
            others = [*value.elts[:index], *value.elts[index + 1 :]]
            text = ast.unparse(ast.Tuple(others, ast.Load()))
            yield Edit(first=value, last=value, text=text)
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Add):
        yield Edit(first=value, last=value, text=ast.unparse(value.left))
