"""Laws of growth: thresholds, exponents, monotone courses, histories with standstills,
censoring."""

import math
from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from numpy.testing import assert_array_equal
from refusals import refused

from gensig.faults.registry import read_faults
from gensig.geometry.tooth import healthy_tooth
from gensig.life.crack_growth import crack_growth
from gensig.life.drift import Drift
from gensig.life.growth import grow
from gensig.life.life_options import read_life
from gensig.life.load_history import DrawnBlocks, draw_history, given_history
from gensig.life.pit_growth import contact_stress, pit_growth
from gensig.life.snapshots import snapshot_times
from gensig.mesh.root_crack import crack_compliance
from gensig.plan.request import read_request
from gensig.systems.registry import read_system

HOUR = 3600.0
DRAWN = DrawnBlocks(
    shortest=HOUR,
    longest=4 * HOUR,
    gap_chance=0.5,
    gap_shortest=HOUR,
    gap_longest=4 * HOUR,
)
SPEED = 60.0 * math.pi  # 1800 r/min: 108,000 turns an hour


@pytest.fixture(scope="module")
def config():
    return read_request(["life=mixed", "fault=crack"]).config


@pytest.fixture(scope="module")
def machine(config):
    return read_system(config)


@pytest.fixture(scope="module")
def options(config):
    return read_life(config["life"])


@pytest.fixture(scope="module")
def crack(config):
    return read_faults(config["fault"])[0]


@pytest.fixture(scope="module")
def law(machine, options, crack):
    return crack_growth(
        machine.pair,
        machine.material,
        crack,
        options.laws["crack"],
    )


@pytest.fixture(scope="module")
def pits(machine, options):
    fault = read_request(["fault=distributed_pitting"]).config["fault"]
    return pit_growth(
        machine.pair,
        machine.material,
        read_faults(fault)[0],
        options.laws["distributed_pitting"],
    )


def steady(torque, hours, speed=SPEED):
    return given_history(((0.0, hours * HOUR, speed, torque),), math.inf)


def life_turns(law, torque, start):
    course = grow(
        law.sizes,
        law.turns(np.array([torque])),
        steady(torque, 1e6),
        start,
    )
    assert course.has_failed
    return course.turns[-1]


@pytest.mark.parametrize(
    ("torque", "low", "high"),
    [(20.0, 1.5, 1.8), (100.0, 7.6, 9.0)],
)
def test_the_stress_intensity_range_is_that_of_the_reference(law, torque, low, high):
    """A crack of 1 mm on the 23/84 pair, increments of the reference's finite elements."""
    assert low < law.measures(1e-3, torque)["stress_intensity_range_mpa_sqrt_m"] < high


def test_the_stress_intensity_range_is_irwins(law, machine, crack):
    """Against a difference of the compliance itself, at the highest point of single contact."""
    pair = machine.pair
    strain = machine.material.in_plane("plane_strain")
    tooth = healthy_tooth(pair.pinion)
    place = np.array([pair.pinion_curvature(pair.base_pitch)])
    low, high = (
        crack_compliance(
            replace(crack, crack_depth=a).apply(tooth, 0),
            place,
            strain,
        )
        for a in (0.999e-3, 1.001e-3)
    )
    force = 100.0 / pair.pinion.base_radius
    release = force**2 / (2.0 * pair.face_width) * (high[0] - low[0]) / 2e-6
    expected = math.sqrt(release * strain.youngs_modulus) / 1e6
    result = law.measures(1e-3, 100.0)["stress_intensity_range_mpa_sqrt_m"]

    assert_close(result, expected, 2e-3)


@pytest.mark.parametrize("exponent", [2.25, 3.0])
def test_the_life_falls_with_the_load_to_the_paris_exponent(law, exponent):
    law = replace(
        law,
        options=replace(law.options, exponent=exponent, threshold=0.0),
    )
    torques = np.array([50.0, 100.0, 200.0])
    lives = [life_turns(law, torque, 0.5e-3) for torque in torques]
    slope = np.diff(np.log(lives)) / np.diff(np.log(torques))

    assert_close(slope, -exponent, 1e-9)


