"""Data sets of helical pairs: the same engine, channels along the shafts too, faults over part of
the face."""

from pathlib import Path

import numpy as np
import pytest
from small_sets import make

import gensig
from gensig.cli import main
from gensig.dynamics._layout import MOST_PAIRS
from gensig.errors import ConfigError, GeometryError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_record, simulate_records
from gensig.systems.base import simulate_together
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.registry import read_system
from gensig.systems.run import Run

SMALL = (
    "experiment=helical",
    "plan.n_records=10",
    "plan.n_units=2",
    "plan.n_gearboxes=2",
    "operating.duration_s=0.05",
    "mesh.n_slices=16",
    "dataset.store_mesh_state=true",
    "sensing.channels=[pinion_y,pinion_z,wheel_y,wheel_z]",
    "plan.classes=[healthy,crack,pitting,chipped,missing_tooth]",
    "sensing.snr_db=30",
)


@pytest.fixture(scope="module")
def helical(tmp_path_factory) -> Path:
    return make(tmp_path_factory.mktemp("helical") / "set", *SMALL)


def test_a_set_is_whole_and_every_record_is_found_good(
    helical: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(helical)]) == 0
    assert main(["reproduce", str(helical), "--records", "2"]) == 0
    capsys.readouterr()
    with gensig.open_dataset(helical) as data:
        assert tuple(data.channel_names) == (
            "pinion_y",
            "pinion_z",
            "wheel_y",
            "wheel_z",
        )
        assert set(data.column("label_name")) == {
            "healthy",
            "crack",
            "pitting",
            "chipped",
            "missing_tooth",
        }
        assert set(data.column("status")) == {"ok"}
        pair = read_system(read_request(list(SMALL)).config).pair
        ratio = pair.overlap_ratio
        assert data.attributes["overlap_ratio"] == ratio
        told = {
            "helix_angle_deg": 18.0,
            "face_width_wheel_mm": 14.0,
            "overlap_ratio": round(ratio, 4),
        }
        card = (helical / "README.md").read_text().replace("\\", "")
        assert [f"| {name} | {value} |" in card for name, value in told.items()] == [
            True
        ] * 3
        assert set(data.column("integration_check")) == {"error"}
        assert data.column("integration_error").max() <= 1e-3
        level = np.array(
            [np.square(data.signals(k)).mean(axis=1) for k in range(data.n_records)]
        )
        assert (level > 0.0).all()


def test_loads_of_all_pairs_are_told(helical: Path) -> None:
    with gensig.open_dataset(helical) as data:
        for k in range(data.n_records):
            share = data.trace(k, "mesh_load_share")
            assert share.shape == (MOST_PAIRS, data.n_samples)
            np.testing.assert_allclose(share.sum(axis=0), 1.0, rtol=0, atol=1e-6)
            carrying = (data.trace(k, "mesh_pinion_tooth") >= 0).sum(axis=0)
            missing = data.column("label_name")[k] == "missing_tooth"
            assert 2 - missing <= carrying.min() <= carrying.max() <= 5


def test_bits_do_not_depend_on_the_neighbours() -> None:
    config = read_request(
        [*SMALL, "dataset.store_mesh_state=false", "operating.duration_s=0.02"]
    ).config
    plan = make_plan(config)
    rows = [plan.record(place) for place in range(3)]
    for row, together in zip(rows, simulate_records(config, rows), strict=True):
        alone = simulate_record(config, row)
        assert (
            alone.signals["acceleration"].tobytes()
            == together.signals["acceleration"].tobytes()
        )


def test_without_a_helix_it_moves_like_the_spur_pair() -> None:
    words = [
        "operating.duration_s=0.1",
        "mesh.contact=linear",
        "quality.iso1328_grade=null",
        "solver.max_error=null",
    ]
    spur = read_system(read_request(words).config)
    sliced = read_system(
        read_request(
            [*words, "system=helical_pair", "gear=xiamen_23_84", "mesh.n_slices=8"]
        ).config
    )
    one, other = simulate_together(
        [Run(system=system, faults=()) for system in (spur, sliced)]
    )
    scale = one.acceleration.std(axis=1)
    assert np.all(
        np.abs(one.acceleration - other.acceleration).std(axis=1) < 0.01 * scale
    )


def test_an_axial_force_pushes_gears_apart_along_their_shafts() -> None:
    words = [
        "system=helical_pair",
        "operating.duration_s=0.02",
        "sensing.channels=[pinion_z,wheel_z]",
    ]
    dynamics = pair_dynamics(
        Run(system=read_system(read_request(words).config), faults=())
    )
    rest = dict(zip(dynamics.dofs, dynamics.rest(), strict=True))
    thrust = dynamics.mesh_force * np.tan(dynamics.table.pair.base_helix_angle)
    assert rest["pinion_z"] == pytest.approx(
        -thrust / dynamics.pinion.support.stiffness_z, rel=1e-9
    )
    assert rest["wheel_z"] == pytest.approx(
        thrust / dynamics.wheel.support.stiffness_z, rel=1e-9
    )


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (
            ["mesh.slices_in_phase=true"],
            "mesh.slices_in_phase = true is for comparing statics",
        ),
        (["sensing.channels=[pinion_u]"], "no channel pinion_u"),
        (
            ["gear.pinion.support.stiffness_z_n_per_m=-1"],
            "stiffness_z_n_per_m = -1 must not be negative",
        ),
        (
            [
                "gear.helix_angle_deg=2",
                "gear.pinion.face_width_mm=3",
                "gear.addendum_coefficient=0.4",
            ],
            "below 1",
        ),
    ],
)
def test_what_makes_no_records_is_refused(words, complaint) -> None:
    with pytest.raises((ConfigError, GeometryError), match=complaint):
        make_plan(read_request(["system=helical_pair", *words]).config)
