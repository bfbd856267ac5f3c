"""The rows that ``gensig validate`` reads: unique, explained, able to fail. The verdicts:
test_validation_document.
"""

from dataclasses import replace

import pytest
from refusals import refused
from validation.rows import (
    DIFFERS,
    FAILS,
    HOLDS,
    NOT_PRINTED,
    REPRODUCED,
    SOURCES,
    half_last_digit,
    judge,
    printed_value,
    read_rows,
)
from validation.verdicts import KINDS, evaluate, run_validation

ROWS = [row for source in SOURCES for row in read_rows(source)]


def row_of(row_id):
    return next(row for row in ROWS if row.id == row_id)


def test_rows_are_unique_and_shortfalls_are_explained():
    ids = [(row.origin, row.id) for row in ROWS]
    assert len(set(ids)) == len(ids)
    unexplained = [
        row.id for row in ROWS if row.expected in (DIFFERS, FAILS) and not row.reason
    ]
    assert not unexplained
    assert not [row.id for row in ROWS if row.printed and not row.source]


def test_every_quantity_is_used():
    assert {name for quantities, _ in KINDS for name in quantities} == {
        row.quantity for row in ROWS
    }


@pytest.mark.parametrize(
    ("row_id", "word"),
    [
        ("table_2_2.pair_stiffness.C", "material.youngs_modulus_gpa=205"),
        (
            "table_2_2.pinion_foundation.C",
            "gear.cutter_tip_radius_coefficient=0.3",
        ),  # changes theta_f
        ("table_2_2.wheel_bending.A", "gear.cutter_tip_radius_coefficient=0.2"),
        ("table_2_3.9_15_crack_1mm_gamma.C", "fault.crack_start=arc_mid"),
        ("table_2_3.9_15_pit.C", "fault.pit_width_mm=9"),
        ("fe_coupled.double_zone.3_of_7", "mesh.pair_coupling=sum"),
        ("corner_gap.missing_tooth.peak", "gear.addendum_coefficient=0.98"),
        ("record_healthy_lin.RMS", "mesh.pair_coupling=coupled"),
        ("ours_structure_strain.pinion.C", "mesh.elasticity=plane_stress"),
        ("ours_tooth.pinion.C", "mesh.tooth=to_contact"),
        ("ours_body_bores.pinion_E.5mm", "mesh.body=sainsot"),
        ("ours_local.both_flanks.C", "operating.torque_nm=2"),
        ("ours_pair_strain.stiffness.C", "mesh.contact=linear"),
        ("ours_double_zone.coupled.2_101mm", "mesh.pair_coupling=sum"),
        ("ours_load_share.hertz.3_502mm", "mesh.pair_coupling=sum"),
        ("ours_crack.gamma_1_0mm.C", "mesh.crack=paper"),
        ("ours_pit.full_width_gap.1mm", "fault.pit_length_mm=1.2"),
        ("iso6336.single.c", "gear.clearance_coefficient=0.3"),
        ("line_modes.as_printed.mode_2", "system.viscous_damper_node=2"),
        ("wear_pressure.base_radius.C", "wear.load_radius=reference"),
        ("wear_per_mesh.band_wheel.A", "wear.wheel.hardness_hbs=190"),
        ("wear_per_mesh.fixed_intervals.50", "wear.rule=band"),
        ("wear_rate.both_flanks.band", "gear.wheel.n_teeth=56"),
        (
            "fluctuation_computed.flywheel.in_sequence",
            "excitation.cylinder.reciprocating_mass_kg=40",
        ),
    ],
)
def test_a_wrong_input_differs(row_id, word):
    row = row_of(row_id)
    assert evaluate(row).verdict == REPRODUCED
    key = word.partition("=")[0]
    others = tuple(old for old in row.overrides if not old.startswith(f"{key}="))
    assert evaluate(replace(row, overrides=(*others, word))).verdict == DIFFERS


def test_a_claim_can_fail():
    row = row_of("missing.large_impact.one_sided")
    assert evaluate(row).verdict == HOLDS
    healthy = tuple(word for word in row.overrides if not word.startswith("fault"))
    result = evaluate(replace(row, overrides=healthy))
    assert result.verdict == FAILS
    assert not result.as_expected


def test_tolerance_is_relative_but_never_finer_than_the_printed_digits():
    row = replace(
        row_of("table_2_2.pinion_axial.A"), printed="0.08", unit="", tolerance=0.001
    )
    assert judge(row, 0.0849).verdict == REPRODUCED
    assert judge(row, 0.0851).verdict == DIFFERS
    row = replace(row, printed="200.00")
    assert judge(row, 200.19).verdict == REPRODUCED
    assert judge(row, 200.21).verdict == DIFFERS
    assert judge(replace(row, printed="", tolerance=None), 1.0).verdict == NOT_PRINTED
    assert half_last_digit("3.509e-3") == pytest.approx(5e-7)
    assert half_last_digit("690") == pytest.approx(0.5)


def test_mistakes_are_answered():
    row = row_of("table_2_2.pair_stiffness.C")
    with refused("no quantity 'single_pair'"):
        evaluate(replace(row, quantity="single_pair"))
    with refused("no validation source 'spur'"):
        run_validation(["spur"])
    with refused("has no row 'table_9'"):
        printed_value("spur_reference", "table_9")
    for wrong in (
        {"unit": "furlong"},
        {"kind": "rumour"},
        {"tolerance": None},
        {"expected": "fine"},
    ):
        with refused(row.id):
            replace(row, **wrong)
