"""Functions whose code is written out where they are called, without Numba's compiler.

Numba's compiler takes milliseconds for every line, in every place that a function is inlined. A
written function is run as Python instead, with a ``Value`` for what is not known yet, and each
operation writes its instruction. Its loops and branches are those of Python, over what is known;
``loop``, ``when`` and ``either`` write those of the compiled code, whose bodies are run once. It
can call other written functions and intrinsics, and ``call`` those that Numba compiles.

Where nothing is unknown, on arrays of NumPy, the same functions calculate, by what ``PLAIN`` has
for the intrinsics: the tests run the whole step so.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.extending import _Intrinsic
from numba.core.registry import cpu_target

NUMBERS = {bool: types.boolean, int: types.intp, float: types.float64}
# signature and code of each operation on two numbers; ``_vector`` adds those of its vectors
OPERATIONS: dict[Any, Any] = {}


def _on_numbers(operation: Callable[..., Any], kind, instruction: str) -> None:
    def build(context, builder, sig, args):
        return getattr(builder, instruction)(*args)

    OPERATIONS[operation, kind, kind] = kind(kind, kind), build


for _operation in (operator.add, operator.sub, operator.mul):
    _on_numbers(_operation, types.intp, _operation.__name__)
    _on_numbers(_operation, types.float64, f"f{_operation.__name__}")


# calculations of intrinsics on known values, by name: ``tests/unit/dynamics/test_plain_target.py``
PLAIN: dict[str, Callable[..., Any]] = {}


class Code:
    """Place in a function at which instructions are written, ``is_kept`` unless for their types."""

    def __init__(self, context, typing_context, builder, *, is_kept=True) -> None:
        self.context, self.typing_context = context, typing_context
        self.builder, self.is_kept = builder, is_kept

    def value(self, kind, llvm):
        """A number that is known, a tuple of values, or a ``Value``: Python calculates with it."""
        if isinstance(kind, types.Literal):
            return kind.literal_value
        if isinstance(kind, (types.Tuple, types.UniTuple)):
            return tuple(self._parts(kind, llvm))
        if isinstance(kind, types.NamedUniTuple):
            return kind.instance_class(*self._parts(kind, llvm))
        if isinstance(llvm, ir.Constant) and isinstance(llvm.type, ir.IntType):
            return llvm.constant
        return Value(self, kind, llvm)

    def _parts(self, kind, llvm):
        for place, part in enumerate(kind.types):
            yield self.value(part, self.builder.extract_value(llvm, place))

    def typed(self, value):
        """Numba's type and the code of what Python has calculated."""
        if isinstance(value, Value):
            return value.kind, value.llvm
        if value is None:
            return types.void, self.context.get_dummy_value()
        if isinstance(value, tuple):
            kinds, parts = zip(*map(self.typed, value), strict=True)
            kind = types.BaseTuple.from_types(kinds)
            if hasattr(value, "_fields"):
                kind = types.BaseNamedTuple.from_types(kinds, type(value))
            return kind, self.context.make_tuple(self.builder, kind, parts)
        kind = NUMBERS[type(value)]
        return kind, self.context.get_constant(kind, value)

    def write(self, definition, values):
        """Write what a function of types defines: a signature, and a function that builds code."""
        kinds, parts = zip(*map(self.typed, values), strict=True)
        sig, build = definition(self.typing_context, *kinds)
        llvm = build(self.context, self.builder, sig, parts)
        if sig.return_type is types.void:
            return None
        return self.value(sig.return_type, llvm)


def _writing(operation: Callable[..., Any], *, swapped: bool = False) -> Any:
    def define(typing_context, *kinds):
        return OPERATIONS[operation, *kinds]

    def write(self, other):
        return self.code.write(define, (other, self) if swapped else (self, other))

    return write


class Value:
    """A number, vector, array or named tuple that is not known while its code is written."""

    def __init__(self, code, kind, llvm) -> None:
        self.code, self.kind, self.llvm = code, kind, llvm

    def __getattr__(self, name: str):
        if name not in getattr(self.kind, "fields", ()):
            raise AttributeError(f"{self.kind} has no {name}")
        place = self.kind.fields.index(name)
        part = self.code.builder.extract_value(self.llvm, place)
        return self.code.value(self.kind.types[place], part)

    def __bool__(self) -> bool:
        raise TypeError("a written function cannot branch on what is not known")

    def __eq__(self, other: object) -> bool:
        raise TypeError("a written function cannot compare what is not known")

    __hash__ = None  # type: ignore[assignment]
    __add__, __radd__ = _writing(operator.add), _writing(operator.add, swapped=True)
    __sub__, __rsub__ = _writing(operator.sub), _writing(operator.sub, swapped=True)
    __mul__, __rmul__ = _writing(operator.mul), _writing(operator.mul, swapped=True)
    __truediv__ = _writing(operator.truediv)
    __rtruediv__ = _writing(operator.truediv, swapped=True)


