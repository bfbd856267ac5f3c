"""Four float64 side by side as one Numba value, one for each record of a group.

Numba cannot be told that arrays do not overlap, so LLVM seldom vectorises its loops. A value of LLVM's own vector type
needs no luck, and its lanes cannot touch each other: a record's bits do not depend on its neighbours. No fast-math.
"""

from __future__ import annotations

import functools
import operator
from typing import Any

from llvmlite import ir
from numba import njit
from numba.core import types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

LANES = 4

# Without Numba's reference counting (arrays are borrowed, none is made here) a step costs a third less.
_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}
compiled: Any = functools.partial(njit, nogil=True, **_OPTIONS)()
inlined: Any = functools.partial(njit, inline="always", **_OPTIONS)()

_intrinsic: Any = intrinsic


class Vector(types.Type):  # type: ignore[misc]
    """The Numba type of ``LANES`` float64."""

    def __init__(self) -> None:
        super().__init__(name=f"float64x{LANES}")


VECTOR = Vector()
_LLVM = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)


@register_model(Vector)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _LLVM)


def _binary(function: Any, instruction: str) -> None:
    @infer_global(function)
    class _Typed(ConcreteTemplate):  # type: ignore[misc]
        cases = [signature(VECTOR, VECTOR, VECTOR)]  # noqa: RUF012

    @lower_builtin(function, VECTOR, VECTOR)  # type: ignore[untyped-decorator]
    def _lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, instruction)(*args)


for _function, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _binary(_function, _instruction)


def _address(context: Any, builder: Any, kind: Any, array: Any, place: Any) -> Any:
    # the plain field: a proxy of the whole array at every access would cost the compiler most of its time
    data = builder.extract_value(array, context.data_model_manager[kind].get_field_position("data"))
    return builder.bitcast(builder.gep(data, [place]), _LLVM.as_pointer())


@_intrinsic
def load(typing_context: Any, array: Any, place: Any) -> Any:
    """The vector that begins at ``place`` of a one-dimensional float64 array."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_address(context, builder, sig.args[0], args[0], args[1]), align=8)

    return VECTOR(array, types.intp), build


@_intrinsic
def store(typing_context: Any, array: Any, place: Any, value: Any) -> Any:
    """Write a vector from ``place`` of a one-dimensional float64 array on."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _address(context, builder, sig.args[0], args[0], args[1]), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, VECTOR), build


@_intrinsic
def spread(typing_context: Any, value: Any) -> Any:
    """The same number in every lane."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        nothing = ir.Constant(_LLVM, ir.Undefined)
        one = builder.insert_element(nothing, args[0], ir.Constant(_INDEX, 0))
        return builder.shuffle_vector(one, nothing, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES))

    return VECTOR(types.float64), build


@_intrinsic
def where_above(typing_context: Any, a: Any, b: Any, yes: Any, no: Any) -> Any:
    """``yes`` in the lanes where a > b, ``no`` elsewhere."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", args[0], args[1]), args[2], args[3])

    return VECTOR(VECTOR, VECTOR, VECTOR, VECTOR), build


@_intrinsic
def any_above(typing_context: Any, a: Any, b: Any) -> Any:
    """Whether a > b in any lane."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(builder.fcmp_ordered(">", args[0], args[1]), ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(VECTOR, VECTOR), build


@_intrinsic
def transpose(typing_context: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Four rows as four columns."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        def mixed(x: Any, y: Any, places: list[int]) -> Any:
            return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(_INDEX, LANES), places))

        low, high = [0, 4, 1, 5], [2, 6, 3, 7]
        ac_low, bd_low = mixed(args[0], args[2], low), mixed(args[1], args[3], low)
        ac_high, bd_high = mixed(args[0], args[2], high), mixed(args[1], args[3], high)
        columns = [
            mixed(ac_low, bd_low, low), mixed(ac_low, bd_low, high), mixed(ac_high, bd_high, low),
            mixed(ac_high, bd_high, high),
        ]  # fmt: skip
        return context.make_tuple(builder, sig.return_type, columns)

    return types.UniTuple(VECTOR, LANES)(VECTOR, VECTOR, VECTOR, VECTOR), build
