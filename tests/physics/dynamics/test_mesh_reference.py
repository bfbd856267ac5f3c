"""The compiled equations against a numpy reference that tries every set of pairs in contact."""

from itertools import chain, combinations

import numpy as np
import pytest
from closeness import assert_close
from fault_cases import one, side_of
from lane_tools import laws, motion_of, right_hand_side

from gensig.dynamics._layout import DAMPING
from gensig.dynamics.lanes import mesh_numbers
from gensig.faults.broken import MissingTooth

CRACK = one("crack", tooth=2, crack_depth_mm=2)
FAULTS = {
    "healthy": (),
    "crack": (CRACK,),
    "missing": (
        CRACK,
        MissingTooth(gear="pinion", tooth=4),
        MissingTooth(gear="wheel", tooth=1),
    ),
    # gaps of both signs that vary along the path, one tooth without its tip
    "flanks": (
        one("pitch_error", tooth=2, pitch_error_um=-15),
        one("broken", tooth=4),
        one("runout", gear="wheel", tooth=3, eccentricity_um=8),
        one("wear", gear="wheel", tooth="all", wear_depth_um=4),
    ),
}
# sizes of normal, friction, two moments, force along the roll, energy and lost power, over N
SCALE = np.array([1, 1, 0.1, 0.1, 1, 1e-5, 1e-2])


def bent(at, position, values, slopes):
    """Values between nodes on the parabola that follows the growth of the slopes, (phase,)."""
    distance = position[1] - position[0]
    cell = np.clip(
        ((at - position[0]) / distance).astype(int),
        0,
        len(position) - 2,
    )
    part = (at - position[cell]) / distance
    bend = 0.5 * distance * part * (1 - part) * (slopes[cell + 1] - slopes[cell])
    return values[cell] + part * (values[cell + 1] - values[cell]) - bend


def columns(side, kind, at, position):
    """Compliance, its slope, gap and its slope of one kind of tooth, (4, phase)."""
    result = []
    for name in ("compliance", "gap"):
        values = getattr(side, name)[kind]
        slopes = getattr(side, f"{name}_slope")[kind]
        result.append(bent(at, position, values, slopes))
        result.append(np.interp(at, position, slopes))
    return np.array(result)


def tooth_at(values, index):
    """Values by tooth for the pairs of an index, (pair,)."""
    return values[index % len(values)]


