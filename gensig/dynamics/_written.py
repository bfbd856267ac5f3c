"""Functions whose code is written out where they are called, without Numba's compiler.

Numba's compiler takes milliseconds for every line, in every place that a function is inlined. A
written function is run as Python instead, with a ``Value`` for what is not known yet, and each
operation writes its instruction. Its loops and branches are those of Python, over what is known.
It can call other written functions and intrinsics.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
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


class Code:
    """Place in a function at which instructions are written."""

    def __init__(self, context, typing_context, builder) -> None:
        self.context, self.typing_context = context, typing_context
        self.builder = builder

    def value(self, kind, llvm):
        """A number that is known, a tuple of values, or a ``Value``: Python calculates with it."""
        if isinstance(kind, types.Literal):
            return kind.literal_value
        if isinstance(kind, types.UniTuple):
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
        code = next(each.code for each in arguments if isinstance(each, Value))
        return code.write(self._defn, arguments)


class Written(Intrinsic):
    """A Python function that is run where compiled functions call it."""

    def __init__(self, function) -> None:
        def definition(typing_context, *kinds):
            return _defined(function, typing_context, kinds)

        # Numba reads the names of the arguments
        own = inspect.signature(function)
        first = inspect.signature(definition).parameters["typing_context"]
        parameters = [first, *own.parameters.values()]
        named: Any = definition
        named.__signature__ = own.replace(parameters=parameters)
        named.__name__ = function.__name__
        super().__init__(definition, prefer_literal=True)
        self._function = function

    def __call__(self, *arguments):
        return self._function(*arguments)


def _defined(function, typing_context, kinds):
    """Signature of a written function, from code that is thrown away, and what builds its code."""

    def run(context, builder, llvms):
        code = Code(context, typing_context, builder)
        return code.typed(function(*map(code.value, kinds, llvms)))

    def build(context, builder, sig, args):
        return run(context, builder, args)[1]

    context = cpu_target.target_context
    arguments = [context.get_value_type(kind) for kind in kinds]
    signature = ir.FunctionType(ir.VoidType(), arguments)
    nowhere = ir.Function(ir.Module(), signature, function.__name__)
    builder = ir.IRBuilder(nowhere.append_basic_block())
    return run(context, builder, nowhere.args)[0](*kinds), build


intrinsic: Any = Intrinsic


def type_test(kind: type) -> Any:
    """An intrinsic that is True for named tuples of a type; a constant of the compiled code."""

    def is_of_kind(typing_context: Any, value: Any) -> Any:
        answer = issubclass(value.instance_class, kind)

        def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return context.get_constant(types.boolean, answer)

        return types.boolean(value), build

    return Intrinsic(is_of_kind)


written: Any = Written