@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_a_crack_grows_once_a_mesh_of_its_tooth(machine, crack, options, gear):
    """A tooth of the pinion meshes once a turn of the pinion, one of the wheel 23 / 84 times."""
    cracked = replace(crack, gear=gear)
    growth = options.laws["crack"]
    law = crack_growth(machine.pair, machine.material, cracked, growth)
    depth, torque = law.sizes[40::30], 100.0
    ranges = [law.measures(float(size), torque) for size in depth]
    intensity = np.array([one["stress_intensity_range_mpa_sqrt_m"] for one in ranges])
    assert (intensity * 1e6 > growth.threshold).all()

    a_mesh = growth.coefficient * intensity**growth.exponent
    meshes = machine.pair.pinion.n_teeth / machine.pair.gears[gear].n_teeth
    assert_close(law.rate(depth, torque), meshes * a_mesh, 1e-9)


def test_the_course_converges_with_the_cells(law):
    """Half as many cells move the life by less than 0.1 %."""
    start = law.sizes[20]
    half = replace(
        law,
        sizes=law.sizes[::2],
        intensity=law.intensity[:, ::2],
    )
    fine, coarse = (life_turns(one, 120.0, start) for one in (law, half))

    assert_close(coarse, fine, 1e-3)


@pytest.fixture
def law_of_share(machine, crack, options):
    """The law of a crack that begins over a share of the face."""

    def make(share):
        changed = replace(options.laws["crack"], width_share=share)
        return crack_growth(machine.pair, machine.material, crack, changed)

    return make


def test_a_crack_over_part_of_the_face_grows_both_ways_and_becomes_a_through_one(
    law_of_share,
):
    whole = law_of_share(1.0)
    part = law_of_share(0.25)
    assert (np.diff(part.width) >= 0.0).all()
    assert_close(part.width[0], 5e-3, 1e-6)
    assert part.width[-1] > 6e-3
    # beside it the sound tooth carries: less drives it than the same depth all across
    assert part.intensity[0, 0] < whole.intensity[0, 0]
    assert 0.0 < part.fault(1e-3)["crack_width_mm"] <= 20.0
    assert "crack_width_mm" not in whole.fault(1e-3)


def test_a_nearly_through_crack_grows_as_a_through_one(law_of_share):
    whole = law_of_share(1.0)
    nearly = law_of_share(0.999999)
    assert_close(
        nearly.intensity[0, 20:-8],
        whole.intensity[0, 20:-8],
        1e-4,
    )


def test_pits_come_after_the_first_life_and_go_with_the_load_to_the_exponent(
    pits, machine
):
    assert pits.n_pits(0.99) == 0.0
    assert pits.share(1.0) == 0.0
    assert_close(pits.n_pits(2.0), pits.options.pits_per_life, 1e-12)

    ratio = life_turns(pits, 100.0, 0.0) / life_turns(pits, 200.0, 0.0)
    assert_close(math.log2(ratio), 0.5 * pits.options.exponent, 1e-9)
    assert_close(
        pits.share(pits.sizes[-1]),
        pits.options.end_share,
        1e-9,
    )

    # Hertz: the knee of the line is reached at the torque whose stress is the strength
    stress = contact_stress(machine.pair, machine.material, 1.0)
    torque = (pits.options.strength / stress) ** 2
    rate = pits.rate(np.array([0.5]), torque)

    assert_close(rate, 1.0 / pits.options.cycles, 1e-9)


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1]])
def test_damage_adds_up_by_miner_whatever_the_order(pits, order):
    hours = np.array([10.0, 5.0, 12.0])[order]
    torques = np.array([100.0, 80.0, 110.0])[order]
    end = np.cumsum(hours) * HOUR
    begin = end - hours * HOUR
    speed = np.full(3, SPEED)
    blocks = tuple(zip(begin, end, speed, torques, strict=True))
    history = given_history(blocks, math.inf)

    course = grow(
        pits.sizes,
        pits.turns(history.torque),
        history,
        0.0,
    )

    rates = [pits.rate(np.array([0.0]), torque)[0] for torque in torques]

    assert_close(course.size[-1], 108_000.0 * hours @ rates, 1e-12)


def test_a_standstill_costs_clock_time_and_nothing_else(law):
    turns = law.turns(np.array([90.0]))

    def interrupted(until):
        """Course of one hour's work, a standstill until some hour, and one more hour."""
        first = (0.0, HOUR, SPEED, 90.0)
        later = (
            until * HOUR,
            (until + 1.0) * HOUR,
            SPEED,
            90.0,
        )
        history = given_history((first, later), math.inf)
        return grow(law.sizes, turns, history, 5e-4)

    near = interrupted(1.0)
    far = interrupted(9.0)

    assert_array_equal(near.size[-1], far.size[-1])
    assert_array_equal(near.turns[-1], far.turns[-1])
    assert_close(
        far.clock[-1] - near.clock[-1],
        8 * HOUR,
        1e-6,
    )

    # no look falls into the gap
    times = snapshot_times(far, "linear", 9)
    looks = np.array([far.value("clock", far.at(time)) for time in times]) / HOUR
    assert not ((looks > 1.0) & (looks < 9.0)).any()
    assert_close(looks[-1], 10.0, 1e-6)


