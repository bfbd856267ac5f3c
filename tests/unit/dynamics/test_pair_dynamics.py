"""Static start, settling, what the integrator refuses, and what a run tells of itself."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from lane_tools import laws
from numpy.testing import assert_allclose

from gensig.dynamics.integrator import (
    MOST_BYTES,
    CoarseStepWarning,
    Solver,
    check_memory,
    check_step,
    integrate,
    settling_time,
)
from gensig.dynamics.pair import Support, solid_disc
from gensig.errors import ConfigError, SimulationError
from gensig.faults.broken import MissingTooth
from gensig.systems.run import Start


def run(system, dynamics, **changes):
    values = {
        "sampling_rate": 51200.0,
        "duration": system.operating.duration,
        "channels": ("pinion_y",),
    }
    values.update(changes)
    return integrate([dynamics], values.pop("solver", system.solver), **values)


@pytest.mark.parametrize("phase", [0.0, 0.4, 0.9])
def test_static_start_is_in_equilibrium_along_the_line_of_action(
    xiamen, dynamics_of, phase
):
    dynamics = dynamics_of(xiamen, phase=phase)
    q, direction = dynamics.static_start(0.0), dynamics.approach_direction()
    force = laws(dynamics, [(dynamics.start_roll, q @ direction, 0.0, 0.0)])[0, 0]
    assert_allclose(force, dynamics.mesh_force, rtol=1e-6, atol=0)
    system = dynamics.system()
    assert_allclose(
        system.stiffness[[1, 4], [1, 4]] * q[[1, 4]], [force, -force], rtol=1e-6, atol=0
    )


def test_reduced_values(xiamen, dynamics_of):
    dynamics = dynamics_of(xiamen)
    assert_allclose(
        dynamics.mesh_force, 925.37, rtol=1e-5, atol=0
    )  # spur reference (docs/validation.md), section 3.4
    assert_allclose(dynamics.mesh_frequency, 690.0, rtol=1e-12, atol=0)
    inverse = 21.61293e-3**2 / 4.858e-5 + 78.93418e-3**2 / 3.509e-3
    assert_allclose(dynamics.equivalent_mass, 1 / inverse, rtol=1e-5, atol=0)


def test_mean_mesh_stiffness_ignores_the_faulty_tooth(xiamen, dynamics_of):
    sound, faulty = (
        dynamics_of(xiamen, faults)
        for faults in ((), (MissingTooth(gear="pinion", tooth=3),))
    )
    assert_allclose(
        faulty.mean_mesh_stiffness, sound.mean_mesh_stiffness, rtol=1e-9, atol=0
    )
    assert 2e8 < sound.mean_mesh_stiffness < 3e8


def test_friction_torque_is_a_per_cent_loss(xiamen, dynamics_of, machine):
    torque = dynamics_of(xiamen).friction_torque()
    assert 0.003 < torque / xiamen.operating.torque < 0.02
    assert_allclose(
        dynamics_of(machine({"mesh.friction_coefficient": 0.1})).friction_torque(),
        2 * torque,
        rtol=1e-9,
        atol=0,
    )


def test_the_system_is_not_driven_on_balance(xiamen, dynamics_of):
    """Load and drive differ by the mean friction torque only."""
    force, dynamics = dynamics_of(xiamen).system().force, dynamics_of(xiamen)
    assert_allclose(
        force[2] + force[5] / xiamen.pair.ratio,
        dynamics.friction_torque(),
        rtol=1e-9,
        atol=0,
    )


def test_settling_time_follows_the_slowest_motion_and_is_capped(machine, dynamics_of):
    assert 0.4 < settling_time(dynamics_of(machine())) < 0.45
    slow = {"operating.drive_frequency_hz": 1}
    assert_allclose(settling_time(dynamics_of(machine(slow))), 0.45, rtol=1e-12, atol=0)
    quick = {"operating.drive_frequency_hz": 20, "gear.pinion.support.damping_x_ns_per_m": 100,
             "gear.wheel.support.damping_x_ns_per_m": 500}  # fmt: skip
    assert settling_time(dynamics_of(machine(quick))) < 0.2


class TestRefusals:
    def test_unknown_channels_list_the_known(self, xiamen, dynamics_of):
        with pytest.raises(
            ConfigError,
            match=r"no channel housing; allowed: pinion_x, pinion_y, pinion_rotation",
        ):
            run(xiamen, dynamics_of(xiamen), channels=("housing",))

    def test_a_step_too_long(self, xiamen, dynamics_of):
        with pytest.raises(
            SimulationError, match=r"raise solver.oversampling to at least \d+$"
        ):
            run(
                xiamen,
                dynamics_of(xiamen),
                sampling_rate=6e3,
                solver=Solver(oversampling=2, precision="float64"),
            )

    @pytest.mark.filterwarnings("ignore::gensig.dynamics.integrator.CoarseStepWarning")
    @pytest.mark.parametrize(
        ("rate", "oversampling"), [(6e3, 2), (6e3, 3), (1e3, 2), (1e3, 17), (10.0, 2)]
    )
    def test_the_step_that_it_names_is_the_longest_that_will_do(
        self, xiamen, dynamics_of, rate, oversampling
    ):
        dynamics = dynamics_of(xiamen)
        with pytest.raises(SimulationError) as caught:
            check_step(dynamics, rate, oversampling)
        text = str(caught.value)
        assert text.startswith(
            f"solver.oversampling = {oversampling} makes internal steps of "
        )
        assert "\n" not in text
        enough = int(re.search(r"to at least (\d+)$", text)[1])
        check_step(dynamics, rate, enough)
        with pytest.raises(SimulationError, match=f"to at least {enough}$"):
            check_step(dynamics, rate, enough - 1)

    def test_a_coarse_step_is_warned_of_where_nothing_looks_at_its_error(
        self, xiamen, dynamics_of, recwarn
    ):
        dynamics, rate = dynamics_of(xiamen), 51200.0
        with pytest.warns(
            CoarseStepWarning,
            match=r"internal steps to a period of the mesh mode .* raise solver",
        ) as seen:
            check_step(dynamics, rate, 2)
        enough = int(
            re.search(r"solver.oversampling to (\d+)", str(seen[0].message))[1]
        )
        with pytest.warns(CoarseStepWarning):
            check_step(dynamics, rate, enough - 1)
        recwarn.clear()
        check_step(dynamics, rate, enough)
        check_step(dynamics, rate, 2, max_error=1e-3)
        assert not recwarn.list

    @pytest.mark.parametrize(("precision", "lanes"), [("float64", 8), ("float32", 16)])
    def test_more_than_fits_into_memory(self, precision, lanes):
        """The duration that it names fits, a longer one does not."""
        solver = Solver(oversampling=5, precision=precision)
        with pytest.raises(ConfigError) as caught:
            check_memory(1e4, 51200.0, 4, solver)
        text = str(caught.value)
        assert text.startswith(
            f"operating.duration_s = 10000: {lanes} records side by side with 4 channels at 51200 Hz"
        )
        longest = float(re.search(r"at most (.+) s at a time$", text)[1])
        assert_allclose(
            longest, MOST_BYTES / (51200 * 4 * 8 * lanes), rtol=5e-3, atol=0
        )
        check_memory(0.99 * longest, 51200.0, 4, solver)
        with pytest.raises(ConfigError, match="record at most"):
            check_memory(1.01 * longest, 51200.0, 4, solver)

    def test_a_machine_checks_its_memory_and_its_step(self, machine):
        machine().check()
        with pytest.raises(ConfigError, match="side by side with 4 channels"):
            machine({"operating.duration_s": 2000.0}).check()
        with pytest.raises(
            SimulationError, match=r"solver\.oversampling = 2 makes internal steps of"
        ):
            machine(
                {"solver.oversampling": 2, "sensing.sampling_rate_hz": 6000}
            ).check()

    def test_a_duration_without_samples(self, machine, dynamics_of):
        system = machine({"operating.duration_s": 1e-6})
        with pytest.raises(
            ConfigError, match=re.escape("operating.duration_s = 1e-06 holds no sample")
        ):
            run(system, dynamics_of(system))

    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            ({"oversampling": 0}, "solver.oversampling = 0 must lie in 2..256"),
            ({"oversampling": 257}, "solver.oversampling = 257 must lie in 2..256"),
            (
                {"precision": "float16"},
                "solver.precision = 'float16'; allowed: float64, float32",
            ),
            (
                {"max_error": 0.0},
                "solver.max_error = 0 must lie in 1e-6..1, or be null",
            ),
        ],
    )
    def test_solvers(self, changes, text):
        with pytest.raises(ConfigError, match=re.escape(text)):
            Solver(**{"oversampling": 8, "precision": "float64", **changes})

    @pytest.mark.parametrize(
        ("key", "unit"), [("stiffness_x", "n_per_m"), ("damping_y", "ns_per_m")]
    )
    def test_supports_name_the_key_as_typed(self, xiamen, key, unit):
        with pytest.raises(
            ConfigError, match=f"{key}_{unit} = -1 must not be negative"
        ):
            replace(xiamen.pinion.support, **{key: -1.0})

    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            ({"speed": 0.0}, "operating.speed_rpm = 0 must be positive"),
            ({"torque": -5.0}, "operating.torque_nm = -5 must be positive"),
            ({"duration": -1.0}, "operating.duration_s = -1 must be positive"),
            (
                {"drive_damping_ratio": 0.0},
                "operating.drive_damping_ratio = 0 must lie in 0..10",
            ),
        ],
    )
    def test_operating_points(self, xiamen, changes, text):
        with pytest.raises(ConfigError, match=re.escape(text)):
            replace(xiamen.operating, **changes)


def test_solid_disc():
    mass, inertia = solid_disc(0.1, 0.0, 0.02, 7800.0)
    assert_allclose(
        [mass, inertia],
        [7800 * math.pi * 2e-4, 0.5 * 7800 * math.pi * 2e-4 * 0.01],
        rtol=1e-12,
        atol=0,
    )
    assert Support(
        stiffness_x=1.0, stiffness_y=1.0, damping_x=0.0, damping_y=0.0
    ).damping_x == pytest.approx(0.0)


class TestRecord:
    @pytest.fixture(scope="class")
    @classmethod
    def short(cls, machine):
        return machine({"operating.duration_s": 0.05})

    def test_same_run_same_bits(self, short):
        one, two = (short.simulate().acceleration for _ in range(2))
        assert one.shape == (4, 2560)
        assert one.tobytes() == two.tobytes()

    def test_the_start_phase_moves_the_signal(self, short):
        """Half a mesh period later by phase is half a mesh period later in time."""
        period = 51200 / 690
        one = short.simulate().acceleration[1]
        two = short.simulate(
            start=Start(tooth_pinion=0, tooth_wheel=0, phase=0.5)
        ).acceleration[1]
        samples = np.arange(200, 400)
        shifted = np.interp(samples + 1.5 * period, np.arange(2560), one)
        assert np.corrcoef(shifted, two[samples + round(period)])[0, 1] > 0.8
        assert np.corrcoef(one[samples], two[samples])[0, 1] < 0.6

    def test_contact_is_lost_only_where_the_load_is_too_light(self, machine):
        tooth = (MissingTooth(gear="pinion", tooth=3),)
        light, rated = (
            machine({"operating.torque_nm": torque, "operating.duration_s": 0.1})
            .simulate(tooth)
            .contact_loss_fraction
            for torque in (2, 20)
        )
        assert light > 0
        assert rated < light

    @pytest.mark.parametrize("law", ["one_sided", "paper"])
    def test_a_missing_tooth_jolts_once_a_turn(self, machine, law):
        coupling = "coupled" if law == "one_sided" else "sum"
        system = machine({"mesh.law": law, "mesh.pair_coupling": coupling, "operating.speed_rpm": 1500,
                          "operating.duration_s": 4 * 2048 / 51200})  # fmt: skip
        signal = system.simulate((MissingTooth(gear="pinion", tooth=3),)).acceleration[
            1
        ]
        turns = np.abs(signal.reshape(4, 2048))
        peaks = turns.argmax(axis=1)
        assert np.ptp(peaks) <= 3
        assert turns.max() > 2 * np.abs(system.simulate().acceleration[1]).max()

    def test_the_reference_rise_of_a_missing_tooth(self, machine):
        """Spur reference (docs/validation.md), table 5.2, "gap" rows: the same law elsewhere, pairs not coupled."""
        terms = {
            "contact": "linear",
            "elasticity": "plane_stress",
            "body": "sainsot",
            "tooth": "to_contact",
        }
        own = {f"mesh.{key}": value for key, value in terms.items()}
        system = machine(
            {**own, "mesh.pair_coupling": "sum", "operating.duration_s": 0.3}
        )
        healthy, missing = (
            system.simulate(faults).acceleration[1]
            for faults in ((), (MissingTooth(gear="pinion", tooth=3),))
        )
        assert_allclose(
            [healthy.std(), missing.std()], [158.2, 183.9], rtol=0.05, atol=0
        )
        assert_allclose(
            np.abs(missing).max() / np.abs(healthy).max(), 2404 / 694, rtol=0.15, atol=0
        )
