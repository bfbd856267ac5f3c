"""Laws of wear: Archard's, the two rules, sharing, hunting, what a worn flank does to its own
wear."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from refusals import refused

from gensig.life.options import FlankMaterial
from gensig.life.wear.archard import flank_path, meshes_per_turn
from gensig.life.wear.wear_case import wear_case
from gensig.life.wear.wear_life import wear_life, worn_flanks
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.slices import loaded_contact
from gensig.options.compose import compose
from gensig.systems.registry import read_sliced_pair
from gensig.systems.wear import read_wear_case

PAPER = (
    "gear=harbin_38_55",
    "wear.sharing=one_pair",
    "wear.geometry=unworn",
)
FULL = (
    "gear=harbin_38_55",
    "gear.addendum_coefficient=1",
    "wear.threshold_um=30",
)
HELICAL = (
    "system=helical_pair",
    "wear.threshold_um=10",
    "mesh.n_slices=20",
)


def case_of(*words):
    return read_wear_case(compose("generate", list(words)))


def changed(case, **options):
    return wear_case(
        case.mesh,
        case.material,
        replace(case.options, **options),
        case.torque,
    )


def at_pitch(case):
    return int(np.argmin(np.abs(case.path.position - case.pair.pitch_point)))


def test_the_band_rule_is_the_integral_over_the_passing_contact():
    """Archard's law integrated over time at one point of the pinion, the Hertzian ellipse going
    over it."""
    case = case_of(*PAPER)
    load = case.line_load(case.new_flanks())
    result = case.wear_per_mesh(case.new_flanks())[0, 0]
    peak = case.pressure(load, case.new_flanks())[0]
    half = 2.0 * load[0] / (math.pi * peak)
    factor = case.options.wear_factor("pinion")
    speed = 12.5
    pinion, wheel = case.path.rolling * speed
    for node in (0, 30, 100):
        time = np.linspace(-half[node], half[node], 20001) / pinion[node]
        place = time * pinion[node] / half[node]
        pressure = peak[node] * np.sqrt(np.maximum(1.0 - place**2, 0.0))
        sliding = abs(pinion[node] - wheel[node])
        depth = np.trapezoid(factor * pressure * sliding, time)
        assert_close(result[node], depth, 1e-4)


@pytest.mark.parametrize("rule", ["band", "fixed_intervals"])
@pytest.mark.parametrize(
    "words",
    [PAPER, FULL, HELICAL],
    ids=["paper", "own mesh", "helical"],
)
def test_nothing_wears_at_the_pitch_point_and_both_flanks_do_elsewhere(rule, words):
    case = case_of(*words, f"wear.rule={rule}")
    depth = case.wear_per_mesh(case.new_flanks())
    depth = depth / depth.max()
    pitch = at_pitch(case)

    assert_close(depth[:, :, pitch], 0.0, atol=1e-12)
    assert depth[:, :, : pitch - 1].min() > 1e-3
    sliding = case.path.sliding
    assert (sliding[:pitch] > 0.0).all()
    assert (sliding[pitch + 1 :] < 0.0).all()


def test_archard_is_linear_in_coefficient_and_hardness_of_each_gear():
    case = case_of(*FULL, "wear.geometry=unworn")
    new = case.new_flanks()
    options = case.options
    pinion = FlankMaterial(coefficient=3.0 * options.coefficient, hardness=None)
    wheel = FlankMaterial(coefficient=None, hardness=2.0 * options.hardness)
    other = changed(case, pinion=pinion, wheel=wheel).wear_per_mesh(new)
    factors = np.array([3.0, 0.5])[:, None, None]

    assert_close(other, factors * case.wear_per_mesh(new), 1e-12)


def test_life_goes_with_threshold_and_the_wheel_meshes_less_often():
    case = case_of(*PAPER)
    life = wear_life(case)
    half = changed(case, threshold=0.5 * case.options.threshold)

    assert_close(wear_life(half).life, 0.5 * life.life, 1e-6)

    ratio = life.depth[-1] / (case.wear_per_mesh(case.new_flanks()) * life.life + 1e-30)
    shares = meshes_per_turn(case.pair)
    assert_close(shares, [1.0, 38.0 / 55.0], 1e-7)

    for result, share in zip(ratio, shares, strict=True):
        assert_close(result[0, :10], share, 1e-9)


def test_the_mesh_shares_the_load():
    """Without corner contact both pairs of the double zone carry all of it, and one pair where
    there is one."""
    case = case_of(*FULL, "mesh.law=paper")
    pair = case.pair
    place = case.path.position
    load = case.line_load(case.new_flanks())[0] * pair.face_width / case.force
    past_single = place / pair.base_pitch
    before_end = (pair.path_of_contact - place) / pair.base_pitch

    double = (past_single > 0.02) & (before_end > 1.02)
    mate = np.interp(place[double] + pair.base_pitch, place, load)
    assert_close(load[double] + mate, 1.0, 2e-3)
    assert load[double].max() < 0.7

    single = (past_single < 0.98) & (before_end < 0.98)
    assert_close(load[single], 1.0, 1e-9)


def test_pressure_of_new_flanks_is_that_of_the_loaded_mesh():
    words = ("system=helical_pair", "mesh.n_slices=8")
    system = read_sliced_pair(compose("generate", words))
    case = case_of(*words)
    contact = loaded_contact(case.mesh, system.phases(96), system.mesh_force)
    pressure = contact_pressure(case.mesh, contact, case.material)
    result = case.pressure(case.line_load(case.new_flanks()), case.new_flanks())
    for j in (0, 4, 7):
        place = contact.position[..., j]
        inside = (place > 0.0) & (place < case.pair.path_of_contact)
        ours = np.interp(
            place[inside],
            case.path.position,
            result[j],
        )
        assert_close(ours, pressure[..., j][inside], 0.008)


def test_slices_of_a_spur_pair_wear_alike_and_as_the_whole():
    words = [*FULL, "wear.threshold_um=5"]
    case = case_of(*words)
    system = read_sliced_pair(compose("generate", words))
    slices = replace(system.slices, n_slices=6)
    sliced = replace(system, slices=slices).sliced_mesh()
    six = wear_life(wear_case(sliced, case.material, case.options, case.torque))

    assert np.ptp(six.depth[-1], axis=1).max() < 1e-9 * six.depth.max()
    # six slices are looked at 24 phases of a pitch, one slice at every node
    assert_close(six.life, wear_life(case).life, 1e-3)


@pytest.mark.parametrize(
    "words",
    [FULL, ("wear.threshold_um=100",), HELICAL],
    ids=["full", "default", "helical"],
)
def test_twice_the_nodes_are_the_same_life(words):
    case = case_of(*words)
    finer = wear_case(
        case.mesh,
        case.material,
        case.options,
        case.torque,
        n_nodes=2 * len(case.path.position) - 1,
    )
    assert_close(wear_life(finer).life, wear_life(case).life, 0.01)


def test_worn_places_give_their_load_away():
    case = case_of(*FULL)
    unworn = changed(case, geometry="unworn")
    new = case.new_flanks()
    life = wear_life(case)
    worn = life.depth[-1]

    assert case.line_load(worn)[0, 0] < 0.7 * case.line_load(new)[0, 0]
    assert life.life > 1.5 * wear_life(unworn).life
    # the pinion no longer wears most at its root
    assert case.wear_per_mesh(new)[0, 0].argmax() == 0
    assert worn[0, 0].argmax() > 10


def test_a_path_has_the_pitch_point_for_a_node():
    pair = case_of("wear.geometry=unworn").pair
    for n_nodes in (11, 50, 101):
        path = flank_path(pair, n_nodes)
        assert len(path.position) == n_nodes
        assert np.abs(path.position - pair.pitch_point).min() < 1e-15
        assert (np.diff(path.position) > 0.0).all()
        assert_close(
            path.position[[0, -1]],
            [0.0, pair.path_of_contact],
            1e-6,
        )


@pytest.mark.parametrize("rule", ["band", "fixed_intervals"])
def test_a_history_is_the_same_in_one_go_or_many(rule):
    case = case_of(*FULL, f"wear.rule={rule}", "wear.threshold_um=5")
    life = wear_life(case)
    turns = life.turns[[0, 4, 4, 20, 40]]
    at_once = worn_flanks(case, turns)
    tolerance = 2e-3 * life.depth.max()

    assert_close(at_once[-1], life.depth[-1], atol=tolerance)
    assert_close(at_once[1], at_once[2])
    assert not at_once[0].any()
    assert (np.diff(at_once, axis=0) >= -1e-12).all()

    steady = worn_flanks(
        case,
        turns,
        torque=np.full(5, case.torque),
    )
    assert_close(steady, at_once, atol=tolerance)

    later = worn_flanks(
        case,
        turns[3:] - turns[2],
        start=at_once[2],
    )
    assert_close(later, at_once[3:], atol=tolerance)

    course = case.torque * np.array([1.0, 1.0, 1.0, 2.0, 1.0])
    heavier = worn_flanks(case, turns, torque=course)
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
    with refused(message):
        worn_flanks(case_of(*FULL), np.array(turns), torque=torque)