class Reference:
    """Six equations of a pair, as the theory writes them; one-sided law."""

    def __init__(self, running):
        self.d = running
        self.table = running.table
        self.pair = running.table.pair
        self.system = running.equations
        self.shared = self.table.shared_compliance
        self.damping = mesh_numbers(
            running.equations.meshes[0], running.dynamics.rest, 1e-6
        )[DAMPING]

    def present(self, index):
        """Pairs whose teeth exist, (pair,)."""
        pinion = tooth_at(
            self.table.pinion.present[self.table.pinion.kind],
            index,
        )
        wheel = tooth_at(
            self.table.wheel.present[self.table.wheel.kind],
            index,
        )
        return pinion & wheel

    def pairs(self, roll):
        """Position, compliance, its slope, gap and its slope of existing pairs, (pair,) each."""
        newest = int(np.floor(roll / self.pair.base_pitch)) + 1
        index = np.arange(newest, newest - 4, -1)
        index = index[self.present(index)]
        position = roll - index * self.pair.base_pitch
        values = np.zeros((4, len(index)))
        for name in ("pinion", "wheel"):
            side = side_of(self.table, name)
            kinds = tooth_at(side.kind, index)
            for k, kind in enumerate(kinds):
                place = position[k : k + 1]
                values[:, k] += columns(side, kind, place, self.table.position)[:, 0]
            gear = ("pinion", "wheel").index(name)
            error = tooth_at(self.d.teeth.errors[gear], index)
            tilt = tooth_at(self.d.teeth.tilts[gear], index)
            values[2] += error + tilt * (position - self.pair.pitch_point)
            values[3] += tilt
        return position, *values

    def law(self, values, approach, rate, roll_rate):
        """Load of every pair, force along the roll, stored energy and lost power."""
        c, c_slope, gap, gap_slope = values
        elastic = self.loads(c, gap, approach)
        pair_rate = rate - gap_slope * roll_rate
        load = np.maximum(0.0, elastic * (1 + self.damping * pair_rate))
        energy = elastic @ (approach - gap) - 0.5 * (c - self.shared) @ elastic**2
        stored = energy - 0.5 * self.shared * elastic.sum() ** 2
        along = load @ gap_slope + 0.5 * elastic**2 @ c_slope
        lost = (load - elastic) @ pair_rate
        return load, along, stored, lost

    def loads(self, compliance, gap, approach):
        """F >= 0 with C F = approach - gap where F > 0 and C F >= approach - gap elsewhere."""
        n = len(gap)
        squeezed = approach - gap
        flexibility = np.diag(compliance - self.shared) + self.shared
        sizes = range(n + 1)
        sets = chain.from_iterable(combinations(range(n), size) for size in sizes)
        for chosen in map(list, sets):
            force = np.zeros(n)
            block = flexibility[np.ix_(chosen, chosen)]
            force[chosen] = np.linalg.solve(block, squeezed[chosen])
            slack = flexibility @ force - squeezed
            if np.all(force[chosen] > 0) and np.all(slack >= -1e-15):
                return force
        raise AssertionError("no set of pairs fits")

    def mesh(self, roll, approach, rate, roll_rate):
        """Normal, friction, moments on pinion and wheel, force along the roll, energy, power."""
        position, *values = self.pairs(roll)
        load, along, stored, lost = self.law(values, approach, rate, roll_rate)
        pair = self.pair
        options = self.table.options
        half_width = 0.5 * options.friction_transition * pair.base_pitch
        x = np.clip(
            (position - pair.pitch_point) / half_width,
            -1,
            1,
        )
        sliding = options.friction_coefficient * load * x * (1.5 - 0.5 * x**2)
        arm = pair.start_curvature_radius + np.clip(position, 0, pair.path_of_contact)
        moment_p = -(sliding @ arm)
        moment_w = sliding @ (pair.tangent_length - arm)
        normal = load.sum()
        return (
            normal,
            sliding.sum(),
            moment_p,
            moment_w,
            along,
            stored,
            lost,
        )

    def coast(self, roll, approach, rate, roll_rate):
        """The same where the back flanks touch, and the number of loaded pairs, negative.

        The mirror image of a sound pair that turns backwards: the back flanks of a space are half
        a pitch further, teeth count down, missing ones stay missing; no errors, no friction.
        """
        pitch = self.pair.base_pitch
        position = self.table.position
        n = np.arange(-40, 41)
        at = 2 * self.pair.pitch_point + (0.5 - n) * pitch - roll
        chosen = (at >= position[0]) & (at < position[-1]) & self.present(-n)
        sides = [side_of(self.table, gear) for gear in ("pinion", "wheel")]
        values = sum(columns(side, 0, at[chosen], position) for side in sides)
        squeezed = -approach - self.pair.backlash
        load, along, stored, lost = self.law(
            values,
            squeezed,
            -rate,
            -roll_rate,
        )
        n_loaded = float(np.sum(load > 0))
        return (
            -load.sum(),
            0.0,
            0.0,
            0.0,
            -along,
            stored,
            lost,
            -n_loaded,
        )

    def acceleration(self, time, q, v):
        """q'' at one instant."""
        law = self.mesh(*motion_of(self.d, time, q, v))
        normal, friction, moment_p, moment_w, along = law[:5]
        system = self.system
        turning = moment_p + self.pair.pinion.base_radius * along
        force = np.array([friction, 0, turning, -friction, 0, moment_w])
        force += (
            self.d.dynamics.forces(np.zeros(1))[0]
            - normal * self.d.approach_direction()
        )
        force -= system.governed_stiffness @ q + system.governed_damping @ v
        return force / system.mass


