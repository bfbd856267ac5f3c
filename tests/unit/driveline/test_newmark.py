"""Refusals of lines, courses, torques and solvers, each in one line, and runs that fail."""

import math
from dataclasses import replace

import numpy as np
import pytest
from line_tools import (
    bodies,
    chain,
    constant_torques,
    law_at,
    line_of,
    state_after,
    turning_mesh,
    two_gears,
    with_system,
)

from gensig.driveline.time.newmark import LineSolver, _rounded_above, integrate_line
from gensig.dynamics.equations import NONE
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.course import LineCourse, ShaftTorque, constant_speed
from gensig.errors import ConfigError, GensigError, SimulationError

SOLVER = LineSolver(sampling_rate=10240.0, oversampling=4, max_energy_residual=1e-3)


def refused(error: type[GensigError], message: str):
    return pytest.raises(error, match=f"(?s)^(?!.*\n).*{message}")


def run(line, torques=(), speed=10.0, **changes):
    return integrate_line(
        replace(line, nominal=constant_speed(speed), torques=tuple(torques)),
        changes.pop("solver", SOLVER),
        **{"duration": 0.01, "channels": [("speed", 0)], **changes},
    )


class TestLine:
    @pytest.mark.parametrize(
        ("changes", "error", "message"),
        [
            (
                {"mass": np.ones(3)},
                ConfigError,
                r"mass \(3,\) must be \(2,\)",
            ),
            (
                {"mass": np.array([1.0, 0.0])},
                SimulationError,
                "inertia of 'second' must be positive",
            ),
            (
                {"stiffness": np.array([[1.0, 2.0], [0.0, 1.0]])},
                SimulationError,
                "stiffness matrix is not symmetric",
            ),
            (
                {"damping": -np.eye(2)},
                SimulationError,
                "damping matrix would feed energy in",
            ),
            ({"stiffness": np.full((2, 2), np.nan)}, ConfigError, "all finite"),
            ({"rotation": np.ones(3)}, ConfigError, r"rotation \(3,\) must be \(2,\)"),
            (
                {"rotation": np.array([1.0, 0.51])},
                ConfigError,
                "mesh 'pair': nominal rotation closes it by -0.001",
            ),
            (
                {"rotation": np.zeros(2)},
                ConfigError,
                "its gear a must turn",
            ),
        ],
    )
    def test_refused(self, changes, error, message):
        with refused(error, message):
            with_system(two_gears(), **changes)

    def test_a_mesh_of_another_line(self):
        line = two_gears()
        touched = np.array([NONE, NONE, 0, NONE, NONE, 2])
        mesh = replace(line.system.meshes[0], touched=touched)
        with refused(
            ConfigError, r"degrees of freedom \[0, 2\], which must lie in 0..1"
        ):
            with_system(line, meshes=(mesh,))


class TestCourse:
    @pytest.mark.parametrize(
        ("time", "speed", "message"),
        [
            ([0.0, 0.0], [1.0, 1.0], "times of its knots must increase"),
            ([0.0, 1.0], [1.0], "must be alike"),
            ([0.0, 1.0], [1.0, -1.0], "must not be negative"),
            ([], [], "must be alike"),
        ],
    )
    def test_refused(self, time, speed, message):
        with refused(ConfigError, message):
            LineCourse(time=np.array(time), speed=np.array(speed))

    def test_angle_and_speed(self):
        course = LineCourse(time=np.array([-1.0, 1.0]), speed=np.array([10.0, 30.0]))
        angle, speed = course.over(np.array([-3.0, -1.0, 0.0, 0.5, 2.0]))
        assert speed == pytest.approx([10.0, 10.0, 20.0, 25.0, 30.0])
        assert angle == pytest.approx([-35.0, -15.0, 0.0, 11.25, 55.0])

    def test_a_set_point_that_changes_has_no_knots(self, dynamics_of, machine):
        line = dynamics_of(machine({"operating.speed_profile": [[0, 1], [1, 2]]}))
        with refused(ConfigError, "changes all the time; take solver.backend=nystroem"):
            integrate_line(line, SOLVER, duration=0.01, channels=[("speed", 0)])


