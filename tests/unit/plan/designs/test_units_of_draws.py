"""Numbers that a plan can draw carry their unit in their key."""

from importlib.resources import files

import yaml

from gensig.options.configuration import FIXED_KEYS
from gensig.plan.request import read_request
from gensig.units import split_unit

# Keys of the configuration that are pure numbers; every other that can be drawn ends in its unit.
NUMBERS = {
    "pinion_heat_share",
    "poisson_ratio",
    "damping_ratio",
    "friction_coefficient",
    "friction_transition",
    "points_per_pitch",
    "oversampling",
    "max_error",
    "iso1328_grade",
    "used_share_low",
    "used_share_high",
    "tooth_share",
    "undulation_share",
    "undulation_waves",
    "run_in_share",
    "backlash_scatter",
    "support_stiffness_scatter",
    "support_damping_scatter",
    "drive_damping_ratio",
    "speed_tolerance",
    "gain_scatter",
    "fault_gain",
    "tooth",
    "pitted_share",
    "diameter_scatter",
    "depth_ratio",
    "region_low",
    "region_high",
    "pit_seed",
    "damage",
    "spalled_share",
    "spall_length_share",
    "spall_width_share",
    "dented_share",
    "n_dents",
    "damage_seed",
    "profile_waves",
    "sensitivity_tolerance",
    "transverse_sensitivity",
    "resonance_damping_ratio",
    "max_clipped_fraction",
    "dropped_fraction",
    "dropped_run_samples",
    "course_seed",
    "drift_scatter",
    "addendum_coefficient",
    "clearance_coefficient",
    "cutter_tip_radius_coefficient",
    "n_teeth",
    "profile_shift",
    "n_balls",
    "inner_groove_conformity",
    "outer_groove_conformity",
}


def numbers_in(tree, path=""):
    """Dotted keys of a configuration that hold a number."""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from numbers_in(value, f"{path}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{path}{key}"


def has_unit(key):
    leaf = key.rpartition(".")[2]
    return split_unit(leaf)[1] is not None or leaf.endswith(("_kg_per_m3", "_m_per_s2"))


def test_whatever_can_be_drawn_carries_its_unit():
    keys = [
        key
        for key in numbers_in(read_request([]).config.plain())
        if not key.startswith((*FIXED_KEYS, "classes.", "fault."))
    ]
    assert len(keys) > 15
    assert {key.rpartition(".")[2] for key in keys if not has_unit(key)} <= NUMBERS
    options = [
        file
        for file in (files("gensig.configs") / "fault").iterdir()
        if file.name.endswith(".yaml")
    ]
    assert len(options) > 10
    for file in options:
        fault = {
            key: value
            for key, value in yaml.safe_load(file.read_text()).items()
            if key != "vary"
        }
        assert {key for key in numbers_in(fault) if not has_unit(key)} <= NUMBERS
