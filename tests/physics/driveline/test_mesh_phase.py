"""Mesh phases of a line: flanks that touch, in every mesh, wherever the line has turned to."""

import math

import numpy as np
import pytest
from closeness import assert_close

from gensig.driveline.drive_line import read_drive_line
from gensig.driveline.mesh_phase import start_rolls, tooth_angles
from gensig.plan.request import read_request


@pytest.fixture(scope="module")
def config():
    return read_request(["system=shaft_line"]).config


@pytest.fixture
def train(config, tmp_path):
    """Gears in a chain, each on its own node; teeth, center lines in degrees, profile shifts."""

    def make(teeth, center_lines, shifts=None, driven_first=False):
        shifts = shifts or [0.0] * len(teeth)
        rows = [
            "node,inertia_kg_m2,stiffness_nm_per_rad,edge_from,edge_to,edge_kind,center_line_deg"
        ]
        rows += [
            f"{place + 1},1e-3,1e6,{place + 1},{place + 2},gear_mesh,{angle}"
            for place, angle in enumerate(center_lines)
        ]
        rows.append(f"{len(teeth)},1e-3,,,,,")
        if driven_first:  # the last gear is the first node
            rows[1:] = rows[:0:-1]
        gears = [
            "node,n_teeth,normal_module_mm,pressure_angle_deg,helix_angle_deg,"
            "face_width_mm,profile_shift"
        ]
        gears += [
            f"{place + 1},{z},2,20,0,20,{x}"
            for place, (z, x) in enumerate(zip(teeth, shifts, strict=True))
        ]
        for name, lines in (
            ("line.csv", rows),
            ("gears.csv", gears),
        ):
            (tmp_path / name).write_text("\n".join(lines), encoding="utf-8")
        files = {
            "shafting_csv": str(tmp_path / "line.csv"),
            "gears_csv": str(tmp_path / "gears.csv"),
        }
        return read_drive_line(config.with_keys("system", **files))

    return make


def misfit(line, turned=0.0):
    """Distance of the flanks along the line of action of every mesh, in base pitches, from the
    base circles alone.

    The driving flank stands rho_1 from its tangent point, the driven one rho_2 from its own;
    they touch where both add up to the distance of the tangent points, less whole pitches.
    """
    angles = tooth_angles(line, turned)
    computed = []
    for mesh, pair in zip(line.line.meshes, line.pairs, strict=True):
        sense = math.copysign(
            1.0,
            line.line.speed_ratio[line.line.gears[mesh.driving].node],
        )
        tilt = sense * pair.working_pressure_angle
        one = (
            angles[mesh.driving]
            + sense * pair.pinion.half_tooth_angle_base
            - (mesh.center_line - tilt)
        )
        other = (
            angles[mesh.driven]
            + sense * pair.wheel.half_tooth_angle_base
            - (mesh.center_line + math.pi - tilt)
        )
        reach = sense * (pair.pinion.base_radius * one + pair.wheel.base_radius * other)
        computed.append((reach - pair.tangent_length) / pair.base_pitch)
    return np.array(computed)


def from_whole(value):
    return np.abs(value - np.round(value))


TRAINS = [
    ((20, 33), (0.0,), None),
    ((21, 34, 27), (15.0, -70.0), None),
    (
        (20, 33, 24, 41),
        (200.0, 95.0, 10.0),
        (0.3, 0.1, -0.05, 0.2),
    ),
]


@pytest.mark.parametrize(("teeth", "center_lines", "shifts"), TRAINS)
@pytest.mark.parametrize("driven_first", [False, True])
@pytest.mark.parametrize("turned", [0.0, 0.37, -12.3])
def test_flanks_touch_in_every_mesh(
    train, teeth, center_lines, shifts, driven_first, turned
):
    gaps = misfit(train(teeth, center_lines, shifts, driven_first), turned)
    assert_close(from_whole(gaps), 0.0, atol=1e-9)
    assert np.all(from_whole(gaps + 0.01) > 0.005)


def test_the_engine_touches_everywhere_too():
    line = read_drive_line(read_request(["system=engine_gear_train"]).config)
    assert_close(from_whole(misfit(line, 1.0)), 0.0, atol=1e-9)
    assert (
        len(
            set(
                np.round(
                    start_rolls(line) / line.pairs[0].base_pitch,
                    3,
                )
            )
        )
        > 4
    )


@pytest.mark.parametrize(("z", "expected"), [(33, 0.0), (34, 0.5), (35, 0.0)])
def test_an_idler_between_two_gears_in_line(train, z, expected):
    """Half a pitch between its flanks, z / 2 between its sides: in phase for odd teeth, half off
    for even ones.
    """
    line = train((23, z, 29), (0.0, 0.0))
    pitch = line.pairs[0].base_pitch
    pitch_points = np.array([pair.pitch_point for pair in line.pairs])
    past = (start_rolls(line) - pitch_points) / pitch
    assert_close(
        from_whole(past[1] - past[0] - expected),
        0.0,
        atol=1e-9,
    )


def test_rolls_advance_as_the_meshing_frequencies_say(train):
    line = train(*TRAINS[2])
    pitch = np.array([pair.base_pitch for pair in line.pairs])
    gone = (start_rolls(line, 0.1) - start_rolls(line)) / pitch

    assert_close(
        from_whole(gone - 0.1 / (2.0 * math.pi) * np.array(line.mesh_orders)),
        0.0,
        atol=1e-9,
    )
    assert np.all(start_rolls(line, 0.1) >= 0.0)
    assert np.all(start_rolls(line, 0.1) < pitch)


def test_gears_on_one_shaft_have_a_tooth_at_one_angle():
    line = read_drive_line(read_request(["system=two_stage_gearbox"]).config)
    angles = dict(
        zip(
            (gear.name for gear in line.line.gears),
            tooth_angles(line),
            strict=True,
        )
    )
    assert angles["Input pinion"] == 0.0
    assert angles["Idler gear 1"] == angles["Idler gear 2"]
