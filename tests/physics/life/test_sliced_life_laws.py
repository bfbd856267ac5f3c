"""Cracks and pits that grow in teeth cut into slices, and under the load spectrum of a drive
line."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from numpy.testing import assert_array_equal
from refusals import refused

from gensig import load_faults
from gensig.driveline.loads import LEAST_TORQUE, SHARED, greatest_loads
from gensig.faults.registry import read_faults
from gensig.life.crack_growth import crack_growth
from gensig.life.growth import grow
from gensig.life.life_options import read_life
from gensig.life.load_history import given_history
from gensig.life.pit_growth import contact_stress, sliced_contact_stress
from gensig.life.sliced_crack import sliced_crack_growth
from gensig.mesh.sliced.slice_energy import structure_energy
from gensig.mesh.sliced.slices import loaded_contact
from gensig.plan.request import read_request
from gensig.systems.growth_laws import _for_lives, crack_law, pit_law
from gensig.systems.registry import read_system

SPUR = (
    "system=helical_pair",
    "gear=xiamen_23_84",
    "mesh.n_slices=8",
)
HELICAL = ("system=helical_pair", "mesh.n_slices=12")


def parts(*overrides):
    config = read_request(["life=mixed", "fault=crack", *overrides]).config
    return (
        read_system(config),
        read_life(config["life"]).laws,
        read_faults(config["fault"])[0],
    )


@pytest.fixture(scope="module")
def spur():
    return parts(*SPUR)


@pytest.fixture(scope="module")
def helical():
    return parts(*HELICAL)


def sliced(machine, crack, options, torques=(100.0, 100.0)):
    return crack_law(machine, crack, options, torques)


@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_without_a_helix_a_crack_lives_as_on_the_spur_pair(spur, gear):
    machine, laws, crack = spur
    crack = replace(crack, gear=gear)
    options = replace(laws["crack"], threshold=0.0)
    whole = crack_growth(machine.pair, machine.material, crack, options)
    cut = sliced(machine, crack, options)

    assert_close(cut.intensity[0], whole.intensity[0], 1e-3)

    history = given_history(((0.0, 1e9, 200.0, 100.0),), math.inf)
    lives = []
    for law in (whole, cut):
        course = grow(
            law.sizes,
            law.turns(np.array([100.0])),
            history,
            5e-4,
        )
        assert course.has_failed
        lives.append(course.turns[-1])

    assert_close(lives[1], lives[0], 1e-3)


def test_without_a_helix_a_crack_over_part_of_the_face_grows_as_on_the_spur_pair(spur):
    machine, laws, crack = spur
    options = replace(laws["crack"], width_share=0.25)
    whole = crack_growth(machine.pair, machine.material, crack, options)
    cut = sliced(machine, crack, options)

    assert_close(cut.intensity[0], whole.intensity[0], 0.06)
    assert_close(cut.width, whole.width, 0.09)
    assert (np.diff(cut.width) >= 0.0).all()


def test_the_release_rate_is_the_change_of_the_energy_at_constant_load(helical):
    """Against the approach of the whole mesh, solved anew: with a linear contact U = F approach /
    2."""
    machine, laws, crack = helical
    flanks = _for_lives(machine.flanks)
    flanks = replace(flanks, mesh=replace(flanks.mesh, contact="linear"))
    law = sliced_crack_growth(
        flanks.pair,
        flanks.material,
        flanks.sliced_mesh,
        crack,
        laws["crack"],
        np.array([90.0]),
    )
    depth = 1e-3
    force = 90.0 / flanks.pair.pinion.base_radius
    roll = flanks.pair.base_pitch * np.linspace(0.01, 4.0, 400)
    low, high = (
        flanks.sliced_mesh((replace(crack, tooth=0, crack_depth=share * depth),))
        for share in (0.995, 1.005)
    )
    energy = (
        0.5
        * force
        * (
            loaded_contact(high, roll, force).approach
            - loaded_contact(low, roll, force).approach
        )
    )
    release = energy.max() / (0.01 * depth * flanks.pair.pinion.face_width)
    modulus = flanks.material.in_plane("plane_strain").youngs_modulus
    result = law.measures(depth, 90.0)["stress_intensity_range_mpa_sqrt_m"]

    assert_close(result, math.sqrt(release * modulus) / 1e6, 2e-3)


def test_below_the_threshold_a_crack_of_a_helical_pair_does_not_grow(helical):
    machine, laws, crack = helical
    law = sliced(machine, crack, laws["crack"], (20.0, 300.0))
    assert_array_equal(law.rate(law.sizes, 20.0), 0.0)
    assert (law.rate(law.sizes, 300.0) > 0.0).all()
    # how the load is shared hangs little on it
    assert_close(law.intensity[0], law.intensity[2], 0.04)


def test_finer_slices_leave_the_stress_intensity(helical):
    machine, laws, crack = helical
    fine = parts("system=helical_pair", "mesh.n_slices=24")[0]
    coarse, finer = (sliced(one, crack, laws["crack"]) for one in (machine, fine))
    assert_close(coarse.intensity, finer.intensity, 0.01)


@pytest.mark.parametrize("length", [0.0, 3e-3])
def test_the_energy_of_slices_is_half_the_work_of_their_loads(length):
    rng = np.random.default_rng(0)
    width = rng.uniform(1e-3, 2e-3, 7)
    structure = rng.uniform(1e-11, 3e-11, (3, 7))
    load = rng.uniform(0.0, 1e5, (3, 7))
    steps = np.diff(np.eye(7), axis=0)

    energies = structure_energy(structure, load, width, length**2)

    for soft, pressed, energy in zip(structure, load * width, energies, strict=True):
        between = 0.25 * (soft[1:] + soft[:-1]) * (width[1:] + width[:-1])
        ties = steps.T @ np.diag(length**2 / between) @ steps
        stiffness = np.diag(width / soft) + ties
        work = 0.5 * pressed @ np.linalg.solve(stiffness, pressed)
        assert_close(energy, work, 1e-9)


def test_the_contact_stress_of_slices_is_the_nominal_one_without_a_helix(spur):
    machine, laws, _ = spur
    torques = np.array([20.0, 100.0, 300.0])
    mesh = _for_lives(machine.flanks).sliced_mesh()
    exponent = laws["distributed_pitting"].exponent
    result = sliced_contact_stress(mesh, machine.material, torques, exponent)
    nominal = [contact_stress(machine.pair, machine.material, one) for one in torques]

    assert_close(result, nominal, 1e-9)


def test_pits_of_a_helical_pair_come_by_their_slices(helical):
    machine, laws, _ = helical
    pits = load_faults("fault=distributed_pitting")[0]
    options = laws["distributed_pitting"]
    misaligned = parts(*HELICAL, "modification.misalignment_um=10")[0]
    even, tilted = (
        pit_law(one, pits, options, 1.0, (50.0, 200.0)) for one in (machine, misaligned)
    )
    # nearly as the root of the load where flanks are even; where they are not, one end carries all
    # of a small one
    ratio = even.rate(np.zeros(1), 200.0) / even.rate(np.zeros(1), 50.0)
    exponent = math.log(ratio[0]) / math.log(4.0)

    assert_close(exponent, 0.5 * options.exponent, 0.02)
    assert tilted.unit_stress[0] > tilted.unit_stress[2] > even.unit_stress[2]


def test_a_spectrum_grows_at_the_mean_of_its_rates(helical):
    machine, laws, crack = helical
    law = sliced(machine, crack, laws["crack"], (100.0, 300.0))
    alone = law.turns(np.array([150.0, 300.0]))
    steady = law.turns([np.full(3, 150.0), np.full(2, 300.0)])

    assert_close(steady, alone, 1e-12)

    both = law.turns([np.array([150.0, 300.0])])[0]
    assert_close(
        1.0 / both,
        0.5 * (1.0 / alone).sum(axis=0),
        1e-12,
    )


def test_the_loads_of_a_mesh_are_the_greatest_of_each_pair_of_teeth(spur):
    pair = spur[0].pair
    pitch = pair.base_pitch
    radius = pair.pinion.base_radius
    angle = np.linspace(0.0, 12.0 * pitch / radius, 24001)
    steady = np.full(24001, 70.0)

    assert_close(
        greatest_loads(pair, angle, steady),
        70.0 * radius,
        1e-12,
    )
    assert_array_equal(greatest_loads(pair, angle, -steady), LEAST_TORQUE)

    # an impact while two pairs carry is shared; alone, one has all of it
    for place, shares in (
        (0.1, [SHARED, SHARED]),
        (0.9, [1.0]),
    ):
        distance = np.abs(angle * radius - (5.0 + place) * pitch)
        loads = greatest_loads(
            pair,
            angle,
            np.where(distance < 1e-5, 500.0, 0.0),
        )
        expected = np.array(shares) * 500.0 * radius
        assert_close(
            np.sort(loads[loads > LEAST_TORQUE]),
            expected,
            1e-12,
        )


def test_cracks_that_slices_cannot_have_are_refused(spur):
    machine, laws, crack = spur
    with refused("compression"):
        sliced(
            machine,
            replace(crack, crack_side="compression"),
            laws["crack"],
        )
    with refused("width_share"):
        sliced(
            machine,
            crack,
            replace(laws["crack"], width_share=0.01),
        )
