"""Maps of diagnose detectability on simulated machines: laws, agreement with data sets."""

import json
import pickle
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import gensig
import gensig.record.inputs
from diagnose.cli import main
from diagnose.detectability.figure import detectability_figure, fault_text
from diagnose.detectability.maps import (
    best_and_worst,
    look_at,
    make_maps,
    read_bandwidths,
)
from gensig.errors import FaultError, GensigError, SimulationError
from gensig.plan.request import read_request
from gensig.production.fault_pairs import make_pairs
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record

SMALL = ("operating.duration_s=0.1", "sensing.channels=[pinion_y]")
BANDS = (1000.0, 5000.0, 25600.0)
FOUR_CELLS = {"speeds": (900.0, 1800.0), "torques": (10.0, 20.0)}


def pairs_of(*overrides, speeds=(1800.0,), torques=(20.0,), n_units=4, **more):
    """Pairs of records with and without a crack, or another fault."""
    return gensig.fault_pairs(
        *SMALL,
        "fault=crack",
        *overrides,
        speeds_rpm=speeds,
        torques_nm=torques,
        n_units=n_units,
        **more,
    )


def maps_of(*overrides, **more):
    pairs = pairs_of(*overrides, **more)
    return make_maps(pairs, BANDS, n_workers=1, on_done=lambda _: None)


@pytest.fixture(scope="module")
def crack():
    return maps_of(**FOUR_CELLS)


@pytest.fixture(scope="module")
def single():
    """The map of a single cell; a larger one draws other starts."""
    return maps_of()


def test_no_fault_is_not_there_and_not_seen(tmp_path):
    maps = maps_of("plan.sham=true")
    assert (maps.known == 0.0).all()
    assert (maps.seen == 0.0).all()
    assert (maps.auroc == 0.5).all()
    detectability_figure(tmp_path / "nothing.svg", maps)
    assert "Physically there" in (tmp_path / "nothing.svg").read_text()


def test_the_figure_names_the_best_test(crack, tmp_path):
    detectability_figure(tmp_path / "maps.svg", crack)
    text = (tmp_path / "maps.svg").read_text()
    tests = set()
    for values in (crack.known, crack.seen):
        *_, band = np.unravel_index(np.nanargmax(values), values.shape)
        tests.add(f"best: pinion_y, up to {BANDS[band] / 1e3:.3g} kHz")
        assert np.nanmin(values[..., band]) > np.nanmin(values)  # the worst is another
    assert set(re.findall(r"best: pinion_y, up to \S+ kHz", text)) == tests
    across_and_up = re.findall(r"<!-- (10|20|900|1800) -->", text)[:4]
    assert across_and_up == ["10", "20", "900", "1800"]


def test_a_fault_of_no_size_is_refused():
    with pytest.raises(FaultError, match="crack_depth_mm = 0"):
        pairs_of("fault.crack_depth_mm=0")


def test_half_the_noise_doubles_the_distance(single):
    quieter = maps_of(f"sensing.snr_db={20.0 + float(20.0 * np.log10(2.0))!r}")
    assert_allclose(quieter.known, 2.0 * single.known, rtol=1e-9, atol=0)


def test_it_grows_with_the_fault(single):
    depths = [
        maps_of(f"fault.crack_depth_mm={depth}").known for depth in (0.5, 2.0, 3.0)
    ]
    missing = maps_of("fault=missing_tooth").known
    result = np.stack([depths[0], single.known, *depths[1:], missing])
    assert (np.diff(result, axis=0) > 0.0).all()


def test_more_bandwidth_never_tells_less(crack):
    assert (np.diff(crack.known, axis=-1) >= 0.0).all()
    assert (crack.known_band <= crack.known).all()


def test_it_grows_with_the_root_of_the_duration():
    """Except for differences of turns of the same motion: one and four of the wheel."""
    short, long = (
        maps_of(f"operating.duration_s={84 / 23 / 30 * n!r}") for n in (1, 4)
    )
    assert_allclose(long.known[..., -1], 2.0 * short.known[..., -1], rtol=0.05, atol=0)