class TestTorques:
    @pytest.mark.parametrize(
        ("torque", "message"),
        [
            (
                {"dof": 5, "table": np.ones(1)},
                r"degree of freedom 5 must lie in 0\.\.1",
            ),
            (
                {"dof": 0, "table": np.ones(4), "turned_by": -1},
                r"degree of freedom -1 must lie in 0\.\.1",
            ),
            (
                {"dof": 0, "table": np.ones(1), "factor": np.ones(3)},
                r"factor \(3,\) must be \(1,\)",
            ),
        ],
    )
    def test_refused_by_the_line(self, torque, message):
        with refused(ConfigError, message):
            run(two_gears(), [ShaftTorque(**torque)])

    @pytest.mark.parametrize(
        ("torque", "message"),
        [
            ({"table": np.array([math.inf])}, "finite numbers"),
            ({"table": np.empty(0)}, "finite numbers"),
            ({"table": np.ones(4), "period": 0.0}, "period 0 rad must be positive"),
            (
                {"table": np.ones(4), "factor": np.array([math.nan])},
                "factors must be finite",
            ),
        ],
    )
    def test_refused(self, torque, message):
        with refused(ConfigError, message):
            ShaftTorque(dof=0, **torque)

    def test_an_angle_that_does_not_turn(self):
        line = with_system(chain(2), rotation=np.array([1.0, 0.0]))
        with refused(
            ConfigError,
            "torque on 'disc_1': a table over the angle of 'disc_1' needs a degree of freedom that",
        ):
            run(line, [ShaftTorque(dof=1, table=np.ones(4))])

    def test_the_sense_is_that_of_rotation(self):
        """Discs that turn backwards move as the mirror image of those that turn forwards."""
        table = np.cos(np.arange(64) / 64 * 2 * np.pi) + 0.3 * np.sin(
            np.arange(64) / 32 * 2 * np.pi
        )
        torques, start = (ShaftTorque(dof=0, table=table),), (np.zeros(3), np.zeros(3))
        line = replace(chain(3), torques=torques, nominal=constant_speed(300.0))
        mirrored = with_system(line, rotation=-line.system.rotation)
        (q, *_), (q_1, *_) = (
            state_after(one, start, 0.02, 800) for one in (line, mirrored)
        )
        np.testing.assert_allclose(q_1, -q, rtol=1e-9, atol=0)


