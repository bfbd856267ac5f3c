"""Several numbers side by side as one Numba value, one for each record of a group.

Numba cannot be told that arrays do not overlap, so LLVM seldom vectorises its loops. A value of
LLVM's own vector type needs no luck, and its lanes cannot touch each other: a record's bits do
not depend on its neighbours. No fast-math.

A group is 64 bytes wide: two AVX registers, so that each waits less for the other. Rows of tables
are vectors of four.
"""

from __future__ import annotations

import functools
import hashlib
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

PRECISIONS = ("float64", "float32")
GROUP_BYTES = 64
FOUR = 4

# Without Numba's reference counting (arrays are borrowed, none is made here) a step costs a third
# less.
_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}


def source_stamp(folder: Path) -> str:
    """Hash of all private modules below a folder, whose compiled functions call each other across
    files.
    """
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("_*.py")):
        name = str(path.relative_to(folder))
        digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


_STAMP = source_stamp(Path(__file__).parents[1])  # of the whole package


def _stamped(decorator: Callable[[Any], Any]) -> Any:
    """The decorator, with a cache that is stale after a change of any of the files.

    Numba looks at a function's own file alone, and would go on with what was compiled of another
    one's former content.
    """

    def decorate(function: Any) -> Any:
        made = decorator(function)
        if hasattr(made, "_cache"):  # not where NUMBA_DISABLE_JIT is set
            made._cache._cache_file._source_stamp = _STAMP
        return made

    return decorate


compiled: Any = _stamped(functools.partial(njit, nogil=True, **_OPTIONS)())
inlined: Any = _stamped(functools.partial(njit, inline="always", **_OPTIONS)())

_intrinsic: Any = intrinsic
_INDEX = ir.IntType(32)


def n_lanes(precision: str) -> int:
    """Records of a group: 8 in float64, 16 in float32."""
    return int(GROUP_BYTES // np.dtype(precision).itemsize)


LANES = n_lanes("float64")


class Vector(types.Type):  # type: ignore[misc]
    """The Numba type of some numbers of one kind."""

    def __init__(self, element: Any, count: int) -> None:
        self.element, self.count = element, count
        self.llvm = ir.VectorType(
            ir.DoubleType() if element is types.float64 else ir.FloatType(), count
        )
        super().__init__(name=f"{element}x{count}")


@register_model(Vector)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, kind.llvm)


_ELEMENTS = {name: getattr(types, name) for name in PRECISIONS}
GROUPS = {
    element: Vector(element, n_lanes(name)) for name, element in _ELEMENTS.items()
}
ROWS = {element: Vector(element, FOUR) for element in _ELEMENTS.values()}
VECTORS = (*GROUPS.values(), *ROWS.values())


def _filled(builder: Any, kind: Vector, number: Any) -> Any:
    """A float64 in every place of a vector."""
    return _repeated(
        builder,
        kind,
        builder.fptrunc(number, ir.FloatType())
        if kind.element is types.float32
        else number,
    )


