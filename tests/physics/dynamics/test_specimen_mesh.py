"""Errors of a specimen in the quasi-static mesh: eccentricity, profile, misalignment, backlash."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import GEARS, one

from gensig.dynamics._layout import BACKLASH
from gensig.dynamics.lanes import mesh_numbers
from gensig.faults.flank_form import ProfileError
from gensig.sensing.manufacturing import draw_specimen, perfect_specimen
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run

UM = 1e-6
SIZE = 6 * UM  # of an eccentricity


@pytest.fixture(scope="module")
def perfect(xiamen):
    return perfect_specimen(xiamen.pair.pinion, xiamen.pair.wheel)


def eccentric(xiamen, perfect, name, most, *, smooth=True):
    """A specimen with an eccentric gear, whose tooth ``most`` has the largest recess."""
    gear = getattr(xiamen.pair, name)
    turn = 2 * np.pi / gear.n_teeth * (np.arange(gear.n_teeth) - most)
    tilt = -SIZE / gear.base_radius * np.sin(turn) * smooth
    return replace(
        perfect,
        **{
            f"{name}_error": SIZE * np.cos(turn),
            f"{name}_tilt": tilt,
        },
    )


def dynamics_with(system, specimen, faults=()):
    return running_pair(Run(system=system, faults=faults, specimen=specimen))


def rolls(system):
    """40 phases of every mesh period of a turn of the wheel, m."""
    return system.pair.base_pitch * (np.arange(84 * 40) + 0.5) / 40


def transmission_error(system, specimen, faults=()):
    """Approach under the set torque over a turn of the wheel, (phase,) m: lag of the wheel."""
    running = dynamics_with(system, specimen, faults)
    return running.teeth.static(
        running.teeth.states(rolls(system)), system.mesh_force
    ).approach


def late(system, specimen):
    """Transmission error of a specimen beyond that of perfect gears."""
    return transmission_error(system, specimen) - transmission_error(system, None)


@pytest.mark.parametrize("name", GEARS)
class TestEccentricity:
    @pytest.mark.parametrize("most", [0, 7.3])
    def test_the_gear_turns_off_its_axis(self, xiamen, perfect, name, most):
        """The flank recess is e cos(rotation since the tooth of the largest recess was at C)."""
        pair = xiamen.pair
        gear = getattr(xiamen.pair, name)
        turned = (rolls(xiamen) - pair.pitch_point) / gear.base_radius
        expected = SIZE * np.cos(turned - 2 * np.pi / gear.n_teeth * most)
        error = late(xiamen, eccentric(xiamen, perfect, name, most))

        assert_close(error, expected, atol=0.03 * SIZE)  # second order: 2.5 % at A

        # without the tilt of the offsets the error would step from tooth to tooth
        stepped = late(
            xiamen,
            eccentric(xiamen, perfect, name, most, smooth=False),
        )
        turn = np.diff(rolls(xiamen))[0] / gear.base_radius
        assert np.abs(np.diff(error)).max() < 2.5 * SIZE * turn
        assert np.abs(np.diff(stepped)).max() > 4 * SIZE * turn


def profile(gear, slope, form=0.0):
    shape = {
        "profile_slope": slope,
        "profile_form": form,
        "profile_waves": 1,
    }
    return ProfileError(gear=gear, tooth="all", limit=1.0, **shape)


class TestProfile:
    FORMS = (
        profile("pinion", 3 * UM, 2 * UM),
        profile("wheel", -4 * UM),
    )

    def involute(self, gear):
        """Least and greatest curvature radius of the flank, m."""
        return gear.junction_curvature_radius, np.sqrt(
            gear.tip_radius**2 - gear.base_radius**2
        )

    def deviation(self, pair, position):
        """Recess of both flanks together at a position on the path, m."""
        back = 0.0
        for name, form in zip(GEARS, self.FORMS, strict=True):
            low, high = self.involute(getattr(pair, name))
            curvature = np.asarray(getattr(pair, f"{name}_curvature")(position))
            share = (curvature - low) / (high - low)
            wave = 0.5 * (1 - np.cos(2 * np.pi * share))
            back = back + form.profile_slope * (share - 0.5) + form.profile_form * wave
        return back

    def test_in_single_contact_the_wheel_lags_by_the_deviation(self, xiamen, perfect):
        pair = xiamen.pair
        specimen = replace(perfect, forms=self.FORMS)
        position = rolls(xiamen) % pair.base_pitch
        pitch = pair.base_pitch
        alone = (position > pair.path_of_contact - 0.9 * pitch) & (
            position < 0.9 * pitch
        )

        assert alone.mean() > 0.09

        error = late(xiamen, specimen)[alone]
        assert_close(
            error,
            self.deviation(pair, position[alone]),
            atol=0.02 * UM,
        )
        assert np.abs(error).max() > 0.5 * UM

    @pytest.mark.parametrize(("name", "to_tip"), [("pinion", 1.0), ("wheel", -1.0)])
    def test_the_tilt_of_the_teeth_is_a_profile_slope(
        self, xiamen, perfect, name, to_tip
    ):
        """The tooth-to-tooth part: a slope about the pitch point, here the same on all teeth."""
        slope = 3 * UM
        (low, high) = self.involute(getattr(xiamen.pair, name))
        tilt = {f"{name}_tilt": to_tip * slope / (high - low)}
        error = late(xiamen, replace(perfect, **tilt))
        expected = late(
            xiamen,
            replace(perfect, forms=(profile(name, slope),)),
        )
        centred = expected - expected.mean()

        assert_close(error - error.mean(), centred, atol=0.02 * slope)
        assert np.ptp(expected) > 0.1 * slope


def test_drawn_backlash_needs_no_further_tables(xiamen, perfect):
    for factor in (1.0, 1.2):
        running = dynamics_with(xiamen, replace(perfect, backlash_factor=factor))
        assert running.table.pinion is xiamen.mesh_table().pinion
        backlash = mesh_numbers(
            running.equations.meshes[0], running.dynamics.rest, 1e-6
        )[BACKLASH]
        assert_close(backlash, factor * 80 * UM, 1e-9)


def test_only_faults_of_the_record_engage(machine):
    """Though every tooth of a graded gear differs from the nominal one."""
    system = machine({"operating.duration_s": 0.1})
    pair = system.pair
    rng = np.random.default_rng(3)
    specimen = draw_specimen(rng, pair.pinion, pair.wheel, system.quality)

    assert len(specimen.forms) == 2

    fault = one("pitch_error", tooth=3, pitch_error_um=5)
    sound, faulty = simulate_together(
        [
            Run(
                system=system,
                faults=faults,
                specimen=specimen,
                with_mesh_state=True,
            )
            for faults in ((), (fault,))
        ]
    )
    assert not sound.mesh.fault_engaged.any()

    share = pair.transverse_contact_ratio / 23
    assert_close(faulty.mesh.fault_engaged.mean(), share, 0.03)
