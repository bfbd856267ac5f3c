"""Raised edges in records: louder with their height; surface damage on every kind of machine."""

import json

import numpy as np
import pytest
from record_sets import refused, run, simulated

from gensig.plan.request import read_request
from gensig.signals.indicators import kurtosis, rms

PINION_Y = 1
SMALL = (
    "plan.n_records=1",
    "operating.duration_s=0.2",
    "dataset.store_clean=true",
)
SMOOTH = ("fault.damage=1", "fault.roughness_um=0", "fault.dent_shoulder_um=0")
WHERE = {
    "pitting": ("fault.pit_edge_height_um", ("fault.pit_edge_width_mm=0.2",)),
    "surface_damage": ("fault.edge_height_um", SMOOTH),
}
FEW = ("fault.tooth=[0,1,2]", "fault.damage=1", "operating.duration_s=0.05")


def record(*overrides, sham=False):
    config = read_request([*SMALL, *overrides]).config
    return simulated(config, sham=sham)[0]


def along_the_line(*overrides, sham=False):
    """Clean acceleration of the pinion's bearing along the line of action, (sample,)."""
    return record(*overrides, sham=sham).signals["acceleration_clean"][PINION_Y]


@pytest.mark.parametrize("kind", WHERE)
def test_what_the_fault_adds_is_louder_with_the_height_of_its_edge(kind):
    key, others = WHERE[kind]
    words = [f"fault={kind}", *others]
    sound = along_the_line(*words, sham=True)
    heights = (0, 10, 30, 100)
    made = [along_the_line(*words, f"{key}={height}") for height in heights]
    levels = [rms(signal - sound) for signal in made]
    assert np.all(np.diff(levels) > 0.2 * levels[0])
    assert rms(made[-1]) > 1.2 * rms(sound)
    assert kurtosis(made[-1]) > 2 * kurtosis(sound)


def test_labels_of_surface_damage():
    values = record("fault=surface_damage", "fault.gear=wheel").values
    assert values["label_name"] == "surface_damage"
    assert (values["fault_gear"], values["fault_tooth"]) == ("wheel", -1)
    assert values["severity"] == values["params/fault.damage"] > 0.0
    (fault,) = json.loads(values["faults_json"])
    assert fault["damage_seed"] == values["params/fault.damage_seed"]


@pytest.mark.parametrize("machine", ["system=helical_pair", "system=two_stage_gearbox"])
def test_slices_and_drive_lines_take_it(machine):
    words = [machine, "fault=surface_damage", *FEW]
    damaged, sound = (record(*words, sham=sham).signals for sham in (False, True))
    difference = damaged["acceleration_clean"] - sound["acceleration_clean"]
    assert np.isfinite(difference).all()
    assert rms(difference).max() > 0.0


def test_independent_slices_and_lives_refuse_it(capsys):
    words = ["simulate", "system=helical_pair", "mesh.slice_coupling=independent"]
    line = refused(capsys, *words, "fault=surface_damage", *FEW)
    assert "mesh.slice_coupling=coupled" in line
    grown = ["plan", "experiment=run_to_failure", "fault=surface_damage"]
    assert "surface_damage" in refused(capsys, *grown)


def test_the_commands_take_it(capsys, tmp_path):
    for verb in ("simulate", "stiffness"):
        picture = tmp_path / f"{verb}.png"
        run(
            verb, "fault=surface_damage", "operating.duration_s=0.05", "--plot", picture
        )
        assert picture.read_bytes().startswith(b"\x89PNG")
    assert "faulty pair touches later" in capsys.readouterr().out
