"""Static start, settling, refusals of the integrator, and properties of records."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from core_runs import MISSING, QUICK
from lane_tools import laws
from refusals import given, refused

from gensig.dynamics.integrator import (
    MOST_BYTES,
    CoarseStepWarning,
    Solver,
    check_machine,
    check_memory,
    integrate,
)
from gensig.dynamics.pair import solid_disc
from gensig.errors import ConfigError, SimulationError

RATE = 51200.0


def check_step(running, rate, steps, max_error=None):
    """Raise or warn as an integration with so many steps a sample would."""
    solver = Solver(oversampling=steps, precision="float64", max_error=max_error)
    check_machine(running.dynamics, solver, rate)


def recorded(system, running, **changes):
    values = {
        "sampling_rate": RATE,
        "duration": 0.1,
        "channels": ("pinion_y",),
        **changes,
    }
    return integrate(
        [running.dynamics],
        values.pop("solver", system.solver),
        **values,
    )


@pytest.mark.parametrize("phase", [0.0, 0.4, 0.9])
def test_static_start_is_in_equilibrium(xiamen, running_of, phase):
    running = running_of(xiamen, phase=phase)
    q = running.dynamics.static_start(0.0)
    stiffness = running.equations.governed_stiffness
    approach = q @ running.approach_direction()
    force = laws(running, [(running.teeth.start_roll, approach, 0.0, 0.0)])[0, 0]

    assert_close(force, running.mesh_force, 1e-6)
    assert_close(
        stiffness[[1, 4], [1, 4]] * q[[1, 4]],
        [force, -force],
        1e-6,
    )


def test_reduced_values(xiamen, running_of):
    running = running_of(xiamen)
    # spur reference (docs/validation.md), section 3.4
    assert_close(running.mesh_force, 925.37, 1e-5)
    assert_close(running.mesh_frequency, 690.0, 1e-12)

    inverse = 21.61293e-3**2 / 4.858e-5 + 78.93418e-3**2 / 3.509e-3
    assert_close(running.equivalent_mass, 1 / inverse, 1e-5)

    faulty = running_of(xiamen, MISSING).mean_mesh_stiffness
    assert_close(faulty, running.mean_mesh_stiffness, 1e-9)
    assert_close(
        faulty,
        xiamen.stiffness_curves().mesh_stiffness.mean(),
        1e-3,
    )


def test_friction_torque_is_the_imbalance_of_drive_and_load(
    xiamen, running_of, machine
):
    running = running_of(xiamen)
    torque = running.friction_torque()
    force = running.dynamics.forces(np.zeros(1))[0]
    # Niemann & Winter: loss factor of a constant load over the path of contact
    pair = xiamen.pair
    pitch = xiamen.pair.base_pitch
    recess = (pair.path_of_contact - pair.pitch_point) / pitch
    shares = (
        1 - pair.path_of_contact / pitch + recess**2 + (pair.pitch_point / pitch) ** 2
    )
    loss = 0.05 * math.pi * (1 / 23 + 1 / 84) * shares

    assert_close(torque / xiamen.operating.torque, loss, 0.01)

    rough = running_of(machine({"mesh.friction_coefficient": 0.1}))
    assert_close(rough.friction_torque(), 2 * torque, 1e-9)
    assert_close(force[2] + force[5] / xiamen.pair.ratio, torque, 1e-9)


def test_settling_follows_the_slowest_motion_up_to_a_limit(machine, running_of):
    decay = math.log(1e4) / (2 * math.pi * 0.7)
    for changes, expected in (
        ({}, decay / 5),
        ({"operating.drive_frequency_hz": 1}, 0.45),
        (QUICK, decay / 20),
    ):
        assert_close(
            running_of(machine(changes)).dynamics.settling_time,
            expected,
            1e-3,
        )


def test_solid_disc():
    mass, inertia = solid_disc(0.1, 0.0, 0.02, 7800.0)
    assert_close(mass, 7800 * math.pi * 2e-4, 1e-12)
    assert_close(inertia, 0.5 * mass * 0.01, 1e-12)


class TestRefusals:
    @pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
    @pytest.mark.parametrize(
        ("rate", "steps"),
        [(6e3, 2), (6e3, 3), (1e3, 17), (300.0, 2)],
    )
    def test_an_unstable_step_names_the_longest_stable_one(
        self, xiamen, running_of, rate, steps
    ):
        running = running_of(xiamen)
        with pytest.raises(SimulationError) as caught:
            check_step(running, rate, steps)

        text = str(caught.value)
        assert text.startswith(
            f"solver.oversampling = {steps} makes internal steps of "
        )
        assert "\n" not in text

        enough = int(re.search(r"to at least (\d+)$", text)[1])
        check_step(running, rate, enough)
        with pytest.raises(SimulationError, match=f"to at least {enough}$"):
            check_step(running, rate, enough - 1)

    def test_a_coarse_step_without_a_check_warns(self, xiamen, running_of, recwarn):
        running = running_of(xiamen)
        text = r"internal steps to a period of the mesh mode .* raise solver"
        with pytest.warns(CoarseStepWarning, match=text) as warned:
            check_step(running, RATE, 2)
        result = re.search(
            r"solver.oversampling to (\d+)",
            str(warned[0].message),
        )
        enough = int(result[1])
        with pytest.warns(CoarseStepWarning):
            check_step(running, RATE, enough - 1)
        recwarn.clear()
        check_step(running, RATE, enough)
        check_step(running, RATE, 2, max_error=1e-3)

        assert not recwarn.list

    @pytest.mark.parametrize(
        ("precision", "lanes"),
        [("float64", 8), ("float32", 16)],
    )
    def test_a_record_beyond_memory_names_the_longest(self, precision, lanes):
        solver = Solver(oversampling=5, precision=precision)
        with pytest.raises(ConfigError) as caught:
            check_memory(1e4, RATE, 4, solver)

        text = str(caught.value)
        assert text.startswith(
            f"operating.duration_s = 10000: {lanes} records side by side with 4 channels at "
            "51200 Hz"
        )

        longest = float(re.search(r"at most (.+) s at a time$", text)[1])
        assert_close(longest, MOST_BYTES / (51200 * 4 * 8 * lanes), 5e-3)

        check_memory(0.99 * longest, RATE, 4, solver)
        with refused("record at most"):
            check_memory(1.01 * longest, RATE, 4, solver)

    def test_a_machine_checks_memory_and_step(self, machine):
        machine().check()
        with refused("side by side with 4 channels"):
            machine({"operating.duration_s": 2000.0}).check()

        coarse = {
            "solver.oversampling": 2,
            "sensing.sampling_rate_hz": 6000,
        }
        with refused("= 2 makes internal steps of", SimulationError):
            machine({**coarse, "solver.max_error": None}).check()
        machine(coarse).check()  # with an error to check, shorter steps are tried
        coarse["gear.pinion.support.stiffness_y_n_per_m"] = 1e14
        with refused("= 64 makes internal steps of", SimulationError):
            machine(coarse).check()

    @pytest.mark.parametrize(
        ("key", "value", "motion"),
        [
            ("gear.pinion.support.stiffness_y_n_per_m", 1e14, "pinion_y"),
            ("gear.wheel.support.damping_x_ns_per_m", 1e9, "wheel_x"),
            ("gear.wheel.inertia_kg_m2", 1e-12, "wheel_rotation"),
        ],
    )
    def test_what_steps_cannot_follow_is_named(self, machine, key, value, motion):
        text = rf"stiffest motion, {motion} at .* or check mass, stiffness and damping of {motion}$"
        with pytest.raises(SimulationError, match=text):
            machine({key: value}).check()

    def test_its_frequency_is_told_in_hz(self, machine, xiamen, running_of):
        running = running_of(xiamen)
        place = running.dofs.index("pinion_y")
        stiffness, mass = 1e14, running.equations.mass[place]
        with pytest.raises(SimulationError) as refused:
            machine({"gear.pinion.support.stiffness_y_n_per_m": stiffness}).check()
        (told,) = re.findall(r"pinion_y at (\S+) Hz", str(refused.value))
        natural = math.sqrt(stiffness / mass) / (2 * math.pi)
        assert float(told) == pytest.approx(natural, rel=1e-2)

    def test_integrations(self, xiamen, running_of):
        running = running_of(xiamen)
        for changes, text in (
            (
                {"channels": ("housing",)},
                "no channel housing; allowed: pinion_x, pinion_y",
            ),
            (
                {"duration": 1e-6},
                "operating.duration_s = 1e-06 holds no sample",
            ),
        ):
            with refused(text):
                recorded(xiamen, running, **changes)

    @pytest.mark.parametrize(
        ("change", "text"),
        {
            "solver.oversampling=0": "solver.oversampling = 0 must lie in 2..256",
            "solver.oversampling=257": "solver.oversampling = 257 must lie in 2..256",
            "solver.precision='float16'": "'float16'; allowed: float64, float32",
            "solver.max_error=0.0": "= 0 must lie in 1e-6..1, or be null",
            "support.stiffness_x=-1.0": "stiffness_x_n_per_m = -1 must not be negative",
            "support.damping_y=-1.0": "damping_y_ns_per_m = -1 must not be negative",
            "operating.speed=0.0": "operating.speed_rpm = 0 must be positive",
            "operating.torque=-5.0": "operating.torque_nm = -5 must be positive",
            "operating.duration=-1.0": "operating.duration_s = -1 must be positive",
            "operating.drive_damping_ratio=0.0": "drive_damping_ratio = 0 must lie in",
        }.items(),
    )
    def test_options(self, xiamen, change, text):
        ((place, value),) = given(change).items()
        part, key = place.split(".")
        holder = xiamen.pinion if part == "support" else xiamen
        with refused(text):
            replace(getattr(holder, part), **{key: value})


class TestRecord:
    def test_the_reference_rise_of_a_missing_tooth(self, machine):
        """Spur reference (docs/validation.md), table 5.2, "gap" rows: pairs not coupled."""
        system = machine(
            {
                "mesh.contact": "linear",
                "mesh.elasticity": "plane_stress",
                "mesh.body": "sainsot",
                "mesh.tooth": "to_contact",
                "mesh.pair_coupling": "sum",
                "operating.duration_s": 0.3,
            }
        )
        healthy, missing = (
            system.simulate(faults).acceleration[1] for faults in ((), MISSING)
        )
        assert_close(
            [healthy.std(), missing.std()],
            [158.2, 183.9],
            0.03,
        )

        rise = np.abs(missing).max() / np.abs(healthy).max()
        assert_close(rise, 2404 / 694, 0.04)