def test_courses_that_have_not_failed_at_the_horizon_are_censored(law):
    turns = law.turns(np.array([90.0]))
    whole = grow(law.sizes, turns, steady(90.0, 1e6), 5e-4)
    cut = grow(
        law.sizes,
        turns,
        steady(90.0, whole.clock[-1] / HOUR * 0.5),
        5e-4,
    )

    assert whole.has_failed
    assert not cut.has_failed
    assert_close(
        cut.clock[-1],
        0.5 * whole.clock[-1],
        1e-6,
    )
    assert cut.size[-1] < law.sizes[-1]


@pytest.mark.parametrize("spacing", ["linear", "logarithmic", "adaptive"])
def test_looks_are_in_order_and_reach_from_new_to_the_end(law, spacing):
    torque = np.array([60.0, 110.0, 90.0])
    rng = np.random.default_rng(3)
    history = draw_history(
        DRAWN,
        np.full(3, SPEED),
        torque,
        500 * HOUR,
        rng,
    )
    course = grow(law.sizes, law.turns(torque), history, 6e-4)

    times = snapshot_times(course, spacing, 21)
    sizes = np.array([course.value("size", course.at(time)) for time in times])

    assert_close(times[[0, -1]], [0.0, course.running[-1]])
    assert_close(
        sizes[[0, -1]],
        [6e-4, law.sizes[-1]],
        1e-6,
    )
    assert (np.diff(times) > 0.0).all()
    assert (np.diff(sizes) >= 0.0).all()

    left = times[-1] - times[:-1]
    even = {
        "linear": np.diff(times),
        "logarithmic": left[1:] / left[:-1],
        "adaptive": np.diff(sizes),
    }
    steps = even[spacing]

    assert_close(steps, steps.mean(), 1e-6)
    assert len(times) == 21


def test_looks_every_so_often_do_not_tell_how_long_a_life_is(law):
    course = grow(
        law.sizes,
        law.turns(np.array([100.0])),
        steady(100.0, 1e6),
        5e-4,
    )
    times = snapshot_times(course, "linear", 1000, every=600.0)
    assert_close(np.diff(times), 600.0, 1e-7)
    assert times[-1] <= course.running[-1] < times[-1] + 600.0


def test_a_drift_settles():
    drift = Drift(change=0.5, time=100 * HOUR, scatter=0.0)
    assert drift.factor(0.0, 1.0) == 1.0
    assert_close(
        drift.factor(100 * HOUR, 1.0),
        1.0 + 0.5 * (1.0 - math.exp(-1.0)),
        1e-7,
    )
    assert_close(drift.factor(1e9 * HOUR, 2.0), 2.0, 1e-7)


@pytest.mark.parametrize(
    ("blocks", "said"),
    [
        ([[0, 2, 1800, 90], [1, 3, 1800, 90]], "overlap"),
        ([[2, 1, 1800, 90]], "end after they begin"),
        ([[-1, 1, 1800, 90]], "count from 0"),
        ([[0, 1, 0, 90]], "a standstill is a gap"),
        ([[600, 601, 1800, 90]], "none begins before"),
        ([[0, 1, 1800]], "life.blocks.0"),
        ([[0, 1, 1800, "x"]], "life.blocks.0.torque_nm"),
        ("x", "life.blocks = 'x'"),
    ],
)
def test_a_history_that_cannot_be_is_refused(config, blocks, said):
    keys = {**config["life"], "blocks": blocks}
    with refused(said):
        options = read_life(keys)
        given_history(options.blocks, options.horizon)


def test_a_drawn_history_keeps_to_its_limits():
    speed = np.full(2, SPEED)
    torque = np.full(2, 50.0)
    rng = np.random.default_rng(0)
    history = draw_history(DRAWN, speed, torque, 1000 * HOUR, rng)
    length = (history.end - history.begin)[:-1]
    gap = history.begin[1:] - history.end[:-1]
    real = gap[gap > 1.0]

    for values in (length, real):
        assert values.min() >= HOUR - 1e-6
        assert values.max() <= 4 * HOUR + 1e-6

    assert history.end[-1] <= 1000 * HOUR
    assert 0.4 < len(real) / len(gap) < 0.6
    assert set(history.setpoint.tolist()) == {0, 1}