@pytest.fixture(scope="module", params=FAULTS)
def running(request, xiamen, running_of):
    rng = np.random.default_rng(5)
    errors = {
        f"{gear}_{key}": rng.normal(0, scatter, n)
        for key, scatter in (("error", 2e-6), ("tilt", 3e-4))
        for gear, n in (("pinion", 23), ("wheel", 84))
    }
    return running_of(xiamen, FAULTS[request.param], **errors)


def random_states(running, n, seed):
    """Roll, approach, its rate and the rate of the roll, (n, 4)."""
    rng = np.random.default_rng(seed)
    pair = running.table.pair
    speed = running.operating.speed * pair.pinion.base_radius
    roll = rng.uniform(0, 8, n) * pair.base_pitch
    approach = rng.uniform(-2e-6, 40e-6, n)
    rates = (
        rng.normal(0, 2e-2, n),
        rng.normal(speed, 0.01 * speed, n),
    )
    return np.column_stack([roll, approach, *rates])


def test_the_mesh_law_agrees(running):
    reference = Reference(running)
    states = random_states(running, 300, seed=7)
    expected = np.array([reference.mesh(*state) for state in states])
    scale = SCALE * np.maximum(1.0, expected[:, :1])
    law = laws(running, states)[:, :7]

    assert_close(law / scale, expected / scale, 1e-9, atol=1e-9)
    assert (expected[:, 0] > 0).sum() > 200


def test_back_flanks_agree(running):
    """Between half the backlash and the back flanks nothing touches."""
    reference = Reference(running)
    states = random_states(running, 300, seed=17)
    rng = np.random.default_rng(1)
    backlash = running.table.pair.backlash
    states[:, 1] = -backlash - rng.uniform(0, 40e-6, 300)
    expected = np.array([reference.coast(*state) for state in states])
    scale = np.append(SCALE, 1) * np.maximum(1.0, -expected[:, :1])

    assert_close(
        laws(running, states) / scale,
        expected / scale,
        1e-9,
        atol=1e-9,
    )
    assert (expected[:, 7] == -2).sum() > 50

    states[:, 1] = -backlash * rng.uniform(0.5, 1.0, 300)
    assert np.all(laws(running, states) == 0.0)


def test_the_right_hand_side_agrees(running):
    reference = Reference(running)
    rng = np.random.default_rng(11)
    size = np.array([1, 1, 20, 1, 1, 20])
    for time in rng.integers(0, 40_000, 40) * 1e-7:
        q = running.dynamics.static_start(time) + rng.normal(0, 1e-6, 6) * size
        v = rng.normal(0, 1e-2, 6) * size
        expected = reference.acceleration(time, q, v)
        # the slope in the middle of so brief a step is the difference of its two ends
        tolerance = 1e-6 * np.abs(expected).max()
        acceleration = right_hand_side(running, time, q, v)
        assert_close(acceleration, expected, 1e-9, atol=tolerance)


def test_a_tooth_that_stands_proud_carries_up_to_its_gap(xiamen, running_of):
    """The force fades out where the flanks part, even beyond half the backlash."""
    eccentric = running_of(xiamen, (one("runout", tooth=0, eccentricity_um=80),))
    speed = eccentric.operating.speed * eccentric.table.pair.pinion.base_radius
    pitch, step = eccentric.table.pair.base_pitch, 0.05e-6
    parting = 0
    for roll in (np.arange(23) + 0.5) * pitch:
        approach = np.arange(-100e-6, 20e-6, step)
        states = np.zeros((len(approach), 4))
        states[:, 0], states[:, 1], states[:, 3] = roll, approach, speed
        states = states[approach > -eccentric.table.pair.backlash]
        force = laws(eccentric, states)[:, 0]
        assert np.abs(np.diff(force)).max() < 1e9 * step
        first = int(np.argmax(force > 0.0))
        parting += states[first, 1] < -0.5 * eccentric.table.pair.backlash
    assert parting > 0
