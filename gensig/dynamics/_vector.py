"""Several numbers side by side as one Numba value, one for each record of a group.

Numba cannot be told that arrays do not overlap, so LLVM seldom vectorises its loops. A value of
LLVM's own vector type always is a vector, and its lanes cannot affect each other: a record's bits
do not depend on its neighbours. No fast-math.

A group is 64 bytes wide: two AVX registers, so that each waits less for the other. Rows of tables
are vectors of four. Functions with ``typing_context`` are Numba intrinsics: they return a
signature and a function that builds the code.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model
from numpy.typing import NDArray

from gensig.dynamics._caching import compiled as compiled
from gensig.dynamics._caching import inlined as inlined
from gensig.dynamics._written import OPERATIONS, intrinsic, written

PRECISIONS = ("float64", "float32")
GROUP_BYTES = 64
FOUR = 4

_INDEX = ir.IntType(32)


def n_lanes(precision: str) -> int:
    """Records of a group: 8 in float64, 16 in float32."""
    return int(GROUP_BYTES // np.dtype(precision).itemsize)


def aligned(values: NDArray[Any]) -> NDArray[Any]:
    """A copy whose rows begin where cache lines do; others take up to a sixth more time."""
    raw = np.empty(values.nbytes + GROUP_BYTES, dtype=np.uint8)
    first = -raw.ctypes.data % GROUP_BYTES
    result = raw[first : first + values.nbytes].view(values.dtype)
    result = result.reshape(values.shape)
    result[...] = values
    return result


LANES = n_lanes("float64")
_ELEMENTS = {"float64": types.float64, "float32": types.float32}
_NUMBERS = {types.float64: ir.DoubleType(), types.float32: ir.FloatType()}


class Vector(types.Type):  # type: ignore[misc]
    """The Numba type of several numbers of one kind."""

    def __init__(self, element, count: int) -> None:
        self.element, self.count = element, count
        self.llvm = ir.VectorType(_NUMBERS[element], count)
        super().__init__(name=f"{element}x{count}")


@register_model(Vector)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager, kind) -> None:
        super().__init__(manager, kind, kind.llvm)


GROUPS = {kind: Vector(kind, n_lanes(name)) for name, kind in _ELEMENTS.items()}
ROWS = {kind: Vector(kind, FOUR) for kind in _ELEMENTS.values()}
VECTORS = (*GROUPS.values(), *ROWS.values())


def _constants(numbers):
    return ir.Constant(ir.VectorType(_INDEX, len(numbers)), numbers)


def _filled(builder, kind, number):
    """A float64 in every lane of a vector."""
    if kind.element is types.float32:
        number = builder.fptrunc(number, ir.FloatType())
    return _repeated(builder, kind, number)


def _repeated(builder, kind, number):
    """A number of a vector's kind in every lane."""
    nothing = ir.Constant(kind.llvm, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(first, nothing, _constants([0] * kind.count))


def _binary(function, instruction: str) -> None:
    @infer_global(function)
    class _Typed(ConcreteTemplate):  # type: ignore[misc]
        cases = [  # noqa: RUF012
            signature(kind, *arguments)
            for kind in VECTORS
            for arguments in (
                (kind, kind),
                (kind, types.float64),
                (types.float64, kind),
            )
        ]

    for kind in VECTORS:

        @lower_builtin(function, kind, kind)  # type: ignore[untyped-decorator]
        @lower_builtin(function, kind, types.float64)  # type: ignore[untyped-decorator]
        @lower_builtin(function, types.float64, kind)  # type: ignore[untyped-decorator]
        def _build(context, builder, sig, args):
            vectors = list(args)
            for position, given in enumerate(sig.args):
                if given is types.float64:
                    vectors[position] = _filled(
                        builder, sig.return_type, args[position]
                    )
            return getattr(builder, instruction)(*vectors)

        for sig in _Typed.cases:
            if sig.return_type is kind:
                OPERATIONS[function, *sig.args] = sig, _build


_binary(operator.add, "fadd")
_binary(operator.sub, "fsub")
_binary(operator.mul, "fmul")
_binary(operator.truediv, "fdiv")


def _address(context, builder, kind, array, index, llvm):
    """Address of a number or vector of LLVM type ``llvm`` in an array."""
    # the plain field: a proxy of the whole array at every access would take most of the
    # compiler's time
    position = context.data_model_manager[kind].get_field_position("data")
    data = builder.extract_value(array, position)
    return builder.bitcast(builder.gep(data, [index]), llvm.as_pointer())


def _loading(vector, array, per_index: int):
    """Signature and code of loading a vector from ``per_index`` times an index on."""

    def build(context, builder, sig, args):
        index = builder.mul(args[1], ir.Constant(args[1].type, per_index))
        address = _address(context, builder, sig.args[0], args[0], index, vector.llvm)
        return builder.load(address, align=vector.element.bitwidth // 8)

    return vector(array, types.intp), build


def _storing(vector, array, per_index: int):
    """Signature and code of storing a vector from ``per_index`` times an index on."""

    def build(context, builder, sig, args):
        index = builder.mul(args[1], ir.Constant(args[1].type, per_index))
        address = _address(context, builder, sig.args[0], args[0], index, vector.llvm)
        builder.store(args[2], address, align=vector.element.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, vector), build


@intrinsic
def load_four(typing_context, array, index):
    """Four numbers from ``index`` on."""
    return _loading(ROWS[array.dtype], array, 1)


@intrinsic
def store(typing_context, array, index, value):
    """Write a vector from ``index`` of a one-dimensional array of its kind on."""
    if array.dtype is not value.element:
        raise TypeError(f"{value} does not fit an array of {array.dtype}")
    return _storing(value, array, 1)


@intrinsic
def get_row(typing_context, array, row):
    """A row of a flat array: one number for every record of the group."""
    vector = GROUPS[array.dtype]
    return _loading(vector, array, vector.count)


@intrinsic
def set_row(typing_context, array, row, value):
    """Write a row of a flat array."""
    vector = GROUPS[array.dtype]
    if value is not vector:
        raise TypeError(f"{value} is no row of an array of {array.dtype}")
    return _storing(vector, array, vector.count)


@written
def at(row, lane, n_lanes):
    """Index of one record's number in a flat array: row ``row``, record ``lane``."""
    return row * n_lanes + lane


@intrinsic
def width(typing_context, array):
    """Records of a group whose numbers have the array's kind."""

    def build(context, builder, sig, args):
        return context.get_constant(types.intp, GROUPS[sig.args[0].dtype].count)

    return types.intp(array), build


@intrinsic
def spread(typing_context, array, value):
    """The same number in every lane, of the array's kind."""

    def build(context, builder, sig, args):
        return _filled(builder, sig.return_type, args[1])

    return GROUPS[array.dtype](array, types.float64), build


@intrinsic
def where_above(typing_context, a, b, yes, no):
    """``yes`` in the lanes where a > b, ``no`` elsewhere."""

    def build(context, builder, sig, args):
        above = builder.fcmp_ordered(">", args[0], args[1])
        return builder.select(above, args[2], args[3])

    return a(a, a, a, a), build


@intrinsic
def chosen(typing_context, condition, yes, no):
    """``yes`` in every lane if a condition holds, else ``no``."""

    def build(context, builder, sig, args):
        return builder.select(*args)

    return yes(types.boolean, yes, yes), build


@intrinsic
def plus_product(typing_context, total, factors, index, value):
    """``total + factors[index] * value``, rounded once.

    ``factors`` is an array of the vectors' kind.
    """

    def build(context, builder, sig, args):
        kind = sig.return_type
        llvm = _NUMBERS[kind.element]
        address = _address(context, builder, sig.args[1], args[1], args[2], llvm)
        factor = _repeated(builder, kind, builder.load(address))
        name = f"llvm.fma.v{kind.count}f{kind.element.bitwidth}"
        function_type = ir.FunctionType(kind.llvm, (kind.llvm,) * 3)
        fma = get_or_insert_function(builder.module, function_type, name)
        return builder.call(fma, (factor, args[3], args[0]))

    return total(total, factors, types.intp, total), build


@intrinsic
def fused(typing_context, a, b, total):
    """``a * b + total``, rounded once; a scalar stands for the same number in every lane."""
    arguments = a, b, total
    kind = next(each for each in arguments if isinstance(each, Vector))

    def build(context, builder, sig, args):
        vectors = list(args)
        for position, given in enumerate(sig.args):
            if given is types.float64:
                vectors[position] = _filled(builder, kind, args[position])
        name = f"llvm.fma.v{kind.count}f{kind.element.bitwidth}"
        function_type = ir.FunctionType(kind.llvm, (kind.llvm,) * 3)
        fma = get_or_insert_function(builder.module, function_type, name)
        return builder.call(fma, vectors)

    kinds = [each if each is kind else types.float64 for each in arguments]
    return kind(*kinds), build


@intrinsic
def any_above(typing_context, a, b):
    """True if a > b in any lane."""

    def build(context, builder, sig, args):
        bits = ir.IntType(sig.args[0].count)
        above = builder.bitcast(builder.fcmp_ordered(">", args[0], args[1]), bits)
        return builder.icmp_unsigned("!=", above, ir.Constant(bits, 0))

    return types.boolean(a, a), build


@intrinsic
def transpose(typing_context, a, b, c, d):
    """Four rows of four as four columns."""

    def build(context, builder, sig, args):
        def interleaved(x, y):
            low = builder.shuffle_vector(x, y, _constants([0, 4, 1, 5]))
            return low, builder.shuffle_vector(x, y, _constants([2, 6, 3, 7]))

        ac_low, ac_high = interleaved(args[0], args[2])
        bd_low, bd_high = interleaved(args[1], args[3])
        columns = [*interleaved(ac_low, bd_low), *interleaved(ac_high, bd_high)]
        return context.make_tuple(builder, sig.return_type, columns)

    return types.UniTuple(a, FOUR)(a, a, a, a), build


@intrinsic
def second_and_fourth(typing_context, row):
    """(b, b, d, d) of a row (a, b, c, d)."""

    def build(context, builder, sig, args):
        nothing = ir.Constant(sig.args[0].llvm, ir.Undefined)
        return builder.shuffle_vector(args[0], nothing, _constants([1, 1, 3, 3]))

    return row(row), build


EIGHT = 8
WIDE = GROUPS[types.float64]  # eight numbers in float64, for what float32 would lose


def _eight_of(element, llvm_number):
    """LLVM type of eight numbers of an array."""
    return ir.VectorType(llvm_number, EIGHT), element.bitwidth // 8


@intrinsic
def load_wide(typing_context, array, index):
    """Eight numbers from ``index`` on, in float64."""
    number = array.dtype

    def build(context, builder, sig, args):
        llvm, n_bytes = _eight_of(number, _NUMBERS[number])
        address = _address(context, builder, sig.args[0], args[0], args[1], llvm)
        values = builder.load(address, align=n_bytes)
        if number is types.float64:
            return values
        return builder.fpext(values, WIDE.llvm)

    return WIDE(array, types.intp), build


@intrinsic
def truncated(typing_context, value):
    """Every number without its fraction."""

    def build(context, builder, sig, args):
        name = f"llvm.trunc.v{EIGHT}f64"
        function_type = ir.FunctionType(WIDE.llvm, (WIDE.llvm,))
        function = get_or_insert_function(builder.module, function_type, name)
        return builder.call(function, args)

    return WIDE(WIDE), build


@intrinsic
def lower(typing_context, value):
    """The first eight numbers of a group, in float64."""
    return _part(value, 0)


@intrinsic
def upper(typing_context, value):
    """The last eight numbers of a group, in float64."""
    return _part(value, value.count - EIGHT)


def _part(kind, first):
    """Signature and code of eight numbers of a group from one on, in float64."""

    def build(context, builder, sig, args):
        if kind is WIDE:
            return args[0]
        mask = _constants(list(range(first, first + EIGHT)))
        part = builder.shuffle_vector(args[0], args[0], mask)
        return builder.fpext(part, WIDE.llvm)

    return WIDE(kind), build


@intrinsic
def joined(typing_context, array, low, high):
    """A row of the array's kind from its first and its last eight numbers in float64."""
    kind = GROUPS[array.dtype]

    def build(context, builder, sig, args):
        if kind is WIDE:
            return args[1]
        eight = ir.VectorType(_NUMBERS[kind.element], EIGHT)
        parts = [builder.fptrunc(part, eight) for part in args[1:]]
        return builder.shuffle_vector(*parts, _constants(list(range(2 * EIGHT))))

    return kind(array, WIDE, WIDE), build


@intrinsic
def cells(typing_context, table, low, high):
    """Eight numbers from one index of a table on for every lane, as eight rows of the group.

    ``low`` and ``high`` are the indices of the first and of the last eight lanes.
    """
    kind = GROUPS[table.dtype]

    def build(context, builder, sig, args):
        llvm, n_bytes = _eight_of(kind.element, _NUMBERS[kind.element])
        integers = ir.VectorType(ir.IntType(64), EIGHT)
        lanes = []
        for part in args[1 : 1 + kind.count // EIGHT]:
            indices = builder.fptosi(part, integers)
            for lane in range(EIGHT):
                index = builder.extract_element(indices, ir.Constant(_INDEX, lane))
                address = _address(context, builder, sig.args[0], args[0], index, llvm)
                lanes.append(builder.load(address, align=n_bytes))
        return context.make_tuple(builder, sig.return_type, _columns(builder, lanes))

    return types.UniTuple(kind, EIGHT)(table, WIDE, WIDE), build


def _columns(builder, lanes):
    """Eight columns of 8 or 16 vectors of eight: 8 by 8 blocks transposed side by side."""
    n_blocks = len(lanes) // EIGHT
    rows = lanes[:EIGHT]
    if n_blocks == 2:
        both = _constants(list(range(2 * EIGHT)))
        pairs = zip(lanes[:EIGHT], lanes[EIGHT:], strict=True)
        rows = [builder.shuffle_vector(low, high, both) for low, high in pairs]
    n, reach = len(lanes), 1
    while reach < EIGHT:  # swap blocks of so many numbers between rows so far apart
        low, high = _swaps(n, reach)
        swapped = list(rows)
        for i in range(EIGHT):
            if i & reach == 0:
                pair = rows[i], rows[i + reach]
                swapped[i] = builder.shuffle_vector(*pair, _constants(low))
                swapped[i + reach] = builder.shuffle_vector(*pair, _constants(high))
        rows, reach = swapped, 2 * reach
    return rows


def _swaps(n, reach):
    """Masks that join the even, and the odd, blocks of ``reach`` numbers of two vectors of n."""
    low = [k if k & reach == 0 else n + k - reach for k in range(n)]
    high = [k + reach if k & reach == 0 else n + k for k in range(n)]
    return low, high
