"""The maps of diagnose detectability on simulated machines: laws, agreement with data sets, and bad input."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import gensig
import gensig.record.inputs
from diagnose.cli import main
from diagnose.detectability.figure import detectability_figure, fault_text
from diagnose.detectability.maps import best_and_worst, make_maps, read_bandwidths
from gensig.errors import GensigError, SimulationError
from gensig.plan.request import read_request
from gensig.production.fault_pairs import make_pairs
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record

SMALL = ("operating.duration_s=0.1", "sensing.channels=[pinion_y]")
BANDS = (1000.0, 5000.0, 25600.0)


def maps_of(
    *overrides: str, speeds=(1800.0,), torques=(20.0,), n_workers: int = 1, **more
):
    pairs = gensig.fault_pairs(
        *SMALL, *overrides, speeds_rpm=speeds, torques_nm=torques, n_units=4, **more
    )
    return make_maps(pairs, BANDS, n_workers=n_workers, on_done=lambda _text: None)


@pytest.fixture(scope="module")
def crack():
    return maps_of("fault=crack", speeds=(900.0, 1800.0), torques=(10.0, 20.0))


@pytest.fixture(scope="module")
def one():
    """The map of a single cell; a larger one draws other starts."""
    return maps_of("fault=crack")


@pytest.mark.parametrize(
    "control",
    [("fault=crack", "plan.sham=true"), ("fault=crack", "fault.crack_depth_mm=0")],
)
def test_no_fault_is_not_there_and_not_seen(
    control: tuple[str, ...], tmp_path: Path
) -> None:
    maps = maps_of(*control)
    assert (maps.known == 0.0).all()
    assert (maps.seen == 0.0).all()
    assert (maps.auroc == 0.5).all()
    detectability_figure(tmp_path / "nothing.svg", maps)
    assert "Physically there" in (tmp_path / "nothing.svg").read_text()


def test_less_noise_tells_more(one) -> None:
    """As many times as its amplitude is smaller."""
    quieter = maps_of(
        "fault=crack", f"sensing.snr_db={20.0 + float(20.0 * np.log10(2.0))!r}"
    )
    assert_allclose(quieter.known, 2.0 * one.known, rtol=1e-9, atol=0)


def test_it_grows_with_the_fault(one) -> None:
    found = [
        maps_of("fault=crack", f"fault.crack_depth_mm={depth}").known
        for depth in (0.5, 2.0, 3.0)
    ]
    found = [found[0], one.known, *found[1:], maps_of("fault=missing_tooth").known]
    assert (np.diff(np.stack(found), axis=0) > 0.0).all()


def test_more_bandwidth_never_tells_less(crack) -> None:
    assert (np.diff(crack.known, axis=-1) >= 0.0).all()
    assert (crack.known_band <= crack.known).all()


def test_it_grows_with_the_root_of_the_duration() -> None:
    """But for what turns of the same motion differ by: one and four of the wheel."""
    short, long = (
        maps_of("fault=crack", f"operating.duration_s={84 / 23 / 30 * n!r}")
        for n in (1, 4)
    )
    assert_allclose(long.known[..., -1], 2.0 * short.known[..., -1], rtol=0.05, atol=0)


def test_it_is_what_a_data_set_stores() -> None:
    pairs = gensig.fault_pairs(
        *SMALL, "fault=crack", speeds_rpm=[900, 1800], torques_nm=[20], n_units=4
    )
    row = pairs.rows[4 + 2]
    config = pairs.config.with_keys("dataset", store_detectability=True)
    start = InputReader(config).inputs(row).healthy_twin().run.start
    begin = {
        "start_tooth_pinion": start.tooth_pinion,
        "start_tooth_wheel": start.tooth_wheel,
    }
    record = simulate_record(config, {**row, **begin, "start_phase": start.phase})
    cell = pairs.cell(1)
    found = np.sqrt(np.sum(cell.residual[2] ** 2) / cell.noise_power[2, 0])
    assert found == pytest.approx(record.values["detectability"], rel=1e-12)
    assert_allclose(
        cell.faulty[2].astype(np.float32),
        record.signals["acceleration"],
        rtol=0,
        atol=0,
    )
    assert_allclose(
        cell.noise_power[2], record.signals["noise_power"], rtol=1e-12, atol=0
    )


def test_both_of_a_pair_have_the_same_noise() -> None:
    cell = gensig.fault_pairs(
        *SMALL, "fault=crack", speeds_rpm=[1800], torques_nm=[20], n_units=4
    ).cell(0)
    scale = np.abs(cell.sound).max()
    assert_allclose(cell.faulty - cell.sound, cell.residual, rtol=0, atol=1e-12 * scale)
    assert (
        len({one.tobytes() for one in cell.sound - cell.sound[0]}) == 4
    )  # other machines have another


def test_noise_of_the_set_point_is_the_same_everywhere(crack) -> None:
    fixed = maps_of(
        "fault=crack", speeds=(900.0, 1800.0), torques=(10.0, 20.0), fixed_noise=True
    )
    assert np.ptp(fixed.noise_rms) == 0.0
    assert np.ptp(crack.noise_rms) > 0.0
    # the residual is the same, so that the one's d' times its noise is the other's; both are medians over machines
    products = [maps.known[..., -1] * maps.noise_rms for maps in (fixed, crack)]
    assert_allclose(*products, rtol=0.1, atol=0)


def test_coloured_noise_counts_where_it_is() -> None:
    """White noise named as a list of parts has the density of white noise; pink leaves high frequencies clear."""
    white = maps_of("fault=crack")
    in_parts = maps_of(
        "fault=crack",
        "sensing.noise.parts=[{kind:white,share:1}]",
        "sensing.noise.band_hz=[1,25600]",
    )
    assert_allclose(in_parts.known[..., -1], white.known[..., -1], rtol=0.05, atol=0)
    pink = maps_of(
        "fault=crack", "sensing.noise.parts=[{kind:pink,share:1,lowest_hz:5}]"
    )
    assert (pink.known_band[..., -1] > 1.5 * white.known_band[..., -1]).all()
    assert (pink.known_band[..., 0] < white.known_band[..., 0]).all()


def test_workers_do_not_change_the_bits(crack) -> None:
    again = maps_of(
        "fault=crack", speeds=(900.0, 1800.0), torques=(10.0, 20.0), n_workers=2
    )
    for name in (
        "known",
        "known_band",
        "seen",
        "standard_error",
        "auroc",
        "indicator",
        "noise_rms",
    ):
        assert getattr(again, name).tobytes() == getattr(crack, name).tobytes()


def test_other_machines_are_others() -> None:
    cells = [
        gensig.fault_pairs(
            *SMALL,
            "fault=crack",
            speeds_rpm=[1800],
            torques_nm=[20],
            n_units=4,
            epoch=epoch,
        ).cell(0)
        for epoch in (0, 1)
    ]
    assert not np.isin(cells[0].sound, cells[1].sound).any()


def test_every_machine_has_its_own_gearbox_unless_the_plan_says_how_many() -> None:
    own, shared = (
        gensig.fault_pairs(
            *SMALL, "fault=crack", *words, speeds_rpm=[1800], torques_nm=[20], n_units=4
        ).rows
        for words in ((), ("plan.n_gearboxes=1",))
    )
    assert len({row["gearbox_id"] for row in own}) == 4
    assert len({row["gearbox_id"] for row in shared}) == 1
    assert all(len({row["specimen_id"] for row in rows}) == 4 for rows in (own, shared))


def test_without_numbers_the_map_is_about_the_set_point() -> None:
    pairs = gensig.fault_pairs(
        *SMALL, "fault=crack", "operating.speed_rpm=1000", "operating.torque_nm=8"
    )
    assert pairs.speeds_rpm == (250.0, 500.0, 1000.0, 1500.0, 2000.0)
    assert pairs.torques_nm == (2.0, 4.0, 8.0, 16.0)
    assert read_bandwidths(None, pairs) == (1000.0, 2000.0, 5000.0, 10000.0, 20000.0)


def test_a_motion_that_does_not_stay_finite_is_left_out_and_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    simulate = gensig.record.inputs.simulate_with_lead_in

    def one_fails(runs):
        results = simulate(runs)
        results[len(runs) // 2 + 1] = SimulationError(
            "it did not stay finite"
        )  # the second machine with its fault
        return results

    monkeypatch.setattr(gensig.record.inputs, "simulate_with_lead_in", one_fails)
    pairs = gensig.fault_pairs(
        *SMALL, "fault=crack", speeds_rpm=[1800], torques_nm=[20], n_units=5
    )
    cell = pairs.cell(0)
    assert np.isnan(cell.residual).all(axis=(1, 2)).tolist() == [
        False,
        True,
        False,
        False,
        False,
    ]
    maps = make_maps(pairs, BANDS, n_workers=1, on_done=lambda _text: None)
    assert maps.n_failed == 1
    left = np.delete(np.sum(cell.residual**2, axis=-1) / cell.noise_power, 1, axis=0)
    assert maps.known[0, 0, 0, -1] == pytest.approx(np.median(np.sqrt(left)))
    assert np.isfinite(maps.seen).all()


def test_turns_and_random_walks_follow_the_plan() -> None:
    pairs = gensig.fault_pairs(
        "sensing.channels=[pinion_y]", "fault=crack", "operating=drifting", "operating.turns=3",
        speeds_rpm=[600, 1800], torques_nm=[20], n_units=4,
    )  # fmt: skip
    assert pairs.duration > 3 * 60.0 / 600.0
    assert len({row["params/operating.course_seed"] for row in pairs.rows}) == 8


def test_the_command_writes_everything(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, figure = tmp_path / "map.json", tmp_path / "map.png"
    words = [
        "fault=missing_tooth",
        *SMALL,
        "--speeds",
        "900",
        "1800",
        "--torques",
        "20",
        "sensing.snr_db=15",
    ]
    flags = ["--bandwidths", "2000", "20000", "--n-units", "4", "--workers", "1"]
    assert (
        main(
            [
                "detectability",
                *words,
                *flags,
                "--json",
                str(table),
                "--plot",
                str(figure),
            ]
        )
        == 0
    )
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    found = json.loads(table.read_text())
    assert found["summary"] == lines
    assert found["fault"]["kind"] == "missing_tooth"
    assert len(found["tests"]) == 2 * 1 * 1 * 2
    best = max(found["tests"], key=lambda test: test["d_prime_known"])
    assert (
        f"best at {best['speed_rpm']:g} r/min, 20 N m, pinion_y, up to 20 kHz"
        in lines[1]
    )
    assert found["best_seen"]["d_prime_seen"] == max(
        test["d_prime_seen"] for test in found["tests"]
    )
    assert f"(on 4 others {found['best_seen']['d_prime_on_others']:.2f} +- " in lines[0]
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_a_fault_is_named_with_its_sizes() -> None:
    crack = {
        "kind": "crack",
        "gear": "pinion",
        "tooth": 3,
        "crack_depth_mm": 1.5,
        "crack_start": "arc_mid",
    }
    assert fault_text(crack) == "crack on the pinion (crack depth 1.5 mm)"
    missing = {"kind": "missing_tooth", "gear": "wheel", "tooth": 0}
    assert fault_text(missing) == "missing tooth on the wheel"
    assert (
        fault_text({"kind": "compound", "parts": [crack, missing]}).count(" and ") == 1
    )


def test_a_map_without_any_value_is_refused() -> None:
    with pytest.raises(GensigError, match="no pair"):
        best_and_worst(np.full((2, 2), np.nan))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "fault=healthy: there is nothing to find"),
        (["fault=crack", "sensing.snr_db=null"], "sensing.snr_db = null"),
        (["fault=crack", "sensing.snr_reference=record"], "use healthy_twin"),
        (["fault=crack", "--n-units", "3"], "must be a whole number of at least 4"),
        (
            ["fault=crack", "--speeds", "900", "900"],
            "speeds in r/min: 900, 900; give positive numbers, each once",
        ),
        (
            ["fault=crack", "--torques", "-5"],
            "torques in N m: -5; give positive numbers",
        ),
        (["fault=crack", "--torques", "0"], "torques in N m: 0; give positive numbers"),
        (["fault=crack", "--speeds", "fast"], "--speeds fast: give numbers"),
        (
            ["fault=crack", "--speeds", *map(str, range(100, 501))],
            "more than 400 cells",
        ),
        (
            ["fault=crack", "--bandwidths", "30000"],
            "from 10 to half the sampling rate, 25600",
        ),
        (["fault=crack", "--workers", "0"], "--workers 0 must be at least 1"),
        (
            ["fault=crack", "--plot", "map.txt"],
            "--plot map.txt: the name must end in .png",
        ),
        (["fault=crack", "--json", "nowhere/map.json"], "there is no folder nowhere"),
        (["fault=crak"], "no option 'crak' of fault"),
        (["fault=crack", "plan.n_gearboxes=0"], "plan.n_gearboxes = 0"),
    ],
)
def test_a_mistake_is_one_line(
    words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["detectability", *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_pairs_take_a_composed_configuration() -> None:
    config = read_request([*SMALL, "fault=crack"]).config
    before = json.dumps(config.plain())
    make_pairs(config, speeds_rpm=[1800], torques_nm=[20], n_units=4)
    assert json.dumps(config.plain()) == before
