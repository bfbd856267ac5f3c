"""What sensors of a drive line feel: names that move no motion, lead-ins of all meshes, shaft
angles that agree with the teeth, and the linear line's answer to nuisances.
"""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from closeness import assert_close
from line_tools import IMPLICIT

from gensig import load_system
from gensig.driveline.line_gears import gear_dof
from gensig.driveline.mesh_phase import start_phases
from gensig.driveline.running import Governor, running_line, steady_course
from gensig.driveline.time.newmark import LineSolver
from gensig.dynamics.motion.course import LineCourse, ShaftTorque
from gensig.dynamics.response import GEAR_AXES
from gensig.systems.lead_in import earlier, simulate_with_lead_in
from gensig.systems.run import Run, Start

TURN = 2.0 * math.pi
MOTOR = ("experiment=two_stage", "operating.duration_s=0.2", *IMPLICIT)
ENGINE = ("experiment=engine_broken_tooth", "operating.duration_s=0.05")
BEARINGS = "sensing.channels=[pinion_y,wheel_y,idler_gear_2_y,output_gear_rotation]"
UCONN = "system=uconn_two_stage"  # its second mesh does not come back with the first
FILTERED = "sensing.sensor.low_cutoff_hz=5"
RATE = 10240.0


@lru_cache(maxsize=8)
def machine(*words):
    return load_system(*words)


def unfiltered(system):
    return replace(system, sensing=replace(system.sensing, sensor=None))


def rolls(line, time=0.0):
    """Pitches that every mesh has rolled at a time, (mesh,)."""
    system = line.dynamics.system
    angle = line.dynamics.nominal.at(time).angle
    return np.array(
        [
            mesh.teeth.start_phase
            + mesh.teeth.pair.pinion.n_teeth * system.rotation[mesh.turn] * angle / TURN
            for mesh in system.meshes
        ]
    )


def off_by(pitches):
    """Distance from a whole number."""
    return np.abs(pitches - np.round(pitches))


def test_names_follow_the_recorded_mesh_and_the_motion_does_not():
    """The same perfect line from the same position, recorded by either of its meshes."""
    one = machine(*MOTOR, BEARINGS)
    other = machine(
        *MOTOR,
        "system.record_mesh=[5,6]",
        "sensing.channels=[input_pinion_y,idler_gear_1_y,pinion_y,wheel_rotation]",
    )
    start = Start(tooth_pinion=5, tooth_wheel=7, phase=0.3)
    turned = one.crank_angle(start)
    phase = start_phases(other.engine.drive, turned)[other.mesh_number]
    same = Start(phase=phase, line_angle=turned)
    here, there = (
        system.simulate(start=begin).acceleration
        for system, begin in ((one, start), (other, same))
    )
    scale = here.std(axis=1)
    assert scale.min() > 0.1
    assert np.all(np.std(here - there, axis=1) < 1e-6 * scale)
    late = other.simulate(start=replace(same, line_angle=turned + 0.1)).acceleration
    # which moves the first stage, and what belongs to it
    assert np.all(np.std(here - late, axis=1)[:2] > 0.1 * scale[:2])


@pytest.mark.parametrize(
    "words",
    [
        (*MOTOR, UCONN, BEARINGS, FILTERED),
        (*MOTOR, UCONN, BEARINGS, FILTERED, "operating=ramp"),
        (*ENGINE, FILTERED, "system.record_mesh=[19,20]"),
    ],
)
def test_a_lead_in_turns_every_mesh_back(words):
    system = machine(*words)
    start = Start(tooth_pinion=30, tooth_wheel=17, phase=0.3)
    run = Run(system=system, start=start)
    led = earlier(run)
    lead = system.sensing.n_lead / system.sensing.sampling_rate
    assert lead > 0.09
    line, before = system.line(run), led.system.line(led)
    on = rolls(before, lead) - rolls(line)
    assert off_by(on).max() < 1e-6
    followed = system.mesh_number
    here, there = (each.dynamics.teeth[followed] for each in (line, before))
    counts = [gear.n_teeth for gear in here.pair.gears.values()]
    teeth = zip(here.start_teeth, there.start_teeth, counts, strict=True)
    assert [(first + round(on[followed]) - now) % n for now, first, n in teeth] == [
        0,
        0,
    ]
    # teeth alone would leave the other meshes of the line elsewhere
    alone = replace(led, start=replace(led.start, line_angle=None))
    if UCONN in words:
        wrong = rolls(led.system.line(alone), lead) - rolls(line)
        assert off_by(wrong).max() > 0.01


