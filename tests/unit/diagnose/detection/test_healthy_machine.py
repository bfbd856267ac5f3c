"""A machine by its healthy recordings: what is called changed, and where."""

from dataclasses import replace

import numpy as np
import pytest
from fake_gearbox import SPEED, STAGES, Box, Fault, housing

from diagnose.detection.healthy_machine import HealthyMachine
from gensig.errors import ConfigError

FAULTS = [
    Fault(shaft=0, n_teeth=32, tooth=11),
    Fault(shaft=1, n_teeth=80, tooth=33),
    Fault(shaft=2, n_teeth=64, tooth=50),
]


@pytest.fixture(scope="module")
def machine():
    """Four healthy sessions."""
    recordings = [Box().record(session) for session in range(4)]
    return HealthyMachine.fit(recordings, STAGES, SPEED)


@pytest.mark.parametrize("session", [10, 11, 12, 13])
def test_another_healthy_session_is_healthy(machine, session):
    finding = machine.judge(Box().record(session))
    assert not finding.is_changed
    assert finding.kind == "healthy"
    assert finding.place is None
    assert finding.handbook.state == "healthy"


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_on_its_shaft_and_tooth(machine, fault):
    finding = machine.judge(Box().record(20, fault=fault))
    assert finding.is_changed
    assert finding.blocks_beyond > finding.n_blocks / 2
    assert finding.place.shaft == STAGES.shafts[fault.shaft]
    first = Box().first_tooth(20, fault.shaft, fault.n_teeth)
    gears = STAGES.gears(fault.shaft)
    name = next(gear.name for gear in gears if gear.n_teeth == fault.n_teeth)
    off = (dict(finding.place.teeth)[name] - (fault.tooth - first)) % fault.n_teeth
    assert min(off, fault.n_teeth - off) <= 2


def test_the_score_grows_with_the_fault(machine):
    sizes = (0.0, 3.0, 6.0, 12.0)
    scores = [
        machine.judge(Box().record(21, fault=replace(FAULTS[1], size=size))).score
        for size in sizes
    ]
    assert np.all(np.diff(scores) > 0.0)


def test_one_healthy_recording_works_and_says_what_it_cannot_promise():
    machine = HealthyMachine.fit([Box().record(0)], STAGES, SPEED)
    healthy = machine.judge(Box().record(10))
    assert not healthy.is_changed
    assert "one session alone" in healthy.notes[0]
    assert machine.judge(Box().record(20, fault=FAULTS[0])).is_changed


def test_a_remounted_sensor_looks_changed_until_mountings_are_shown(machine):
    new = housing(3)
    finding = machine.judge(Box().record(10, path=new))
    assert finding.is_changed
    taught = HealthyMachine.fit(
        [Box().record(session) for session in range(3)],
        STAGES,
        SPEED,
        mounting=[Box().record(30 + n, path=housing(10 + n)) for n in range(4)],
    )
    # a recording of a new mounting is like the mountings, not like those mounted as before
    assert taught.with_levels.threshold.n_held_back == 4
    assert taught.judge(Box().record(10, path=new)).score < 0.5 * finding.score
    assert not taught.judge(Box().record(10, path=new)).is_changed


def test_a_louder_sensor_changes_levels_alone(machine):
    finding = machine.judge(Box().record(10, gain=3.0))
    assert finding.is_changed
    assert finding.is_level_alone
    assert finding.handbook.state == "many_teeth"
    assert finding.level_db == pytest.approx(20.0 * np.log10(3.0), abs=0.5)
    assert any("mounted anew" in note for note in finding.notes)
    quiet = machine.judge(Box().record(10, gain=3.0), other_load=True)
    assert not quiet.is_changed
    assert any("other load" in note for note in quiet.notes)


def test_another_speed_leaves_levels_out(machine):
    finding = machine.judge(Box().record(10, speed_rpm=1.1 * SPEED), 1.1 * SPEED)
    assert not finding.is_changed
    assert any("from the nearest healthy recording" in note for note in finding.notes)
    assert {change.group for change in finding.changes} == {"teeth", "impulses"}


def test_a_short_recording_is_judged_in_one_block(machine):
    finding = machine.judge(Box().record(20, seconds=1.2, fault=FAULTS[1]))
    assert finding.n_blocks >= 1
    assert finding.is_changed


def test_other_rates_channels_and_levels_are_refused(machine):
    with pytest.raises(
        ConfigError, match="6000 samples a second, healthy recording 1 5000"
    ):
        machine.judge(Box().record(10, rate=6000.0))
    other = replace(Box().record(10), sensors=("lid",))
    with pytest.raises(ConfigError, match=r"has the channels lid, .* case"):
        machine.judge(other)
    mixed = [Box().record(0), Box().record(1, gain=9.8)]
    with pytest.raises(ConfigError, match=r"times the level of healthy recording 1"):
        HealthyMachine.fit(mixed, STAGES, SPEED)


def test_one_healthy_recording_needs_two_blocks():
    with pytest.raises(ConfigError, match="holds no two time blocks"):
        HealthyMachine.fit([Box().record(0, seconds=0.7)], STAGES, SPEED)


def test_two_runs_give_the_same_bits():
    def finding():
        machine = HealthyMachine.fit([Box().record(0), Box().record(1)], STAGES, SPEED)
        return machine.judge(Box().record(20, fault=FAULTS[0]))

    assert finding() == finding()