class TestRun:
    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"channels": []}, "no channel to give out"),
            (
                {"channels": [("speed", 2)]},
                r"no channel \('speed', 2\); allowed: .* of 0\.\.1",
            ),
            ({"channels": [("mesh_force", 1)]}, r"of 0\.\.0"),
            ({"channels": [("power", 0)]}, "no channel"),
            ({"duration": 0.0}, "hold no sample"),
            ({"lead_in": -1.0}, "or no start"),
            (
                {"start": (np.zeros(3), np.zeros(3))},
                r"start must be finite deviations and rates, \(2,\)",
            ),
        ],
    )
    def test_refused(self, changes, message):
        with refused(ConfigError, message):
            run(two_gears(), **changes)

    @pytest.mark.parametrize(
        "changes",
        [
            {"sampling_rate": 0.0},
            {"oversampling": 1},
            {"oversampling": 1000},
            {"max_energy_residual": 0.0},
        ],
    )
    def test_solver(self, changes):
        with refused(ConfigError, "line solver"):
            replace(SOLVER, **changes)

    def test_a_step_longer_than_a_tooth(self):
        with refused(SimulationError, "mesh 'pair' rolls .* pitches in a step"):
            run(two_gears(), speed=5e4)

    def test_energies_that_do_not_balance(self):
        """Elastic impacts in steps that are a third of what the contact lasts."""
        start = np.zeros(2), np.array([4.0, -1.0])
        with refused(
            SimulationError,
            "the energy balance misses .* more than 0.001; raise the oversampling above 2",
        ):
            run(
                two_gears(backlash=1e-4),
                start=start,
                solver=replace(SOLVER, oversampling=2),
            )

    def test_divergence(self):
        """A free line under torques that nothing balances runs away."""
        with refused(SimulationError, "left all bounds"):
            run(
                two_gears(),
                constant_torques([1e9, 0.0]),
                start=(np.zeros(2), np.zeros(2)),
            )

    def test_infinite_motion_does_not_hang(self):
        with refused(SimulationError, "line: "):
            run(two_gears(), start=(np.zeros(2), np.array([1e300, 0.0])))

    def test_rest_of_a_free_line_is_in_its_own_acceleration(self):
        """Unbalanced torques accelerate the whole line; the mesh drives the second inertia."""
        line = two_gears(torques=constant_torques([10.0, 0.0]))
        q = line.static_start(0.0)
        reduced = 0.01 + 0.05 * 0.5**2
        force = 10.0 / reduced * 0.5 * 0.05 / 0.1
        approach = line.system.meshes[0].approach(q)
        assert approach == pytest.approx(force / 3e8, rel=1e-6)

    def test_rest_on_a_drive_as_soft_as_a_tenth_of_a_hertz(self):
        """The drive's spring carries what is not balanced."""
        spring = (0.01 + 0.05 * 0.5**2) * (2 * math.pi * 0.1) ** 2
        torques = constant_torques([1e-3, 0.0])
        q = two_gears(drive=(spring, 0.0), torques=torques).static_start(0.0)
        assert q[0] == pytest.approx(1e-3 / spring, rel=1e-6)

    def test_a_ring_that_a_damper_alone_holds_rests_where_it_is(self):
        line = chain(3)
        stiffness = np.diag([1e3, 0.0, 0.0])
        damping = 0.1 * np.array([[0.0, 0, 0], [0, 1, -1], [0, -1, 1]])
        stiffness[:2, :2] += 1e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        held = with_system(line, stiffness=stiffness, damping=damping)
        q = replace(held, torques=constant_torques([0.0, 5.0, 0.0])).static_start(0.0)
        assert q == pytest.approx([5e-3, 5.5e-3, 0.0], rel=1e-6, abs=1e-12)
        pushed = replace(held, torques=constant_torques([0.0, 0.0, 5.0]))
        with refused(SimulationError, "its mean torques \\(disc_2\\)"):
            pushed.static_start(0.0)

    def test_rest_of_an_unloaded_line_is_where_it_is(self):
        assert np.abs(two_gears(backlash=1e-4).static_start(0.0)).max() < 1e-13

    def test_what_drives_backwards_rests_on_the_back_flanks(self):
        torques = constant_torques([-10.0, 20.0])
        line = two_gears(backlash=1e-4, torques=torques)
        mesh = replace(line.system.meshes[0], mean_force=-200.0)
        q = with_system(line, meshes=(mesh,)).static_start(0.0)
        assert line.system.meshes[0].approach(q) == pytest.approx(
            -1e-4 - 10.0 / 0.05 / 3e8, rel=1e-6
        )


@pytest.mark.parametrize("torque", [-60.0, 60.0])
def test_teeth_rest_where_their_law_carries_the_torque(xiamen, torque):
    """On the drive flanks with the errors of the teeth, on the back flanks without."""
    counts = xiamen.pair.pinion.n_teeth, xiamen.pair.wheel.n_teeth
    rng = np.random.default_rng(4)
    errors = tuple(rng.normal(0.0, 2e-6, n) for n in counts)
    teeth = replace(MeshTeeth.perfect(xiamen.mesh_table()), errors=errors)
    radius = xiamen.pair.pinion.base_radius
    mesh = replace(turning_mesh(teeth), mean_force=torque / radius)
    nothing, rotation = np.zeros((2, 2)), np.array([1.0, counts[0] / counts[1]])
    line = line_of(
        bodies(np.ones(2), nothing, nothing, rotation, [mesh]),
        torques=constant_torques(torque * np.array([1.0, -counts[1] / counts[0]])),
        reference_force=np.array([abs(torque) / radius]),
    )
    q = line.static_start(0.0)
    force = law_at(mesh, q[0] * radius / xiamen.pair.base_pitch, mesh.approach(q))[0]
    assert force == pytest.approx(torque / radius, rel=1e-4)


@pytest.mark.parametrize(
    ("missed", "message"),
    [
        (0.0123456, "0.0123"),
        (1.0004e-3, "0.0010004"),
        (float("nan"), "nan"),
        (1e-3, "0.001"),
    ],
)
def test_a_residual_just_above_what_is_allowed_reads_above_it(missed, message):
    assert _rounded_above(missed, 1e-3) == message