def _repeated(builder: Any, kind: Vector, number: Any) -> Any:
    """A number of a vector's kind in every place."""
    nothing = ir.Constant(kind.llvm, ir.Undefined)
    one = builder.insert_element(nothing, number, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(
        one, nothing, ir.Constant(ir.VectorType(_INDEX, kind.count), [0] * kind.count)
    )


def _binary(function: Any, instruction: str) -> None:
    @infer_global(function)
    class _Typed(ConcreteTemplate):  # type: ignore[misc]
        cases = [  # noqa: RUF012
            signature(kind, *given)
            for kind in VECTORS
            for given in ((kind, kind), (kind, types.float64), (types.float64, kind))
        ]

    for kind in VECTORS:

        @lower_builtin(function, kind, kind)  # type: ignore[untyped-decorator]
        def _both(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return getattr(builder, instruction)(*args)

        @lower_builtin(function, kind, types.float64)  # type: ignore[untyped-decorator]
        @lower_builtin(function, types.float64, kind)  # type: ignore[untyped-decorator]
        def _mixed(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            vectors = [
                value
                if given is sig.return_type
                else _filled(builder, sig.return_type, value)
                for given, value in zip(sig.args, args, strict=True)
            ]
            return getattr(builder, instruction)(*vectors)


for _function, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _binary(_function, _instruction)


_NUMBERS = {types.float64: ir.DoubleType(), types.float32: ir.FloatType()}


def _address(
    context: Any, builder: Any, kind: Any, array: Any, place: Any, read: Any
) -> Any:
    """Where a vector, or a single number, lies."""
    # the plain field: a proxy of the whole array at every access would cost the compiler most of
    # its time
    data = builder.extract_value(
        array, context.data_model_manager[kind].get_field_position("data")
    )
    llvm = read.llvm if isinstance(read, Vector) else _NUMBERS[read]
    return builder.bitcast(builder.gep(data, [place]), llvm.as_pointer())


@_intrinsic
def load_four(typing_context: Any, array: Any, place: Any) -> Any:
    """Four numbers from ``place`` on."""
    vector = ROWS[array.dtype]

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        address = _address(context, builder, sig.args[0], args[0], args[1], vector)
        return builder.load(address, align=vector.element.bitwidth // 8)

    return vector(array, types.intp), build


@_intrinsic
def store(typing_context: Any, array: Any, place: Any, value: Any) -> Any:
    """Write a vector from ``place`` of a one-dimensional array of its kind on."""
    if array.dtype is not value.element:
        raise TypeError(f"{value} does not fit an array of {array.dtype}")

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        size = sig.args[2].element.bitwidth // 8
        builder.store(
            args[2],
            _address(context, builder, sig.args[0], args[0], args[1], sig.args[2]),
            align=size,
        )
        return context.get_dummy_value()

    return types.void(array, types.intp, value), build


def _row_place(builder: Any, vector: Vector, row: Any) -> Any:
    """The place at which a row of a flat array begins."""
    return builder.mul(row, ir.Constant(row.type, vector.count))


@_intrinsic
def get_row(typing_context: Any, array: Any, row: Any) -> Any:
    """A row of a flat array: one number for every record of the group."""
    vector = GROUPS[array.dtype]

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _row_place(builder, vector, args[1])
        address = _address(context, builder, sig.args[0], args[0], place, vector)
        return builder.load(address, align=vector.element.bitwidth // 8)

    return vector(array, types.intp), build


@_intrinsic
def set_row(typing_context: Any, array: Any, row: Any, value: Any) -> Any:
    """Write a row of a flat array."""
    vector = GROUPS[array.dtype]
    if value is not vector:
        raise TypeError(f"{value} is no row of an array of {array.dtype}")

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _row_place(builder, vector, args[1])
        address = _address(context, builder, sig.args[0], args[0], place, vector)
        builder.store(args[2], address, align=vector.element.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, value), build


@_intrinsic
def at(typing_context: Any, row: Any, lane: Any, n_lanes: Any) -> Any:
    """The place of one record's number in a flat array.

    Row ``row``, record ``lane`` of ``n_lanes``.
    """

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.add(builder.mul(args[0], args[2]), args[1])

    return types.intp(types.intp, types.intp, types.intp), build


@_intrinsic
def width(typing_context: Any, array: Any) -> Any:
    """Records of a group whose numbers have the array's kind."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return context.get_constant(types.intp, GROUPS[sig.args[0].dtype].count)

    return types.intp(array), build


@_intrinsic
def spread(typing_context: Any, array: Any, value: Any) -> Any:
    """The same number in every lane, of the array's kind."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _filled(builder, sig.return_type, args[1])

    return GROUPS[array.dtype](array, types.float64), build


@_intrinsic
def where_above(typing_context: Any, a: Any, b: Any, yes: Any, no: Any) -> Any:
    """``yes`` in the lanes where a > b, ``no`` elsewhere."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(
            builder.fcmp_ordered(">", args[0], args[1]), args[2], args[3]
        )

    return a(a, a, a, a), build


@_intrinsic
def plus_product(
    typing_context: Any, total: Any, factors: Any, place: Any, value: Any
) -> Any:
    """``total + factors[place] * value``, rounded once.

    ``factors`` is an array of the vectors' kind.
    """

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = sig.return_type
        number = builder.load(
            _address(context, builder, sig.args[1], args[1], args[2], kind.element)
        )
        name = f"llvm.fma.v{kind.count}f{kind.element.bitwidth}"
        fma = get_or_insert_function(
            builder.module, ir.FunctionType(kind.llvm, (kind.llvm,) * 3), name
        )
        return builder.call(fma, (_repeated(builder, kind, number), args[3], args[0]))

    return total(total, factors, types.intp, total), build


@_intrinsic
def any_above(typing_context: Any, a: Any, b: Any) -> Any:
    """Whether a > b in any lane."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = ir.IntType(sig.args[0].count)
        return builder.icmp_unsigned(
            "!=",
            builder.bitcast(builder.fcmp_ordered(">", args[0], args[1]), bits),
            ir.Constant(bits, 0),
        )

    return types.boolean(a, a), build


@_intrinsic
def transpose(typing_context: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Four rows of four as four columns."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        def mixed(x: Any, y: Any, places: list[int]) -> Any:
            return builder.shuffle_vector(
                x, y, ir.Constant(ir.VectorType(_INDEX, FOUR), places)
            )

        low, high = [0, 4, 1, 5], [2, 6, 3, 7]
        ac_low, bd_low = mixed(args[0], args[2], low), mixed(args[1], args[3], low)
        ac_high, bd_high = mixed(args[0], args[2], high), mixed(args[1], args[3], high)
        columns = [
            mixed(ac_low, bd_low, low), mixed(ac_low, bd_low, high), mixed(ac_high, bd_high, low),
            mixed(ac_high, bd_high, high),
        ]  # fmt: skip
        return context.make_tuple(builder, sig.return_type, columns)

    return types.UniTuple(a, FOUR)(a, a, a, a), build


@_intrinsic
def second_and_fourth(typing_context: Any, row: Any) -> Any:
    """(b, b, d, d) of a row (a, b, c, d)."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        places = ir.Constant(ir.VectorType(_INDEX, FOUR), [1, 1, 3, 3])
        return builder.shuffle_vector(
            args[0], ir.Constant(sig.args[0].llvm, ir.Undefined), places
        )

    return row(row), build