def test_it_is_what_a_data_set_stores():
    pairs = pairs_of(speeds=(900.0, 1800.0))
    row = pairs.rows[4 + 2]
    config = pairs.config.with_keys("dataset", store_detectability=True)
    start = InputReader(config).inputs(row).healthy_twin().run.start
    begin = {
        "start_tooth_pinion": start.tooth_pinion,
        "start_tooth_wheel": start.tooth_wheel,
        "start_phase": start.phase,
    }
    record = simulate_record(InputReader(config), {**row, **begin})
    cell = pairs.cell(1)
    power = cell.noise_power[2]
    result = np.sqrt(np.sum(cell.residual[2] ** 2) / power[0])
    assert result == pytest.approx(record.values["detectability"], rel=1e-12)
    stored = record.signals["acceleration"]
    assert_array_equal(cell.faulty[2].astype(np.float32), stored)
    assert_allclose(power, record.signals["noise_power"], rtol=1e-12, atol=0)


def test_both_of_a_pair_have_the_same_noise_and_other_machines_another():
    cell = pairs_of().cell(0)
    scale = np.abs(cell.sound).max()
    assert_allclose(cell.faulty - cell.sound, cell.residual, rtol=0, atol=1e-12 * scale)
    assert len({signal.tobytes() for signal in cell.sound - cell.sound[0]}) == 4


def test_noise_of_the_set_point_is_the_same_everywhere(crack):
    fixed = maps_of(fixed_noise=True, **FOUR_CELLS)
    assert np.ptp(fixed.noise_rms) == 0.0
    assert np.ptp(crack.noise_rms) > 0.0
    # the residual is the same, so that d' times the noise is; both are medians over machines
    products = [maps.known[..., -1] * maps.noise_rms for maps in (fixed, crack)]
    assert_allclose(*products, rtol=0.1, atol=0)


def test_coloured_noise_counts_where_it_is(single):
    """White noise as a list of parts is white noise; pink noise leaves high frequencies clear."""
    in_parts = maps_of(
        "sensing.noise.parts=[{kind:white,share:1}]",
        "sensing.noise.band_hz=[1,25600]",
    )
    assert_allclose(in_parts.known[..., -1], single.known[..., -1], rtol=0.05, atol=0)
    pink = maps_of("sensing.noise.parts=[{kind:pink,share:1,lowest_hz:5}]")
    assert (pink.known_band[..., -1] > 1.5 * single.known_band[..., -1]).all()
    assert (pink.known_band[..., 0] < single.known_band[..., 0]).all()


def test_a_cell_of_another_process_has_the_same_bits(crack):
    """A process of its own gets a copy of the pairs and looks at its cells in any order."""
    pairs = pickle.loads(pickle.dumps(pairs_of(**FOUR_CELLS)))
    cell = look_at(pairs, BANDS, 3)
    seen = cell.seen | {"seen": cell.seen["d_prime"]}
    for name in ("seen", "standard_error", "auroc", "indicator", "raises"):
        assert seen[name].tobytes() == getattr(crack, name)[1, 1].tobytes()
    known = np.median(np.sqrt(np.cumsum(cell.energy, axis=-1)), axis=0)
    assert_array_equal(known, crack.known[1, 1])


@pytest.mark.parametrize(
    ("words", "n_gearboxes"), [((), 4), (("plan.n_gearboxes=1",), 1)]
)
def test_every_machine_has_its_gearbox_unless_the_plan_says_how_many(
    words, n_gearboxes
):
    rows = pairs_of(*words).rows
    assert len({row["gearbox_id"] for row in rows}) == n_gearboxes
    assert len({row["specimen_id"] for row in rows}) == 4


