"""Laws of wear: Archard's, the two rules, sharing, hunting, what a worn flank does to its own
wear."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.errors import ConfigError
from gensig.life.options import FlankMaterial, read_wear_options
from gensig.life.wear.archard import flank_path, meshes_per_turn
from gensig.life.wear.wear_case import wear_case
from gensig.life.wear.wear_life import wear_life, worn_flanks
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.slices import loaded_contact
from gensig.options.compose import compose
from gensig.systems.registry import read_sliced_pair
from gensig.systems.wear import read_wear_case

PAPER = ("gear=harbin_38_55", "wear.sharing=one_pair", "wear.geometry=unworn")
FULL = ("gear=harbin_38_55", "gear.addendum_coefficient=1", "wear.threshold_um=30")
HELICAL = ("system=helical_pair", "wear.threshold_um=10", "mesh.n_slices=20")


def case_of(*words):
    return read_wear_case(compose("generate", list(words)))


def changed(case, **options):
    return wear_case(
        case.mesh, case.material, replace(case.options, **options), case.torque
    )


def at_pitch(case):
    return int(np.argmin(np.abs(case.path.position - case.pair.pitch_point)))


def test_the_band_rule_is_the_integral_over_the_passing_contact():
    """Archard's law integrated over time at one point of the pinion, the Hertzian ellipse going
    over it."""
    case = case_of(*PAPER)
    load = case.line_load(case.new_flanks())
    found = case.wear_per_mesh(case.new_flanks())[0, 0]
    peak = case.pressure(load, case.new_flanks())[0]
    half = 2.0 * load[0] / (math.pi * peak)
    factor, speed = case.options.wear_factor("pinion"), 12.5
    own, other = case.path.rolling * speed
    for node in (0, 30, 100):
        time = np.linspace(-half[node], half[node], 20001) / own[node]
        pressure = peak[node] * np.sqrt(
            np.maximum(1.0 - (time * own[node] / half[node]) ** 2, 0.0)
        )
        depth = np.trapezoid(factor * pressure * abs(own[node] - other[node]), time)
        assert found[node] == pytest.approx(depth, rel=1e-4)


@pytest.mark.parametrize("rule", ["band", "fixed_intervals"])
@pytest.mark.parametrize(
    "words", [PAPER, FULL, HELICAL], ids=["paper", "own mesh", "helical"]
)
def test_nothing_wears_at_the_pitch_point_and_both_flanks_do_elsewhere(rule, words):
    case = case_of(*words, f"wear.rule={rule}")
    depth = case.wear_per_mesh(case.new_flanks())
    pitch = at_pitch(case)
    assert_allclose(depth[:, :, pitch], 0.0, atol=1e-12 * depth.max())
    assert depth[:, :, : pitch - 1].min() > 1e-3 * depth.max()
    sliding = case.path.sliding
    assert (sliding[:pitch] > 0.0).all()
    assert (sliding[pitch + 1 :] < 0.0).all()


def test_archard_is_linear_in_coefficient_and_hardness_of_each_gear():
    case = case_of(*FULL, "wear.geometry=unworn")
    depth = case.wear_per_mesh(case.new_flanks())
    other = changed(
        case,
        pinion=FlankMaterial(coefficient=3.0 * case.options.coefficient, hardness=None),
        wheel=FlankMaterial(coefficient=None, hardness=2.0 * case.options.hardness),
    )
    assert_allclose(
        other.wear_per_mesh(case.new_flanks()),
        depth * np.array([3.0, 0.5])[:, None, None],
        rtol=1e-12,
    )


def test_life_goes_with_threshold_and_the_wheel_meshes_less_often():
    case = case_of(*PAPER)
    life = wear_life(case)
    assert wear_life(
        changed(case, threshold=0.5 * case.options.threshold)
    ).life == pytest.approx(0.5 * life.life)
    ratio = life.depth[-1] / (case.wear_per_mesh(case.new_flanks()) * life.life + 1e-30)
    assert_allclose(ratio[0, 0, :10], 1.0, rtol=1e-9)
    assert_allclose(ratio[1, 0, :10], 38.0 / 55.0, rtol=1e-9)
    assert_allclose(meshes_per_turn(case.pair), [1.0, 38.0 / 55.0])


def test_exponents_of_both_rules_in_the_papers_setting():
    case = case_of(*PAPER)
    for rule, exponent in (("band", 1.0), ("fixed_intervals", 0.5)):
        one = changed(case, rule=rule)
        lives = [wear_life(one.under(torque)).life for torque in (50.0, 200.0)]
        assert math.log(lives[0] / lives[1]) / math.log(4.0) == pytest.approx(
            exponent, abs=1e-9
        )


def test_fixed_intervals_does_not_converge_and_the_band_does_not_ask():
    case = case_of(*PAPER, "wear.rule=fixed_intervals")
    lives = [wear_life(changed(case, n_intervals=n)).life for n in (20, 40, 400)]
    assert_allclose(np.array(lives) / lives[0], [1.0, 2.0, 20.0])
    band = changed(case, rule="band")
    assert wear_life(changed(band, n_intervals=400)).life == wear_life(band).life


def test_the_mesh_shares_the_load():
    """Without corner contact both pairs of the double zone carry all of it, and one pair where
    there is one."""
    case = case_of(*FULL, "mesh.law=paper")
    load, place, pitch = (
        case.line_load(case.new_flanks())[0],
        case.path.position,
        case.pair.base_pitch,
    )
    whole = case.force / case.pair.face_width
    double = (place > 0.02 * pitch) & (place < case.pair.path_of_contact - 1.02 * pitch)
    both = load[double] + np.interp(place[double] + pitch, place, load)
    assert_allclose(both, whole, rtol=2e-3)
    single = (place > case.pair.path_of_contact - 0.98 * pitch) & (place < 0.98 * pitch)
    assert_allclose(load[single], whole, rtol=1e-9)
    assert load[double].max() < 0.7 * whole


def test_pressure_of_new_flanks_is_that_of_the_loaded_mesh():
    system = read_sliced_pair(
        compose("generate", ["system=helical_pair", "mesh.n_slices=8"])
    )
    case = case_of("system=helical_pair", "mesh.n_slices=8")
    contact = loaded_contact(case.mesh, system.phases(96), system.mesh_force)
    pressure = contact_pressure(case.mesh, contact, case.material)
    found = case.pressure(case.line_load(case.new_flanks()), case.new_flanks())
    inside = (contact.position > 0.0) & (contact.position < case.pair.path_of_contact)
    for j in (0, 4, 7):
        place, value = (
            contact.position[..., j][inside[..., j]],
            pressure[..., j][inside[..., j]],
        )
        assert_allclose(
            np.interp(place, case.path.position, found[j]), value, rtol=0.02
        )


def test_slices_of_a_spur_pair_wear_alike_and_as_the_whole():
    words = [*FULL, "wear.threshold_um=5"]
    one = wear_life(case_of(*words))
    system = read_sliced_pair(compose("generate", words))
    sliced = replace(system, slices=replace(system.slices, n_slices=6)).sliced_mesh()
    six = wear_life(
        wear_case(
            sliced,
            system.material,
            read_wear_options(compose("generate", words)["wear"]),
            200.0,
        )
    )
    assert np.ptp(six.depth[-1], axis=1).max() < 1e-9 * six.depth.max()
    # six slices are looked at 24 phases of a pitch, one slice at every node
    assert six.life == pytest.approx(one.life, rel=0.01)


def test_slices_of_a_helical_pair_converge():
    lives = [wear_life(case_of(*HELICAL, f"mesh.n_slices={n}")).life for n in (20, 40)]
    assert lives[0] == pytest.approx(lives[1], rel=0.04)


@pytest.mark.parametrize(
    "words",
    [FULL, ("wear.threshold_um=100",), HELICAL],
    ids=["full", "default", "helical"],
)
def test_half_the_step_and_twice_the_nodes_are_the_same_life(words):
    case = case_of(*words)
    life = wear_life(case)
    step = min(case.options.step, 0.1 * case.options.threshold)
    assert wear_life(changed(case, step=0.5 * step)).life == pytest.approx(
        life.life, rel=5e-3
    )
    finer = wear_case(
        case.mesh,
        case.material,
        case.options,
        case.torque,
        n_nodes=2 * len(case.path.position) - 1,
    )
    assert wear_life(finer).life == pytest.approx(life.life, rel=0.01)


def test_worn_places_give_their_load_away():
    case = case_of(*FULL)
    life = wear_life(case)
    new, worn = case.line_load(case.new_flanks())[0], case.line_load(life.depth[-1])[0]
    assert worn[0] < 0.7 * new[0]
    assert life.life > 1.5 * wear_life(changed(case, geometry="unworn")).life
    # the pinion no longer wears most at its root
    assert life.depth[-1][0, 0].argmax() > 10
    assert case.wear_per_mesh(case.new_flanks())[0, 0].argmax() == 0


def test_a_path_has_the_pitch_point_for_a_node():
    pair = case_of("wear.geometry=unworn").pair
    for n_nodes in (11, 50, 101):
        path = flank_path(pair, n_nodes)
        assert len(path.position) == n_nodes
        assert np.abs(path.position - pair.pitch_point).min() < 1e-15
        assert (np.diff(path.position) > 0.0).all()
        assert path.position[[0, -1]] == pytest.approx([0.0, pair.path_of_contact])


@pytest.mark.parametrize("rule", ["band", "fixed_intervals"])
def test_a_history_is_the_same_in_one_go_or_many(rule):
    case = case_of(*FULL, f"wear.rule={rule}", "wear.threshold_um=5")
    life = wear_life(case)
    turns = life.turns[[0, 4, 4, 20, 40]]
    at_once = worn_flanks(case, turns)
    assert_allclose(at_once[-1], life.depth[-1], atol=2e-3 * life.depth.max())
    assert_allclose(at_once[1], at_once[2], atol=0.0)
    assert not at_once[0].any()
    assert (np.diff(at_once, axis=0) >= -1e-12).all()
    steady = worn_flanks(case, turns, torque=np.full(5, case.torque))
    assert_allclose(steady, at_once, atol=2e-3 * life.depth.max())
    later = worn_flanks(case, turns[3:] - turns[2], start=at_once[2])
    assert_allclose(later, at_once[3:], atol=2e-3 * life.depth.max())
    heavier = worn_flanks(
        case, turns, torque=case.torque * np.array([1.0, 1.0, 1.0, 2.0, 1.0])
    )
    assert heavier[3].max() > 1.2 * at_once[3].max()


@pytest.mark.parametrize(
    ("turns", "torque", "message"),
    [
        ([2.0, 1.0], None, "never falls"),
        ([-1.0, 1.0], None, "never falls"),
        ([np.nan], None, "never falls"),
        ([[1.0]], None, "never falls"),
        ([1.0, 2.0], [1.0], "give one for each"),
        ([1.0, 2.0], [1.0, -2.0], "must be positive"),
    ],
)
def test_a_history_that_cannot_be_is_refused(turns, torque, message):
    with pytest.raises(ConfigError, match=message):
        worn_flanks(case_of(*FULL), np.array(turns), torque=torque)
