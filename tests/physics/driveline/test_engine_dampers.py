"""Dampers on the engine's pump drive: tooth force and root stress before and after."""

import numpy as np
import pytest
from closeness import assert_close
from engine_cases import SPEED, TORQUE
from numpy.testing import assert_allclose
from refusals import refused

from gensig.driveline.engine_dampers import (
    ToothLoad,
    dynamic_root_stress,
    mesh_between,
    read_mesh_strength,
    response_for_dampers,
    tooth_load,
    with_further_dampers,
)
from gensig.driveline.engine_line import read_engine_line
from gensig.driveline.linear.dampers import TorsionalDamper
from gensig.options.compose import compose

ENGINE = ("system=engine_gear_train", "excitation=engine_v20")
DAMPERS = (
    TorsionalDamper(
        node=21,
        ring_inertia=0.0118,
        damping=0.45,
        stiffness=172700.0,
    ),
    TorsionalDamper(
        node=45,
        ring_inertia=0.01138,
        damping=6.0,
        stiffness=143500.0,
    ),
)
AS_KEYS = (
    "system.dampers=[{node: 21, ring_inertia_kg_m2: 0.0118, damping_nms_per_rad: "
    "0.45, stiffness_nm_per_rad: 172700},"
    "{node: 45, ring_inertia_kg_m2: 0.01138, damping_nms_per_rad: 6.0, "
    "stiffness_nm_per_rad: 143500}]"
)


@pytest.fixture(scope="module")
def config():
    return compose("generate", ENGINE)


@pytest.fixture(scope="module")
def line(config):
    return read_engine_line(config)


@pytest.fixture(scope="module")
def load(line):
    return tooth_load(
        line,
        mesh_between(line, (45, 21)),
        line.response(SPEED, TORQUE),
    )


def test_dampers_of_the_configuration_are_those_added_and_those_tuned_with(line):
    damped = with_further_dampers(line, DAMPERS)
    read = read_engine_line(compose("generate", (*ENGINE, AS_KEYS)))
    assert read.drive.numbers == damped.drive.numbers == (*range(1, 68), 68, 69)
    assert read.ratios[68] == read.ratios[21] == 0.5

    mesh = mesh_between(line, (21, 45))
    forces = [
        tooth_load(one, mesh, one.response(SPEED, TORQUE)).force
        for one in (damped, read)
    ]
    assert_allclose(*forces, rtol=1e-9, atol=1e-6)

    seen = response_for_dampers(line, mesh, (21, 45), [SPEED], TORQUE)
    assert_close(
        seen.largest_force(DAMPERS, n_points=5760),
        np.abs(forces[0]).max(),
        1e-6,
    )


def test_root_stress_follows_the_tooth_force(config, line, load):
    mesh = mesh_between(line, (21, 45))
    strength = read_mesh_strength(config, line, mesh)
    computed = dynamic_root_stress(strength, line, mesh, load)

    # ISO: F_t Y_F Y_S / (b m), engine reference, section 4: 2.498 at 20 mm and 3 mm
    assert_close(
        computed.gears["wheel"].stress,
        load.greatest * np.cos(np.radians(20.0)) * 2.498 / 6e-5,
        1e-3,
    )

    for name, stress in computed.passes.items():
        assert (
            stress.shape[0] == 54
        )  # 54 teeth meet in a cycle, which is one turn of the pump
        assert np.all(stress <= computed.history.stress[name] * (1.0 + 1e-12))
        assert stress.max() > 0.8 * computed.history.stress[name].max()
    steady = ToothLoad(speed=SPEED, force=np.full(5760, load.greatest))
    same = dynamic_root_stress(strength, line, mesh, steady)
    for name, stress in same.passes.items():
        assert_close(
            stress,
            np.tile(same.history.stress[name], (54, 1)),
            1e-12,
        )


def test_dampers_on_the_pump_drive_lower_the_load_there_and_leave_the_flywheel(
    line, load
):
    damped = with_further_dampers(line, DAMPERS)
    mesh = mesh_between(line, (21, 45))
    response = damped.response(SPEED, TORQUE)

    assert tooth_load(damped, mesh, response).largest < 0.75 * load.largest
    assert_close(
        response.fluctuation()[13],
        line.response(SPEED, TORQUE).fluctuation()[13],
        0.02,
    )

    worse = with_further_dampers(
        line,
        (
            TorsionalDamper(
                node=45,
                ring_inertia=0.1,
                damping=0.0,
                stiffness=1e9,
            ),
        ),
    )
    assert (
        tooth_load(worse, mesh, worse.response(SPEED, TORQUE)).largest > load.largest
    )  # a locked ring: inertia alone


def test_a_force_that_never_closes_the_mesh_is_refused(config, line):
    mesh = mesh_between(line, (21, 45))
    strength = read_mesh_strength(config, line, mesh)
    load = ToothLoad(speed=SPEED, force=np.full(8, -1.0))

    with refused("its force never closes the driving flanks"):
        dynamic_root_stress(strength, line, mesh, load)
