"""Integers and tails of flat arrays, without the checks and counts of Numba's own."""

from __future__ import annotations

from llvmlite import ir
from numba.core import types

from gensig.dynamics._written import intrinsic


@intrinsic
def tail(typing_context, array, first):
    """A view of a flat array from ``first`` on, whose length is not set: rows have none.

    A slice takes twenty instructions, as it also counts.
    """

    def build(context, builder, sig, args):
        position = context.data_model_manager[sig.args[0]].get_field_position("data")
        data = builder.extract_value(args[0], position)
        moved = builder.gep(data, [args[1]])
        return builder.insert_value(args[0], moved, position)

    return array(array, types.intp), build


@intrinsic
def rows_of(typing_context, array, n):
    """Rows of ``n`` numbers in a flat array."""

    def build(context, builder, sig, args):
        size = context.make_array(sig.args[0])(context, builder, args[0]).nitems
        return builder.udiv(size, args[1])

    return types.intp(array, types.intp), build


@intrinsic
def is_filled(typing_context, array):
    """True for a flat array that holds any number."""

    def build(context, builder, sig, args):
        size = context.make_array(sig.args[0])(context, builder, args[0]).nitems
        return builder.icmp_signed("!=", size, ir.Constant(size.type, 0))

    return types.boolean(array), build


@intrinsic
def number_at(typing_context, numbers, place):
    """An integer of a flat array at a place that is not negative."""

    def build(context, builder, sig, args):
        position = context.data_model_manager[sig.args[0]].get_field_position("data")
        data = builder.extract_value(args[0], position)
        return builder.load(builder.gep(data, [args[1]]))

    return numbers.dtype(numbers, types.intp), build
