"""What a specimen's errors do to the quasi-static mesh: eccentricity, profile, misalignment, backlash."""

from dataclasses import replace

import numpy as np
import pytest
from fault_cases import GEARS, on_path, one
from numpy.testing import assert_allclose

from gensig.dynamics._layout import BACKLASH
from gensig.faults.flank_form import ProfileError
from gensig.mesh.load_distribution import static_mesh
from gensig.sensing.manufacturing import draw_specimen, perfect_specimen
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.run import Run

UM = 1e-6
SIZE = 6 * UM  # of an eccentricity


def eccentric(pair, name, most, *, smooth=True):
    """A set of gears of which one is eccentric, its tooth ``most`` standing back most, as manufacturing draws it."""
    gear = getattr(pair, name)
    turn = 2 * np.pi / gear.n_teeth * (np.arange(gear.n_teeth) - most)
    error, tilt = SIZE * np.cos(turn), -SIZE / gear.base_radius * np.sin(turn)
    perfect = perfect_specimen(pair.pinion, pair.wheel)
    return replace(
        perfect, **{f"{name}_error": error, f"{name}_tilt": tilt if smooth else 0.0}
    )


def rolls(system, n_pitches=84, per_pitch=40):
    return system.pair.base_pitch * (np.arange(n_pitches * per_pitch) + 0.5) / per_pitch


def transmission_error(system, specimen, faults=()):
    """Approach under the set torque over a turn of the wheel, (phase,) m: how far the wheel lags."""
    machine = pair_dynamics(Run(system=system, faults=faults, specimen=specimen))
    return static_mesh(
        machine.table, machine._states(rolls(system)), system.mesh_force
    ).approach


def late(system, specimen):
    """Transmission error of a specimen beyond that of perfect gears."""
    return transmission_error(system, specimen) - transmission_error(system, None)


@pytest.mark.parametrize("name", GEARS)
@pytest.mark.parametrize("most", [0, 7.3])
class TestEccentricity:
    def test_the_gear_turns_off_its_axis(self, xiamen, name, most):
        """The flank in contact stands back by e cos(rotation since the tooth that stands back most was at C)."""
        pair = xiamen.pair
        gear = getattr(pair, name)
        turned = (
            rolls(xiamen) - pair.pitch_point
        ) / gear.base_radius - 2 * np.pi / gear.n_teeth * most
        expected = SIZE * np.cos(turned)
        found = late(xiamen, eccentric(pair, name, most))
        assert_allclose(
            found, expected, rtol=0, atol=0.03 * SIZE
        )  # second order in the turn from C: 2.5 % at A

    def test_offsets_alone_step_from_tooth_to_tooth(self, xiamen, name, most):
        """Why the offsets of an eccentric gear grow along the path: else the mesh repeats what no gear does."""
        found = [
            late(xiamen, eccentric(xiamen.pair, name, most, smooth=smooth))
            for smooth in (True, False)
        ]
        steps = [np.abs(np.diff(values)).max() for values in found]
        turn = 1.0 / getattr(xiamen.pair, name).base_radius * np.diff(rolls(xiamen))[0]
        assert steps[0] < 2.5 * SIZE * turn
        assert steps[1] > 4 * SIZE * turn


@pytest.mark.parametrize("name", GEARS)
def test_an_eccentric_specimen_is_the_runout_fault(xiamen, name):
    """Side of either gear, sign and phase, against flanks that are moved node by node."""
    fault = one("runout", gear=name, tooth=5, eccentricity_um=SIZE / UM)
    found = transmission_error(xiamen, eccentric(xiamen.pair, name, 5))
    expected = transmission_error(xiamen, None, (fault,))
    assert_allclose(found, expected, rtol=0, atol=0.03 * SIZE)
    mirrored = transmission_error(xiamen, eccentric(xiamen.pair, name, -5))
    assert np.abs(mirrored - expected).max() > 0.3 * SIZE


