"""Names of the gears of a drive line, their speeds and their home meshes."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from closeness import assert_close

from gensig import load_system
from gensig.driveline.drive_line import read_drive_line
from gensig.driveline.line_gears import gear_names, line_bodies, pinion_turns, slug
from gensig.driveline.machine_checks import FAR_ABOVE, warn_of_supports
from gensig.plan.request import read_request
from gensig.systems.base import further_gears, home_meshes


@pytest.fixture(scope="module")
def drive():
    return read_drive_line(read_request(["system=two_stage_gearbox"]).config)


def test_a_line_is_built_once_for_equal_tables(drive):
    """A data set reads it for every condition; other materials make another."""
    config = read_request(["system=two_stage_gearbox"]).config
    assert read_drive_line(config) is drive
    lighter = read_drive_line(config.with_values({"material.density_kg_per_m3": 7000}))
    assert lighter.line.nodes != drive.line.nodes


def named(drive, *names):
    gears = tuple(
        replace(gear, name=name)
        for gear, name in zip(drive.line.gears, names, strict=True)
    )
    return replace(drive, line=replace(drive.line, gears=gears))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Idler gear 2", "idler_gear_2"),
        ("Fresh-water pump gear", "fresh_water_pump_gear"),
        ("  Z1 / (Ritzel) ", "z1_ritzel"),
        ("Zahnräder", "zahnr_der"),
        ("歯車", ""),
    ],
)
def test_slugs_have_lower_case_letters_digits_and_underscores(name, expected):
    assert slug(name) == expected


def test_the_followed_mesh_names_its_gears_and_the_table_the_others(drive):
    assert gear_names(drive, 0) == ("pinion", "wheel", "idler_gear_2", "output_gear")
    assert gear_names(drive, 1) == ("input_pinion", "idler_gear_1", "pinion", "wheel")


def test_every_gear_has_a_name_of_its_own(drive):
    same = named(drive, "a", "b", "Gear", "gear")
    assert gear_names(same, 0) == ("pinion", "wheel", "gear", "gear_gear_4")
    sides = named(drive, "a", "b", "Pinion", "歯車")
    assert gear_names(sides, 0) == ("pinion", "wheel", "pinion_gear_3", "gear_4")


def test_turns_follow_the_shafts(drive):
    assert_close(list(pinion_turns(drive, 0).values()), [1.0, 3.0, 3.0, 5.0], 1e-9)
    turns = pinion_turns(drive, 1)
    assert_close(turns["wheel"], 80 / 48, 1e-9)
    assert_close(turns["input_pinion"], 1 / 3, 1e-9)


def test_bodies_are_in_the_order_of_the_gears(drive):
    assert list(line_bodies(drive, 1))[:2] == ["pinion", "wheel"]


def test_a_gear_is_at_home_in_the_followed_mesh_or_in_its_first_one():
    words = ["experiment=engine_test_point", "system.record_mesh=[20,43]"]
    machine = load_system(*words)
    names = machine.engine.mesh_names
    homes = {
        gear: names[number] for gear, number in home_meshes(machine.meshes).items()
    }
    assert set(homes) == set(machine.gears)
    # driven in 19/20 before it drives in 20/43, which is followed here
    assert homes["pinion"] == "20/43"
    assert homes["idler_gear"] == "3/66"
    assert homes["lube_oil_pump_gear"] == "66/67"
    drives = {
        each.gear.name: each.drives
        for each in further_gears(machine.gears, machine.meshes)
    }
    assert set(drives) == set(machine.gears) - {"pinion", "wheel"}
    assert drives["crankshaft_gear"]
    assert not drives["idler_gear"]


def test_loads_far_above_those_of_the_supports_are_told():
    """The lighter rated gear of a mesh decides; the limit itself is not above it."""
    mesh = SimpleNamespace(driving=0, driven=1)
    drive = SimpleNamespace(
        name="a line",
        support_forces=(200.0, 100.0),
        line=SimpleNamespace(meshes=(mesh,)),
    )
    engine = SimpleNamespace(drive=drive, mesh_names=("a mesh",))
    limit = FAR_ABOVE * 100.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_supports(engine, np.array([limit]))
    with pytest.warns(UserWarning, match="a mesh 301 N for 100 N"):
        warn_of_supports(engine, np.array([-1.0 - limit]))
