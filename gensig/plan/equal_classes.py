"""Classes of a plan whose records would be equal: two labels for one signal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gensig.arrays import Array
from gensig.dataset.plan import Plan
from gensig.errors import GensigError
from gensig.faults.base import Fault
from gensig.faults.broken import MissingTooth
from gensig.faults.registry import fault_parts
from gensig.plan.tooth_reach import passage_approach, tooth_reach
from gensig.record.inputs import InputReader, row_faults
from gensig.systems.base import Machine
from gensig.units import from_si

SAME = 1e-9  # relative difference of static approaches that rounding alone can make
# begins and ends the columns of drawn deviations of flanks
SIZES, DEVIATION = "params/fault.", "_um"


def equal_classes(reader: InputReader, plan: Plan) -> list[str]:
    """A line for each class whose largest faults are none, or have the signal of another class.

    Compared is the static approach while the faulty tooth passes: all that the motion learns of
    the teeth, as long as a tooth that stands free does not swing into its mate. Every class is
    compared with the healthy machine, with a missing tooth, and with the classes before it, on the
    machine of the record with the least torque: there teeth that stand back touch least.
    """
    if reader.plan.sham:
        return []
    weakest = plan.record(int(np.argmin(plan.columns["torque_nm"])))
    machine = reader.inputs(weakest).machine
    seen: dict[str, list[Array]] = {}
    told = []
    for name, option in reader.classes.items():
        if not fault_parts(option):
            continue
        of_records = _extreme_faults(plan, name)
        if not of_records:
            continue
        largest, *others = of_records
        try:
            own = passage_approach(machine, largest)
            free = _stands_free(machine, [largest, *others])
            sound = _as_sound(machine, largest, own)
        except GensigError:  # the plan or the record says what does not fit
            continue
        told += [f"fault={name}: {text}" for text in (free, sound) if text]
        if free or sound:
            continue
        told += [
            f"fault={name}: its largest fault has the signal of {other}: two labels for one"
            for other, approach in seen.items()
            if _equal(own, approach)
        ]
        seen[name] = own
    torque = f"{float(weakest['torque_nm']):.4g} N m"
    return [f"at {torque}, {text}" for text in told]


def _extreme_faults(plan: Plan, name: str) -> list[list[Fault]]:
    """Faults of the class's records with the largest severity and the largest deviations.

    None for a class without records, as where a plan has fewer lives than classes.
    The severity tells nothing of the sign of a deviation: a tooth in front always touches.
    """
    columns = plan.columns
    rows = np.flatnonzero(columns["label_name"] == name)
    sizes = [
        key for key in columns if key.startswith(SIZES) and key.endswith(DEVIATION)
    ]
    chosen = []
    for key in ("severity", *sizes):
        values = columns[key][rows]
        if values.dtype.kind == "f" and not np.all(np.isnan(values)):
            chosen.append(int(rows[np.nanargmax(values)]))
    return [row_faults(plan.record(row)) for row in dict.fromkeys(chosen)]


def _stands_free(machine: Machine, of_records: Sequence[Sequence[Fault]]) -> str:
    """Words for a tooth that never touches, though it is there; none where all touch."""
    for faults in of_records:
        if all(isinstance(fault, MissingTooth) for fault in faults):
            continue
        gears = sorted({fault.gear for fault in faults})
        gone = [MissingTooth(gear=gear, tooth=0) for gear in gears]
        if _equal(passage_approach(machine, faults), passage_approach(machine, gone)):
            reach = from_si("reach_um", tooth_reach(machine, gears[0]))
            return (
                "its tooth touches nothing, so the signal is that of missing_tooth; flanks up to "
                f"{reach:.3g} um behind their place touch: make it smaller, raise "
                "operating.torque_nm, or call it missing_tooth"
            )
    return ""


def _as_sound(machine: Machine, faults: Sequence[Fault], own: list[Array]) -> str:
    """Words for a fault that changes nothing."""
    sound = passage_approach(machine, (), {fault.gear for fault in faults})
    if not _equal(own, sound):
        return ""
    return "its largest fault changes nothing: the signal is that of healthy"


def _equal(some: Sequence[Array], others: Sequence[Array]) -> bool:
    """True for the same number of passages with the same approaches."""
    return len(some) == len(others) and all(
        len(a) == len(b) and np.allclose(a, b, rtol=SAME, atol=0.0)
        for a, b in zip(some, others, strict=True)
    )