_Base: Any = _Intrinsic


class Intrinsic(_Base):  # type: ignore[misc]
    """An intrinsic of Numba that written functions can call, too."""

    def __init__(self, definition, *, prefer_literal: bool = False) -> None:
        name = definition.__name__
        super().__init__(name, definition, prefer_literal=prefer_literal)
        self._register()

    def __call__(self, *arguments):
        for each in arguments:
            if isinstance(each, Value):
                return each.code.write(self._defn, arguments)
        return PLAIN[self._name](*arguments)


class TypeTest(Intrinsic):
    """True for named tuples of a type; a constant of the compiled code."""

    def __init__(self, kind: type) -> None:
        def is_of_kind(typing_context, value):
            answer = issubclass(value.instance_class, kind)

            def build(context, builder, sig, args):
                return context.get_constant(types.boolean, answer)

            return types.boolean(value), build

        super().__init__(is_of_kind)
        self._kind = kind

    def __call__(self, *arguments):
        if isinstance(arguments[0], Value):
            return super().__call__(*arguments)
        return isinstance(arguments[0], self._kind)


class Written(Intrinsic):
    """A Python function that is run where compiled functions call it."""

    def __init__(self, function) -> None:
        def definition(typing_context, *kinds):
            return _defined(function, typing_context, kinds)

        _name(definition, function)
        super().__init__(definition, prefer_literal=True)
        self._function = function

    def __call__(self, *arguments):
        return self._function(*arguments)


def _name(definition: Any, function: Callable[..., Any]) -> None:
    """Give a definition the arguments of a function, whose names Numba reads, and its name."""
    own = inspect.signature(function)
    first = inspect.signature(definition).parameters["typing_context"]
    parameters = [first, *own.parameters.values()]
    definition.__signature__ = own.replace(parameters=parameters)
    definition.__name__ = function.__name__


def _defined(function, typing_context, kinds):
    """Signature of a written function, from code that is thrown away, and what builds its code."""

    def run(context, builder, llvms, *, is_kept):
        here = Code(context, typing_context, builder, is_kept=is_kept)
        with _writing_to(here) as code:
            return code.typed(function(*map(code.value, kinds, llvms)))

    def build(context, builder, sig, args):
        return run(context, builder, args, is_kept=True)[1]

    context = cpu_target.target_context
    arguments = [context.get_value_type(kind) for kind in kinds]
    signature = ir.FunctionType(ir.VoidType(), arguments)
    nowhere = ir.Function(ir.Module(), signature, function.__name__)
    builder = ir.IRBuilder(nowhere.append_basic_block())
    kind, _ = run(context, builder, nowhere.args, is_kept=False)
    return kind(*kinds), build


class Traced(Intrinsic):
    """A written function without a result, which is run once, where a compiled one calls it."""

    def __init__(self, function) -> None:
        def definition(typing_context, *kinds):
            def build(context, builder, sig, args):
                with _writing_to(Code(context, typing_context, builder)) as code:
                    function(*map(code.value, sig.args, args))
                return context.get_dummy_value()

            return types.void(*kinds), build

        _name(definition, function)
        super().__init__(definition, prefer_literal=True)
        self._function = function

    def __call__(self, *arguments):
        return self._function(*arguments)


intrinsic: Any = Intrinsic


written: Any = Written
traced: Any = Traced
type_test: Any = TypeTest


_open: list[Code] = []  # to which functions that are run write, the innermost last


@contextmanager
def _writing_to(code: Code) -> Iterator[Code]:
    _open.append(code)
    try:
        yield code
    finally:
        _open.pop()


def loop(count: Any, body: Callable[[Any], None]) -> None:
    """Write a loop whose body is run once, for an index that is not known.

    ``count`` is an integer. Values that the body makes must not be used after it, nor can it change
    any: sums live in rows. A count of 1 that is known needs no loop.
    """
    if not _open or (isinstance(count, int) and count == 1):
        for place in range(count):
            body(place)
        return
    code = _open[-1]
    _, llvm = code.typed(count)
    with cgutils.for_range(code.builder, llvm) as place:
        body(Value(code, types.intp, place.index))


def fold(
    first: Any, last: Any, body: Callable[..., Sequence[Any]], values: Sequence[Any]
) -> list[Any]:
    """Values that a loop carries: ``body(place, *values)`` gives those of the next place.

    The body is run once, for a place that is not known, from ``first`` to before ``last``.
    """
    if not _open:
        for place in range(first, last):
            values = body(place, *values)
        return list(values)
    code = _open[-1]
    builder, (_, low), (_, high) = code.builder, code.typed(first), code.typed(last)
    typed = [code.typed(value) for value in values]
    kinds, given = [kind for kind, _ in typed], [llvm for _, llvm in typed]
    before = builder.block
    head, inside, after = (
        builder.append_basic_block(name) for name in ("head", "inside", "after")
    )
    builder.branch(head)
    builder.position_at_end(head)
    place, carried = builder.phi(low.type), [builder.phi(each.type) for each in given]
    builder.cbranch(builder.icmp_signed("<", place, high), inside, after)
    builder.position_at_end(inside)
    held = [Value(code, *each) for each in zip(kinds, carried, strict=True)]
    changed = [
        code.typed(each)[1] for each in body(Value(code, types.intp, place), *held)
    ]
    following = builder.add(place, low.type(1))
    _carry([place, *carried], [low, *given], before)
    _carry([place, *carried], [following, *changed], builder.block)
    builder.branch(head)
    builder.position_at_end(after)
    return held