def test_a_record_without_its_lead_in_is_the_record():
    system = machine(*MOTOR, BEARINGS, FILTERED)
    start = Start(tooth_pinion=5, tooth_wheel=17, phase=0.3)
    run = Run(system=system, start=start)
    (led,) = simulate_with_lead_in([run])
    (plain,) = simulate_with_lead_in([replace(run, system=unfiltered(system))])
    kept = led.acceleration[:, system.sensing.n_lead :]
    assert kept.shape == plain.acceleration.shape
    scale = plain.acceleration.std(axis=1)
    assert np.all(np.std(kept - plain.acceleration, axis=1) < 2e-3 * scale)
    assert np.abs(led.shaft_angle - plain.shaft_angle).max() < 1e-4
    assert_close(led.mean_speed, plain.mean_speed, 1e-6)


def test_the_angle_of_every_gear_says_where_its_teeth_are():
    """Other records of a gearbox begin elsewhere; a mark on a shaft stays at one tooth."""
    system = machine(*MOTOR, BEARINGS)
    places = []
    for start in (Start(), Start(tooth_pinion=5, tooth_wheel=17, phase=0.3)):
        line = system.line(Run(system=system, start=start))
        pitches = rolls(line)[1]
        (angle,) = system.gear_angle("idler_gear_2", start, np.zeros(1))
        (driven,) = system.gear_angle("output_gear", start, np.zeros(1))
        places.append([pitches - 48 * angle / TURN, pitches - 80 * driven / TURN])
    assert off_by(np.diff(places, axis=0)).max() < 1e-6
    shaft = system.operating.speed * np.arange(10.0)
    for gear, ratio in (
        ("wheel", 32 / 96),
        ("idler_gear_2", 32 / 96),
        ("output_gear", 0.2),
    ):
        angle = system.gear_angle(gear, Start(), shaft)
        assert_close(np.diff(angle), ratio * np.diff(shaft), 1e-9)


def linear(system):
    return system.linear_machine(Run(system=system))


def test_a_toothed_wheel_answers_with_the_speed_of_its_shaft():
    errors = "eccentricity_error_deg: 0, tooth_error_deg: 0, clock_frequency_hz: 1e8"
    wheel = f"excitation.toothed_wheels={{input: {{node: 3, n_teeth: 60, {errors}}}}}"
    answering = linear(
        machine(*MOTOR, wheel, "sensing.channels=[pinion_y,input_speed]")
    )
    w = np.array([300.0, -900.0])
    force = np.array([[0.0, 0.0, 1.0], [3.0, 2.0, 1.0j]], dtype=complex)
    channels = ["input_speed", "pinion_rotation"]
    speed, acceleration = answering.accelerations("wheel", w, force, channels).T
    assert np.abs(acceleration).min() > 0.0
    assert_close(1j * w * speed, acceleration, 1e-9)


def test_shafts_of_the_line_have_its_speeds_and_torques():
    shafts = {
        gear: linear(machine(*MOTOR, "operating.torque_nm=60")).shaft(gear)
        for gear in ("pinion", "wheel", "idler_gear_2", "output_gear")
    }
    assert [s.speed_ratio for s in shafts.values()] == pytest.approx(
        [1.0, 1 / 3, 1 / 3, 0.2]
    )
    assert [s.torque for s in shafts.values()] == pytest.approx(
        [60.0, 180.0, 180.0, 300.0], rel=1e-6
    )
    assert [s.drives for s in shafts.values()] == [True, False, True, False]
    assert [s.sense for s in shafts.values()] == [1.0, -1.0, -1.0, 1.0]