class TestProfile:
    FORMS = (
        ProfileError(
            gear="pinion",
            tooth="all",
            profile_slope=3 * UM,
            profile_form=2 * UM,
            profile_waves=1,
            limit=1.0,
        ),
        ProfileError(
            gear="wheel",
            tooth="all",
            profile_slope=-4 * UM,
            profile_form=0.0,
            profile_waves=1,
            limit=1.0,
        ),
    )

    def deviation(self, pair, position):
        """How far both flanks stand back together at a position on the path, m."""
        back = 0.0
        for name, form in zip(GEARS, self.FORMS, strict=True):
            gear = getattr(pair, name)
            low, high = (
                gear.junction_curvature_radius,
                np.sqrt(gear.tip_radius**2 - gear.base_radius**2),
            )
            share = (np.asarray(getattr(pair, f"{name}_curvature")(position)) - low) / (
                high - low
            )
            wave = 0.5 * (1 - np.cos(2 * np.pi * form.profile_waves * share))
            back = back + form.profile_slope * (share - 0.5) + form.profile_form * wave
        return back

    def test_where_one_pair_carries_the_wheel_lags_by_the_deviation(self, xiamen):
        specimen = replace(
            perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel), forms=self.FORMS
        )
        pair, roll = xiamen.pair, rolls(xiamen)
        position = roll % pair.base_pitch
        alone = (position > pair.path_of_contact - 0.9 * pair.base_pitch) & (
            position < 0.9 * pair.base_pitch
        )
        assert alone.mean() > 0.09
        found = late(xiamen, specimen)[alone]
        assert_allclose(
            found, self.deviation(pair, position[alone]), rtol=0, atol=0.02 * UM
        )
        assert np.abs(found).max() > 0.5 * UM

    def test_the_tilt_of_the_teeth_is_a_profile_slope(self, xiamen):
        """The tooth-to-tooth part: a slope about the pitch point, the same on all teeth here."""
        pair = xiamen.pair
        for name, towards_tip in (("pinion", 1.0), ("wheel", -1.0)):
            gear = getattr(pair, name)
            involute = (
                np.sqrt(gear.tip_radius**2 - gear.base_radius**2)
                - gear.junction_curvature_radius
            )
            slope = 3 * UM
            form = ProfileError(
                gear=name,
                tooth="all",
                profile_slope=slope,
                profile_form=0.0,
                profile_waves=1,
                limit=1.0,
            )
            perfect = perfect_specimen(pair.pinion, pair.wheel)
            tilted = replace(
                perfect, **{f"{name}_tilt": towards_tip * slope / involute}
            )
            found, expected = (
                late(xiamen, tilted),
                late(xiamen, replace(perfect, forms=(form,))),
            )
            assert_allclose(
                found - found.mean(),
                expected - expected.mean(),
                rtol=0,
                atol=0.02 * slope,
            )
            assert np.ptp(expected) > 0.1 * slope

    def test_faults_come_on_top(self, xiamen):
        """A specimen's flank with a fault stands back by both, and its sound teeth by the specimen's form alone."""
        fault = one("pitch_error", tooth=4, pitch_error_um=12)
        tables = [
            xiamen.mesh_table(some) for some in (self.FORMS, (*self.FORMS, fault))
        ]
        assert_allclose(
            tables[1].pinion.gap[tables[1].pinion.kind[3]],
            tables[0].pinion.gap[1],
            rtol=0,
            atol=0,
        )
        further = (
            tables[1].pinion.gap[tables[1].pinion.kind[4]] - tables[0].pinion.gap[1]
        )
        assert_allclose(further[on_path(tables[0])], 12 * UM, rtol=1e-9, atol=0)

    def test_the_mesh_stiffness_that_damps_is_that_of_the_commonest_teeth(self, xiamen):
        """They carry the specimen's form, under which the second pair touches later: softer than perfect gears."""
        specimen = replace(
            perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel), forms=self.FORMS
        )
        sound, cracked, perfect = (
            pair_dynamics(
                Run(system=xiamen, faults=faults, specimen=some)
            ).mean_mesh_stiffness
            for some, faults in (
                (specimen, ()),
                (specimen, (one("crack"),)),
                (None, ()),
            )
        )
        assert_allclose(cracked, sound, rtol=1e-12, atol=0)
        assert 0.7 * perfect < sound < 0.98 * perfect


def test_drawn_backlash_asks_for_no_further_tables(xiamen):
    perfect = perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel)
    nominal, wider = (
        pair_dynamics(
            Run(
                system=xiamen,
                faults=(),
                specimen=replace(perfect, backlash_factor=factor),
            )
        )
        for factor in (1.0, 1.2)
    )
    assert wider.table.pinion is nominal.table.pinion
    rows = [
        machine.numbers(1e-6, machine.rest())[BACKLASH] for machine in (nominal, wider)
    ]
    assert_allclose(rows, [80 * UM, 96 * UM], rtol=1e-9, atol=0)


@pytest.mark.parametrize("misalignment", [-12.0, 12.0])
def test_misalignment_softens_the_mesh(machine, misalignment):
    system = machine()
    form = one(
        "misalignment",
        gear="pinion",
        tooth="all",
        misalignment_um=misalignment,
        limit_um=100,
    )
    perfect = perfect_specimen(system.pair.pinion, system.pair.wheel)
    stiffness = [
        pair_dynamics(
            Run(system=system, faults=(), specimen=replace(perfect, forms=forms))
        ).mean_mesh_stiffness
        for forms in ((), (form,))
    ]
    assert stiffness[1] < 0.98 * stiffness[0]


def test_the_mesh_state_knows_no_fault_of_a_sound_specimen(machine):
    """Every tooth of a graded gear differs from the nominal one; only the record's own faults engage."""
    system = machine({"operating.duration_s": 0.05})
    pair = system.pair
    specimen = draw_specimen(
        np.random.default_rng(1), pair.pinion, pair.wheel, system.quality
    )
    assert len(specimen.forms) == 2
    states = []
    for faults in ((), (one("pitch_error", tooth=3, pitch_error_um=5),)):
        (record,) = simulate_together(
            [Run(system=system, faults=faults, specimen=specimen, tell_mesh=True)]
        )
        states.append(record.mesh)
    assert not states[0].fault_engaged.any()
    assert 0.02 < states[1].fault_engaged.mean() < 0.2


def test_a_drawn_specimen_moves_the_motion_little_but_surely(machine):
    system = machine({"operating.duration_s": 0.1})
    pair = system.pair
    records = [
        system.simulate(specimen=specimen).acceleration
        for specimen in (
            None,
            draw_specimen(
                np.random.default_rng(3), pair.pinion, pair.wheel, system.quality
            ),
        )
    ]
    assert 0.02 < (records[1] - records[0]).std() / records[0].std() < 3.0