def repeat(
    most: int, body: Callable[..., Sequence[Any]], values: Sequence[Any]
) -> list[Any]:
    """Values after some rounds: ``body(*values)`` gives whether there is another, and the next.

    The body is run once. There is one round at least, and at most ``most``.
    """
    if not _open:
        for _ in range(most):
            again, *values = body(*values)
            if not again:
                break
        return list(values)
    code = _open[-1]
    builder, (_, limit) = code.builder, code.typed(most)
    typed = [code.typed(value) for value in values]
    kinds, given = [kind for kind, _ in typed], [llvm for _, llvm in typed]
    before, none = builder.block, limit.type(0)
    head, after = (builder.append_basic_block(name) for name in ("round", "done"))
    builder.branch(head)
    builder.position_at_end(head)
    done, carried = builder.phi(limit.type), [builder.phi(each.type) for each in given]
    held = [Value(code, *each) for each in zip(kinds, carried, strict=True)]
    again, *changed = body(*held)
    ends = [code.typed(each)[1] for each in changed]
    following = builder.add(done, limit.type(1))
    is_more = builder.and_(again.llvm, builder.icmp_signed("<", following, limit))
    _carry([done, *carried], [none, *given], before)
    _carry([done, *carried], [following, *ends], builder.block)
    builder.cbranch(is_more, head, after)
    builder.position_at_end(after)
    return [Value(code, *each) for each in zip(kinds, ends, strict=True)]


def _carry(phis: Sequence[Any], values: Sequence[Any], block: Any) -> None:
    for phi, value in zip(phis, values, strict=True):
        phi.add_incoming(value, block)


def choose(
    condition: Any, yes: Callable[[], Sequence[Any]], no: Callable[[], Sequence[Any]]
) -> list[Any]:
    """Values of one of two branches, both of which are run once."""
    if not isinstance(condition, Value):
        return list(yes() if condition else no())
    code, ways = _open[-1], []
    with code.builder.if_else(condition.llvm) as branches:
        for branch, body in zip(branches, (yes, no), strict=True):
            with branch:
                typed = [code.typed(value) for value in body()]
                ways.append((typed, code.builder.block))
    result = []
    (first, block), (second, other_block) = ways
    for (kind, one), (_, other) in zip(first, second, strict=True):
        phi = code.builder.phi(one.type)
        _carry([phi], [one], block)
        _carry([phi], [other], other_block)
        result.append(Value(code, kind, phi))
    return result


def any_of(*conditions: Any) -> Any:
    """True where any of some conditions holds."""
    if not _open:
        return any(conditions)
    code, total = _open[-1], conditions[0].llvm
    for condition in conditions[1:]:
        total = code.builder.or_(total, condition.llvm)
    return Value(code, types.boolean, total)


def when(condition: Any, body: Callable[[], None]) -> None:
    """Write a branch that is seldom taken; values that it makes must not be used after it."""
    if not _open:
        if condition:
            body()
        return
    with _open[-1].builder.if_then(condition.llvm, likely=False):
        body()


def either(
    condition: Any, body: Callable[[], Sequence[Any]], values: Sequence[Any]
) -> list[Any]:
    """Values that a branch gives where it is taken, which is seldom, else those that are given."""
    if not _open:
        return list(body() if condition else values)
    code = _open[-1]
    before, given = code.builder.block, [code.typed(value) for value in values]
    with code.builder.if_then(condition.llvm, likely=False):
        changed = [code.typed(value) for value in body()]
        inside = code.builder.block
    result = []
    for (kind, old), (_, new) in zip(given, changed, strict=True):
        either_way = code.builder.phi(old.type)
        either_way.add_incoming(old, before)
        either_way.add_incoming(new, inside)
        result.append(Value(code, kind, either_way))
    return result


def call(function: Any, *values: Any) -> None:
    """Write a call of a function that Numba compiles; its result is dropped."""
    if not _open:
        function(*values)
        return
    code = _open[-1]
    if not code.is_kept:
        return
    kinds, llvms = zip(*map(code.typed, values), strict=True)
    kind = types.Dispatcher(function)
    sig = kind.get_call_type(code.typing_context, kinds, {})
    code.context.get_function(kind, sig)(code.builder, llvms)
