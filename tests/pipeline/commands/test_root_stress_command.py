"""gensig root-stress from the command line: what it writes, and what it refuses in one line."""

import json

import pytest

from gensig.cli import main

PUMP = "gear=engine_pump_drive"


def test_it_writes_what_it_promises(tmp_path, capsys):
    out, figure = tmp_path / "root.json", tmp_path / "root.png"
    assert (
        main(
            [
                "root-stress",
                PUMP,
                "--stress",
                "349.39",
                "--json",
                str(out),
                "--plot",
                str(figure),
            ]
        )
        == 0
    )
    content = json.loads(out.read_text())
    assert content["decisive_gear"] == "wheel"
    assert content["form_factor"] == pytest.approx(1.167, abs=6e-4)
    assert content["stress_correction_factor"] == pytest.approx(2.141, abs=6e-4)
    assert content["tangential_force_n"] == pytest.approx(8393, abs=1)
    assert content["torque_nm"] == pytest.approx(680, abs=1)
    assert content["iso_root_stress_mpa"] == pytest.approx(349.39)
    assert (
        content["safety_factor_paper"],
        content["safety_factor_iso"],
    ) == pytest.approx((1.353, 2.7), rel=0.02)
    assert content["reliability_paper"] == "general"
    assert content["tangential_force_over_mesh_n"] > content["tangential_force_n"]
    assert (
        len(content["root_stress_mpa"])
        == len(content["roll_angle_deg"])
        == len(content["load_share"])
        > 300
    )
    assert (
        content["largest_root_stress_mpa"] == max(content["root_stress_mpa"]) < 349.39
    )
    assert content["root_stress_mpa"] == content["gears"]["wheel"]["root_stress_mpa"]
    assert (
        content["gears"]["pinion"]["safety_factor_paper"]
        > content["safety_factor_paper"]
    )
    assert content["roll_angle_deg"] == sorted(content["roll_angle_deg"])
    assert content["strength"]["bending_limit_mpa"] == pytest.approx(525.25)
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert "8393.1 N" in capsys.readouterr().out


def test_a_helical_pair_and_an_option_of_ones_own(tmp_path, capsys):
    mine = tmp_path / "mine" / "strength"
    mine.mkdir(parents=True)
    out = tmp_path / "root.json"
    words = ["system=helical_pair", "mesh.n_slices=8"]
    assert main(["root-stress", *words, "--json", str(out)]) == 0
    before = json.loads(out.read_text())
    assert before["overlap_ratio"] > 1.0
    assert before["load_distribution_factor"] < 1.0
    assert before["helix_factor"] < 1.0
    lines = ["bending_limit_mpa: 430", "name: soft"]
    option = "defaults:\n  - 18cr2ni4w\n  - _self_\n" + "\n".join(lines) + "\n"
    (mine / "soft.yaml").write_text(option)
    assert (
        main(
            [
                "root-stress",
                *words,
                "strength=soft",
                "--config-dir",
                str(mine.parent),
                "--json",
                str(out),
            ]
        )
        == 0
    )
    after = json.loads(out.read_text())
    assert after["safety_factor_iso"] == pytest.approx(
        before["safety_factor_iso"] * 430 / 525.25
    )
    assert "sigma_Flim 430 MPa" in capsys.readouterr().out


def test_strength_is_no_draw(capsys):
    vary = "plan.vary={strength.bending_limit_mpa: {distribution: uniform, low: 400, high: 500}}"
    assert main(["plan", vary]) == 2
    assert "is one value for a whole data set" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["fault=crack"], "root stress is that of sound teeth"),
        (["--plot", "root.txt"], "the name must end in .png"),
        (["--stress", "-1"], "give a positive one"),
        (["--stress", "nan"], "give a positive one"),
        (["--stress", "much"], "--stress much is not a number"),
        (["operating.torque_nm=0"], "operating.torque_nm = 0 must be positive"),
        (["operating.torque_nm=-5", "system=helical_pair"], "must be positive"),
        (
            ["strength.bending_limit_mpa=0"],
            "strength.bending_limit_mpa = 0 must be positive",
        ),
        (["strength.bending_limit_mpa=steel"], "is not a number"),
        (["strength.load_point=middle"], "allowed: outer_single_pair, tip"),
        (["strength.edition=2001"], "allowed: 2019, 2006"),
        (["strength.bending_limit_gpa=1"], "strength.bending_limit_gpa"),
        (["strength=wood"], "18cr2ni4w"),
        (["gear.pinion.bore_radius_mm=20"], "the rim between bore and root"),
        (["gear=beihang_61_132"], "system=helical_pair"),
    ],
)
def test_mistakes_are_one_line(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["root-stress", *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
