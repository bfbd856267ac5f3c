"""Every combination of options runs, or one line says what to type instead."""

import functools
import itertools
from dataclasses import replace

import numpy as np
import pytest

import gensig
from gensig.errors import GensigError
from gensig.faults.registry import read_faults
from gensig.options import files
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.machines import read_machine

SHORTER = (
    "operating.duration_s=0.02",
    "mesh.n_slices=4",
    "mesh.points_per_pitch=64",
    "solver.max_error=null",
)
SHORT = ("plan.n_records=1", "plan.n_units=1", *SHORTER)
pytestmark = pytest.mark.filterwarnings("ignore:.*mean tooth forces:UserWarning")
TABLES = (
    "system.shafting_csv=two_stage_shafting.csv",
    "system.gears_csv=two_stage_gears.csv",
)
SYSTEMS = {option.name: () for option in files.options("system")}
SYSTEMS["shaft_line"] = TABLES  # it has no machine without tables
FAULTS = [option.name for option in files.options("fault")]
GEARS = {option.name: ("spur_pair", "helical_pair") for option in files.options("gear")}
GEARS |= dict.fromkeys(
    ("beihang_61_132", "chongqing_40_162", "phm09_16_48"), ("helical_pair",)
)
del GEARS["harbin_38_55"]  # its contact ratio is below 1
EXPERIMENTS = [option.name for option in files.options("experiment")]


def first_record(*words):
    """The first record that overrides describe, made alone."""
    return gensig.stream(*words)[0]


@functools.cache
def fault_as_given(name):
    """The faults of an option; several of a compound."""
    return read_faults(read_request([f"fault={name}"]).config["fault"])


def check_runs(*words):
    record = first_record(*words)
    assert record.values["status"] == "ok", record.values["status_reason"]
    assert np.isfinite(record.signals["acceleration"]).all()


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("system", SYSTEMS)
def test_every_fault_runs_on_every_system(system, fault):
    check_runs(f"system={system}", *SYSTEMS[system], f"fault={fault}", *SHORT)


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_plan_of_every_fault_on_any_gear_fits(system):
    """Drawn sizes fit the gear that they are drawn for: no severity above 1, and no refusal."""
    words = (f"plan.classes=[{','.join(FAULTS)}]", "plan.fault_gear=drawn", *SHORTER)
    counts = ("plan.n_records=30", "plan.n_units=2")
    config = read_request(
        [f"system={system}", *SYSTEMS[system], *counts, *words]
    ).config
    plan = make_plan(config)
    severity = np.array([plan.record(row)["severity"] for row in range(30)])
    assert severity.min() >= 0.0
    assert severity.max() <= 1.0


@pytest.mark.parametrize("gear", GEARS)
def test_every_gear_runs_with_its_system(gear):
    """Helical gears on a helical pair, spur gears on a spur pair and in slices too."""
    words = "fault=crack", "solver.oversampling=16", *SHORT
    for system in GEARS[gear]:
        check_runs(f"system={system}", f"gear={gear}", *words)


@pytest.mark.parametrize("gear", GEARS)
def test_faults_as_given_are_sensible_on_every_gear(gear):
    """Sizes of fault options are for modules of 1.3 to 6 mm: visible, and less than the tooth."""
    machine = read_machine(
        read_request([f"system={GEARS[gear][0]}", f"gear={gear}"]).config
    )
    if machine.pair.pinion.normal_module > 6e-3:
        return
    for name in FAULTS:
        for fault in fault_as_given(name):
            for side, sized in machine.gears.items():
                severity = replace(fault, gear=side).severity(sized)
                most = 1.0 if name == "missing_tooth" else 0.7
                assert 0.01 < severity <= most, (name, side)


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_every_experiment_runs(experiment):
    """With its own plan: the first of its records, made short."""
    check_runs(f"experiment={experiment}", *SHORTER)


# What a record of either kind of machine can have besides; each is switched on and off.
SWITCHES = (
    "sensing.snr_db=null",
    "sensing.snr_reference=record",
    "sensing.gain_scatter=0",
    "sensing.sensor.dropped_fraction=0.01",
    "sensing.sensor.drift_scatter=0.1",
    "sensing.sensor.sensitivity_tolerance=0.1",
    "sensing.sensor.dc_offset_m_per_s2=0.1",
    "dataset.store_clean=true",
    "dataset.store_shaft_angle=true",
    "dataset.store_operating=true",
    "dataset.store_tacho=true",
    "dataset.store_encoder=true",
    "dataset.store_healthy_twin=true",
    "dataset.store_detectability=true",
    "dataset.sample_type=int16",
    "operating=drifting",
    "fault=crack",
    "quality.iso1328_grade=null",
    "sensing.sensor.mounted_resonance_hz=20000",
    "sensing.sensor.low_cutoff_hz=1",
    "dataset.store_source=true",
    "modification=tip_relief",
    "dataset.store_mesh_state=true",
    "heat=chongqing_rated",
)
# One switch is on in these of eight runs: every half of them that has the first. Any two switches
# then meet both on, both off, and either alone (Kleitman & Spencer 1973).
HALVES = [{0, *others} for others in itertools.combinations(range(1, 8), 3)]
SENSING = {
    "spur_pair": ("bearing", "housing", "machine"),
    "helical_pair": ("bearing", "housing", "machine"),
    "two_stage_gearbox": ("geared_line", "geared_line_housing", "geared_line_machine"),
    "engine_gear_train": ("shaft_line", "geared_line_housing"),
}