def test_without_numbers_the_map_is_about_the_set_point():
    words = ("operating.speed_rpm=1000", "operating.torque_nm=8")
    pairs = pairs_of(*words, speeds=None, torques=None)
    assert pairs.speeds_rpm == (250.0, 500.0, 1000.0, 1500.0, 2000.0)
    assert pairs.torques_nm == (2.0, 4.0, 8.0, 16.0)
    assert read_bandwidths(None, pairs) == (1000.0, 2000.0, 5000.0, 10000.0, 20000.0)


def test_a_motion_that_does_not_stay_finite_is_left_out_and_counted(monkeypatch):
    simulate = gensig.record.inputs.simulate_with_lead_in

    def failing(runs):
        results = simulate(runs)
        # the second machine with its fault
        results[len(runs) // 2 + 1] = SimulationError("it did not stay finite")
        return results

    monkeypatch.setattr(gensig.record.inputs, "simulate_with_lead_in", failing)
    pairs = pairs_of(n_units=5)
    cell = pairs.cell(0)
    failed = np.isnan(cell.residual).all(axis=(1, 2))
    assert failed.tolist() == [False, True, False, False, False]
    maps = make_maps(pairs, BANDS, n_workers=1, on_done=lambda _: None)
    assert maps.n_failed == 1
    left = np.sum(cell.residual**2, axis=-1)[~failed] / cell.noise_power[~failed]
    assert maps.known[0, 0, 0, -1] == pytest.approx(np.median(np.sqrt(left)))
    assert np.isfinite(maps.seen).all()


def test_turns_and_random_walks_follow_the_plan():
    pairs = gensig.fault_pairs(
        *SMALL[1:],
        "fault=crack",
        "operating=drifting",
        "operating.turns=3",
        speeds_rpm=[600, 1800],
        torques_nm=[20],
        n_units=4,
    )
    assert pairs.duration > 3 * 60.0 / 600.0
    assert len({row["params/operating.course_seed"] for row in pairs.rows}) == 8


def test_the_command_writes_everything(tmp_path, capsys):
    table, figure = tmp_path / "map.json", tmp_path / "map.png"
    typed = (
        "--speeds 900 1800 --torques 20 sensing.snr_db=15 --bandwidths 2000 20000 "
        f"--n-units 4 --workers 1 --json {table} --plot {figure}"
    )
    words = ["detectability", "fault=missing_tooth", *SMALL, *typed.split()]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    result = json.loads(table.read_text())
    best, tests = result["best_seen"], result["tests"]
    assert result["summary"] == lines
    assert result["fault"]["kind"] == "missing_tooth"
    assert len(tests) == 2 * 1 * 1 * 2
    speed = max(tests, key=lambda test: test["d_prime_known"])["speed_rpm"]
    assert f"best at {speed:g} r/min, 20 N m, pinion_y, up to 20 kHz" in lines[1]
    assert best["d_prime_seen"] == max(test["d_prime_seen"] for test in tests)
    assert f"(on 4 others {best['d_prime_on_others']:.2f} +- " in lines[0]
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_a_fault_is_named_with_its_sizes():
    crack = {
        "kind": "crack",
        "gear": "pinion",
        "tooth": 3,
        "crack_depth_mm": 1.5,
        "crack_start": "arc_mid",
    }
    missing = {"kind": "missing_tooth", "gear": "wheel", "tooth": 0}
    text = fault_text({"kind": "compound", "parts": [crack, missing]})
    assert (
        text
        == "crack on the pinion (crack depth 1.5 mm) and missing tooth on the wheel"
    )
    assert fault_text(missing) == "missing tooth on the wheel"


def test_a_map_without_any_value_is_refused():
    with pytest.raises(GensigError, match="no pair"):
        best_and_worst(np.full((2, 2), np.nan))


def test_pairs_take_a_composed_configuration():
    config = read_request([*SMALL, "fault=crack"]).config
    before = json.dumps(config.plain())
    make_pairs(config, speeds_rpm=[1800], torques_nm=[20], n_units=4)
    assert json.dumps(config.plain()) == before