def test_a_gear_turns_from_its_x_to_its_y_by_its_sense():
    """The frame of a gear in two meshes, from the approaches that its motion makes in both."""
    system = machine(*ENGINE, "system.lateral=true", "sensing.channels=[pinion_y]")
    drive = system.engine.drive
    directions = drive.matrices(merge_rigid=True).directions
    first = directions.shape[1] - 2 * len(drive.line.gears)
    checked = 0
    for number, name in enumerate(system.engine.drive.line.gears):
        columns = [first + 2 * number, first + 2 * number + 1]
        pushes, rows = [], []
        for row, mesh in zip(directions, drive.line.meshes, strict=True):
            if number in (mesh.driving, mesh.driven):
                node = drive.line.gears[mesh.driving].node
                sense = math.copysign(1.0, drive.line.speed_ratio[node])
                angle = mesh.center_line + sense * (0.5 * math.pi - mesh.pressure_angle)
                sign = 1.0 if number == mesh.driving else -1.0
                pushes.append(sign * np.array([math.cos(angle), math.sin(angle)]))
                rows.append(row[columns])
        if len(rows) < 2 or abs(np.linalg.det(pushes[:2])) < 1e-3:
            continue
        # approach = push . (x e_x + y e_y)
        axes = np.linalg.solve(np.array(pushes[:2]), np.array(rows[:2]))
        assert_close(np.linalg.det(axes), 1.0, 1e-9)
        checked += 1
        assert name.node is not None
    assert checked >= 2


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("gear", ["pinion", "output_gear"])
def test_nuisances_answer_as_the_line_in_time_does(gear, axis):
    """A small harmonic force on one gear, integrated, less the same line without it."""
    system = machine(*MOTOR, BEARINGS, "operating.torque_nm=60")
    answering = linear(system)
    speed = system.operating.speed
    held = running_line(
        system.engine,
        steady_course(speed, 60.0),
        governor=Governor(frequency=1.0, damping_ratio=0.7),
    )
    w = TURN * 430.0
    time = np.arange(-0.6, 0.4, 1.0 / 81920.0)
    wave = np.cos(w * time)
    course = LineCourse(time=time, speed=np.full(len(time), speed))
    dof = gear_dof(held, system.mesh_number, f"{gear}_{GEAR_AXES[axis]}")
    size = (20.0, 20.0, 0.5)[axis]
    dynamics = held.dynamics
    steady = [replace(t, factor=np.ones(len(time))) for t in dynamics.torques]
    push = ShaftTorque(dof=dof, table=np.array([size]), factor=wave)
    solver = LineSolver(sampling_rate=RATE, oversampling=16, max_energy_residual=1.0)
    names = [f"{gear}_x", "pinion_y", "wheel_rotation", "idler_gear_2_y"]
    channels = [("acceleration", gear_dof(held, system.mesh_number, n)) for n in names]

    def moved(*more):
        moving = replace(dynamics, nominal=course, torques=(*steady, *more))
        line = replace(held, dynamics=moving)
        motion = line.run(solver, duration=0.2, channels=channels, settling=0.5)
        return np.array([motion.signals[channel] for channel in channels])

    difference = moved(push) - moved()
    at = np.arange(difference.shape[1]) / RATE
    waves = np.stack([np.cos(w * at), -np.sin(w * at)], axis=1)
    parts = np.linalg.lstsq(waves, difference.T, rcond=None)[0]
    force = np.zeros((1, 3), dtype=complex)
    force[0, axis] = size
    expected = answering.accelerations(gear, np.array([w]), force, names)[0]
    assert np.all(
        np.abs(parts[0] + 1j * parts[1] - expected) < 0.02 * np.abs(expected).max()
    )