def covering_rows(switches):
    """Eight selections of switches that hold every pair of their states."""
    halves = dict(zip(switches, HALVES, strict=False))
    return [[word for word, runs in halves.items() if run in runs] for run in range(8)]


def test_covering_rows_hold_every_pair():
    rows = covering_rows(SWITCHES)
    for first, second in itertools.combinations(SWITCHES, 2):
        states = {(first in row, second in row) for row in rows}
        assert len(states) == 4, (first, second)


@pytest.mark.parametrize("row", range(8))
@pytest.mark.parametrize(
    ("system", "sensing"),
    [(system, option) for system, names in SENSING.items() for option in names],
)
def test_sensing_options_run_pairwise(system, sensing, row):
    words = covering_rows(SWITCHES)[row]
    check_runs(f"system={system}", f"sensing={sensing}", *SHORT, *words)


REFUSED = [
    ("spur_pair", ["gear=beihang_61_132"], "helical ones have system=helical_pair"),
    ("spur_pair", ["gear=harbin_38_55"], "contact ratio 0.9187 is below 1"),
    # system, overrides, words of the answer: the first says what, the last what to type
    ("shaft_line", ["system.shafting_csv=null"], "system.shafting_csv is required"),
    ("spur_pair", ["sensing=measured"], "give sensing.path.file="),
    ("spur_pair", ["sensing=shaft_line"], "no channel flywheel_speed"),
    ("spur_pair", ["heat=chongqing_rated", "mesh.law=paper"], "heat.growth=false"),
    ("spur_pair", ["excitation=engine_v20"], "leave excitation out"),
    ("spur_pair", ["sensing.sensor.adc_bits=16"], "give both adc_range_m_per_s2"),
    ("spur_pair", ["operating.turns=1"], "leave one out"),
    ("spur_pair", ["life=crack_growth"], "leave it null"),
    ("spur_pair", ["sensing.tacho.shaft=motor"], "allowed: pinion, wheel"),
    ("spur_pair", ["sensing.encoder.shaft=load"], "allowed: pinion, wheel"),
    (
        "spur_pair",
        ["sensing=machine", "sensing.nuisances.0.gear=ring"],
        "sensing.nuisances[0].gear = 'ring'; allowed: pinion, wheel",
    ),
    (
        "two_stage_gearbox",
        ["sensing.tacho.shaft=idler_gear"],
        "allowed: pinion, wheel, idler_gear_2, output_gear",
    ),
    (
        "two_stage_gearbox",
        ["sensing=geared_line_housing", "system.lateral=false"],
        "take system.lateral=true",
    ),
    (
        "two_stage_gearbox",
        [
            "sensing.channels=[pinion_rotation]",
            "sensing.nuisances=[{kind: looseness, gear: output_gear, n_orders: 3,"
            " force_share: [0.01, 0.01], half_share: [0, 0], harmonic_exponent: 1}]",
            "system.lateral=false",
        ],
        "sensing.nuisances push gears on their bearings",
    ),
    (
        "engine_gear_train",
        ["sensing=housing", "sensing.channels=[flywheel_speed]"],
        "flywheel_speed is no bearing",
    ),
    (
        "two_stage_gearbox",
        ["sensing.channels=[pinion_y]", "system.lateral=false"],
        "with system.lateral=true",
    ),
    (
        "two_stage_gearbox",
        ["solver.backend=newmark", "solver.precision=float32"],
        "solver.precision=float64",
    ),
    ("two_stage_gearbox", ["mesh.law=paper"], "take mesh.law=one_sided"),
    ("two_stage_gearbox", ["excitation=engine_v20"], "take excitation=motor_and_load"),
    ("engine_gear_train", ["excitation=motor_and_load"], "system.load_node = null"),
    ("two_stage_gearbox", ["system.supports=bearings"], "did you mean"),
]


@pytest.mark.parametrize(("system", "words", "answer"), REFUSED)
def test_what_cannot_be_says_what_to_type(system, words, answer):
    with pytest.raises(GensigError) as refusal:
        first_record(f"system={system}", *SYSTEMS[system], *SHORT, *words)
    text = str(refusal.value)
    assert answer in text
    assert "\n" not in text
