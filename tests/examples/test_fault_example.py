"""The worked example of a new fault goes the whole way of a fault, from its file to a plan."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from examples import fault_example
from examples.fault_example import Notch
from fault_cases import side_of
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.errors import FaultError
from gensig.faults.base import faulty_teeth
from gensig.faults.registry import FAULTS, read_faults
from gensig.geometry.tooth import healthy_tooth
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.systems.pair_machine import severity

FILE = Path(fault_example.__file__).with_name("notch.yaml")
OPTION = yaml.safe_load(FILE.read_text(encoding="utf-8"))


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    """The line in the registry."""
    monkeypatch.setitem(FAULTS, Notch.kind, Notch)


@pytest.fixture
def folder(tmp_path):
    """The option in the place of ``configs``."""
    (tmp_path / "fault").mkdir()
    shutil.copy(FILE, tmp_path / "fault")
    return tmp_path


def notch(**changes):
    (fault,) = read_faults({**OPTION, **changes})
    return fault


def test_its_keys_are_read_with_their_units():
    expected = Notch(gear="pinion", tooth=0, notch_length=0.4e-3, notch_depth=0.1e-3)
    assert notch() == expected
    with refused("fault.notch_depth_mm = -1 must not be negative", FaultError):
        notch(notch_depth_mm=-1)
    with refused("unknown key 'notch_depht_mm'; did you mean"):
        notch(notch_depht_mm=1)


def test_the_tooth_loses_the_groove_and_nothing_else(xiamen):
    teeth = faulty_teeth(xiamen.pair, [notch(tooth=3)])
    assert set(teeth) == {("pinion", 3)}
    loss = teeth["pinion", 3].material_loss
    assert set(np.unique(loss)) == {0.0, 0.1e-3}
    sound = healthy_tooth(xiamen.pair.pinion)
    assert faulty_teeth(xiamen.pair, [notch(notch_depth_mm=0)])["pinion", 0] is sound


def test_the_mesh_has_a_gap_over_the_groove_and_nowhere_else(xiamen):
    """The mate bridges the groove: its gap is less than the depth."""
    table = xiamen.mesh_table([notch(tooth=3)])
    assert_array_equal(np.flatnonzero(table.pinion.kind), [3])
    assert not table.wheel.kind.any()
    gap = side_of(table, "pinion").gap[1] - side_of(table, "pinion").gap[0]
    pitch_point = xiamen.pair.pitch_point
    assert 1e-6 < np.interp(pitch_point, table.position, gap) < 0.1e-3
    assert not gap[np.abs(table.position - pitch_point) > 2e-3].any()


def test_its_severity_rises_with_its_length(xiamen):
    values = [
        severity([notch(notch_length_mm=length)], xiamen.gears)
        for length in (0.0, 0.2, 0.4)
    ]
    assert values[0] == pytest.approx(0.0, abs=0.0)
    assert 0.0 < values[1] < 1.0
    assert_allclose(values[2], 2.0 * values[1], rtol=1e-12)


def test_the_other_flank_does_not_feel_it():
    assert notch().on_other_flank() is None


def test_a_plan_draws_it(folder):
    words = ("fault=notch", "plan.n_records=6")
    columns = make_plan(read_request(words, config_dir=folder).config).columns
    length = np.asarray(columns["params/fault.notch_length_mm"])
    assert ((length >= 0.1 * 2.0) & (length <= 0.4 * 2.0)).all()
    assert (np.asarray(columns["severity"]) > 0.0).all()
    assert len(set(columns["fault_tooth"])) > 1


def test_a_life_of_it_is_refused_in_words(folder):
    words = ("experiment=run_to_failure", "plan.n_units=2", "plan.classes=[notch]")
    config = read_request(words, config_dir=folder).config
    with refused("nothing makes notch grow; this life has healthy, crack"):
        make_plan(config)
