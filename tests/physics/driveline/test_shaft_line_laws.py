"""Laws that every drive line keeps, the engine's, a gearbox's and a single pair's alike."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close

from gensig.driveline.drive_line import drive_line_of_pair, read_drive_line
from gensig.driveline.linear.matrices import line_matrices
from gensig.driveline.linear.modal import natural_modes, with_viscous_losses
from gensig.driveline.linear.shaft_line import (
    GearMesh,
    LineGear,
    Node,
    Shaft,
    ShaftLine,
)
from gensig.plan.request import read_request

LINES = (
    "engine",
    "engine_lateral",
    "gearbox",
    "gearbox_lateral",
    "pair",
    "pair_with_rotors",
)
ROTORS = {
    "system.motor.inertia_kg_m2": 0.01,
    "system.load.inertia_kg_m2": 0.03,
}


@pytest.fixture(scope="module")
def lines(machine):
    engine, gearbox = (
        [
            read_drive_line(
                read_request(
                    [
                        f"system={name}",
                        f"system.lateral={lateral}",
                    ]
                ).config
            )
            for lateral in ("false", "true")
        ]
        for name in ("engine_gear_train", "two_stage_gearbox")
    )
    pairs = [drive_line_of_pair(machine(changes), "pair") for changes in ({}, ROTORS)]
    return dict(zip(LINES, (*engine, *gearbox, *pairs), strict=True))


@pytest.fixture(params=LINES)
def line(lines, request):
    return lines[request.param]


def test_a_free_line_has_one_rigid_mode_in_the_gear_ratios(line):
    computed = line.modes()
    matrices = line.matrices()
    assert computed.n_rigid == 1
    assert computed.frequency[0] == 0.0
    assert np.all(np.diff(computed.frequency) >= 0.0)

    turning = (matrices.expand @ computed.shapes[0])[: len(line.numbers)]
    assert_close(
        turning / turning[0],
        np.abs(line.line.speed_ratio),
        1e-12,
    )

    scale = (
        np.abs(matrices.whole_stiffness).sum(axis=1) * np.abs(computed.shapes[0]).max()
    )
    assert np.all(np.abs(matrices.whole_stiffness @ computed.shapes[0]) < 1e-12 * scale)

    wrong = computed.shapes[0].copy()
    wrong[1] *= 1.01
    assert not np.all(np.abs(matrices.whole_stiffness @ wrong) < 1e-6 * scale)


def test_matrices_are_symmetric_and_store_no_negative_energy(line):
    for merge in (False, True):
        one = with_viscous_losses(line.matrices(merge_rigid=merge))
        for matrix in (
            one.mass,
            one.stiffness,
            one.damping,
            one.whole_stiffness,
        ):
            assert_close(
                matrix,
                matrix.T,
                atol=1e-12 * max(1.0, np.abs(matrix).max()),
            )
            assert np.linalg.eigvalsh(matrix).min() > -1e-10 * max(
                1.0, np.abs(matrix).max()
            )


def test_modes_are_orthogonal_and_hold_as_much_strain_as_kinetic_energy(line):
    computed = line.modes()
    matrices = line.matrices()
    assert_close(
        computed.shapes @ matrices.mass @ computed.shapes.T,
        np.eye(len(computed.shapes)),
        atol=1e-8,
    )

    square = (2.0 * np.pi * computed.frequency) ** 2
    strain = computed.shapes @ matrices.whole_stiffness @ computed.shapes.T
    assert_close(
        strain,
        np.diag(square),
        atol=1e-8 * square.max(),
    )
    assert_close(computed.kinetic_share.sum(axis=1), 1.0, 1e-12)
    assert np.all(computed.mesh_strain_share >= 0.0)
    assert np.all(computed.mesh_strain_share.sum(axis=1) <= 1.0 + 1e-9)


def test_equal_loss_factors_damp_every_mode_by_half_of_it(lines):
    matrices = lines["engine"].matrices()
    uniform = replace(
        matrices,
        loss_stiffness=0.06 * matrices.stiffness,
        mesh_loss_factor=np.full_like(matrices.mesh_stiffness, 0.06),
    )
    computed = natural_modes(uniform)

    assert_close(computed.damping_ratio[1:], 0.03, 1e-5)
    assert computed.damping_ratio[0] == 0.0


def test_viscous_losses_damp_each_mode_as_its_loss_factors_do(lines):
    matrices = lines["gearbox"].matrices(merge_rigid=True)
    shafts_only = replace(
        matrices,
        mesh_loss_factor=np.zeros_like(matrices.mesh_stiffness),
    )
    ratio = natural_modes(shafts_only).damping_ratio
    viscous = with_viscous_losses(shafts_only)
    n = len(matrices.names)
    k, c = (
        np.linalg.solve(matrices.mass, one)
        for one in (viscous.whole_stiffness, viscous.damping)
    )
    rates = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-k, -c]]))
    ringing = rates[rates.imag > 1.0]
    ringing = ringing[np.argsort(np.abs(ringing))]

    assert_close(
        -ringing.real / np.abs(ringing),
        ratio[1:],
        1e-6,
    )
    assert_close(
        viscous.damping @ matrices.rigid.T,
        0.0,
        atol=1e-9 * np.abs(viscous.damping).max(),
    )
    assert np.all(natural_modes(viscous).damping_ratio[1:] >= ratio[1:] * (1 - 1e-9))


def test_a_mesh_on_its_own_gets_half_of_its_loss_factor():
    pair = two_discs(loss_factor=0.1)
    computed = natural_modes(with_viscous_losses(line_matrices(pair)))
    assert_close(computed.damping_ratio, [0.0, 0.05], 1e-12)


def two_discs(loss_factor=0.0):
    gears = [
        LineGear(
            name=name,
            node=node,
            n_teeth=count,
            base_radius=0.47 * 2e-3 * count,
        )
        for node, (name, count) in enumerate((("a", 20), ("b", 50)))
    ]
    return ShaftLine(
        nodes=(
            Node(name="a", inertia=1e-3),
            Node(name="b", inertia=2e-2),
        ),
        gears=tuple(gears),
        meshes=(
            GearMesh(
                driving=0,
                driven=1,
                stiffness=2e8,
                loss_factor=loss_factor,
            ),
        ),
    )


def test_two_discs_in_mesh_have_the_textbook_frequency():
    line = two_discs()
    equivalent = 1.0 / sum(
        gear.base_radius**2 / node.inertia
        for gear, node in zip(line.gears, line.nodes, strict=True)
    )
    computed = natural_modes(line_matrices(line))

    assert_close(
        computed.frequency,
        [0.0, np.sqrt(2e8 / equivalent) / (2.0 * np.pi)],
        1e-12,
    )


def test_a_geared_line_has_the_frequencies_of_the_line_referred_to_one_shaft():
    """Inertias and stiffnesses behind a ratio count times its square: the classical equivalent
    shaft.
    """
    ratio = 20 / 50
    (a, b) = two_discs().gears
    inertia = (0.3, 1e-3, 2e-2, 0.5)
    springs = (1e4, 2e8, 3e4)
    geared = ShaftLine(
        nodes=tuple(
            Node(name=str(place), inertia=value) for place, value in enumerate(inertia)
        ),
        shafts=(
            Shaft(first=0, second=1, stiffness=springs[0]),
            Shaft(first=2, second=3, stiffness=springs[2]),
        ),
        gears=(replace(a, node=1), replace(b, node=2)),
        meshes=(GearMesh(driving=0, driven=1, stiffness=springs[1]),),
    )
    behind = np.array([1.0, 1.0, ratio**2, ratio**2])
    referred = ShaftLine(
        nodes=tuple(
            Node(name=str(place), inertia=value)
            for place, value in enumerate(inertia * behind)
        ),
        shafts=tuple(
            Shaft(first=place, second=place + 1, stiffness=value)
            for place, value in enumerate(
                (
                    springs[0],
                    springs[1] * a.base_radius**2,
                    springs[2] * ratio**2,
                )
            )
        ),
    )
    one, other = (natural_modes(line_matrices(line)) for line in (geared, referred))

    assert_close(one.frequency, other.frequency, 1e-9)
    assert_close(one.kinetic_share, other.kinetic_share, atol=1e-9)


def test_merging_compounds_takes_only_what_they_alone_do(lines):
    """The printed 1000 MN m/rad stand for rigid: merged, all modes below 5 kHz stay and the
    highest are gone.
    """
    matrices = [lines["engine"].matrices(merge_rigid=merge) for merge in (False, True)]
    as_printed, merged = (natural_modes(one).frequency for one in matrices)
    assert len(as_printed) == 67
    assert len(merged) == 65

    low = as_printed < 5e3
    assert_close(merged[: low.sum()], as_printed[low], 1e-3)
    assert as_printed[-1] > 8e4
    assert merged[-1] < 3e4


def test_stiff_supports_leave_the_torsional_line(lines):
    line = lines["engine"].line
    lateral = lines["engine_lateral"].line
    torsion = natural_modes(line_matrices(line)).frequency[:12]
    apart = []
    for factor in (1.0, 1e2, 1e4):
        gears = tuple(
            replace(
                gear,
                support=replace(
                    gear.support,
                    stiffness_x=gear.support.stiffness_x * factor,
                    stiffness_y=gear.support.stiffness_y * factor,
                ),
            )
            for gear in lateral.gears
        )
        computed = natural_modes(
            line_matrices(replace(lateral, gears=gears), lateral=True)
        ).frequency[:12]
        apart.append(np.abs(computed[1:] / torsion[1:] - 1.0).max())

    assert apart[0] > 0.02
    assert apart[1] < 0.02 * 0.2
    assert apart[2] < 1e-4


@pytest.mark.parametrize("rotors", [{}, ROTORS], ids=["pair", "with_rotors"])
def test_the_single_pair_is_the_same_code_with_two_nodes(machine, running_of, rotors):
    """Matrices of the line are those of the pair without its soft drive."""
    system = machine(rotors)
    running = running_of(system)
    pair_system = running.equations
    matrices = drive_line_of_pair(system, "pair").matrices()
    order = []
    for name in matrices.names:
        gear, _, axis = name.partition(" ")
        order.append(running.dofs.index(f"{gear}_{axis or 'rotation'}"))
    both = np.ix_(order, order)
    driver = running.dofs.index("motor_rotation" if rotors else "pinion_rotation")

    stiffness = pair_system.governed_stiffness.copy()
    stiffness[driver, driver] -= running.drive_stiffness

    assert_close(np.diag(matrices.mass), pair_system.mass[order], 1e-14)
    assert_close(
        matrices.stiffness,
        stiffness[both],
        1e-9,
        atol=1e-9 * stiffness.max(),
    )

    damping = matrices.damping - pair_system.governed_damping[both]
    damping[order.index(driver), order.index(driver)] = 0.0
    assert_close(damping, 0.0, atol=1e-12 * pair_system.governed_damping.max())

    direction = running.approach_direction()
    assert_close(
        matrices.directions[0],
        direction[order],
        1e-12,
        atol=1e-15,
    )
    assert matrices.mesh_stiffness == [running.mean_mesh_stiffness]
    assert matrices.mesh_damping == [running.mesh_damping]
