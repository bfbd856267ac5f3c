"""Hot gears from the command line: what is told, and what is refused in one line."""

import json

import pytest

from gensig.cli import main

HOT = [
    "system=helical_pair", "gear=chongqing_40_162", "heat=chongqing_rated", "mesh.n_slices=12",
    "mesh.slice_coupling=independent", "mesh.contact=linear",
]  # fmt: skip


def test_stiffness_tells_every_effect_for_itself(tmp_path, capsys):
    out, figure = tmp_path / "s.json", tmp_path / "s.png"
    assert main(["stiffness", *HOT, "--json", str(out), "--plot", str(figure)]) == 0
    content, text = json.loads(out.read_text()), capsys.readouterr().out
    heat = content["heat"]
    assert list(heat["variants"]) == [
        "cold",
        "true",
        "contact_ratio",
        "apparent",
        "softened",
    ]
    mean = {
        name: one["mesh_stiffness_mean_n_per_m"]
        for name, one in heat["variants"].items()
    }
    assert mean["softened"] < mean["cold"] < mean["contact_ratio"] < mean["apparent"]
    assert (
        heat["bulk"]["pinion"]["tooth_temperature_degc"]
        > heat["bulk"]["wheel"]["tooth_temperature_degc"]
        > 60
    )
    assert heat["friction_heat_w"] == pytest.approx(
        heat["bulk"]["pinion"]["heat_w"] + heat["bulk"]["wheel"]["heat_w"], rel=1e-12
    )
    assert len(heat["flash_temperature_k"]) == len(heat["flash_contact_position"])
    for name in (
        "true stiffness",
        "with contact-ratio change",
        "apparent",
        "with E(T)",
        "flash temperature",
    ):
        assert name in text
    assert f"{mean['softened']:.4e} N/m" in text
    assert figure.read_bytes().startswith(b"\x89PNG")
    # the curves above are those of the pair with all effects
    assert (
        content["transverse_contact_ratio"]
        == heat["variants"]["contact_ratio"]["transverse_contact_ratio"]
    )


def test_effects_are_switched_one_by_one(tmp_path, capsys):
    out = tmp_path / "s.json"
    assert (
        main(
            [
                "stiffness",
                *HOT,
                "heat.growth=false",
                "heat.center_distance=false",
                "--json",
                str(out),
            ]
        )
        == 0
    )
    heat = json.loads(out.read_text())["heat"]
    assert list(heat["variants"]) == ["cold", "softened"]
    assert "true stiffness" not in capsys.readouterr().out
    assert main(["stiffness", *HOT, "heat=none", "--json", str(out)]) == 0
    assert "heat" not in json.loads(out.read_text())
    assert "friction heat" not in capsys.readouterr().out


def test_growth_beyond_the_approach_has_no_apparent_stiffness(capsys):
    warm = [
        "heat.pinion_temperature_degc=110",
        "heat.wheel_temperature_degc=110",
        "heat.housing_temperature_degc=110",
    ]
    assert main(["stiffness", *HOT, *warm]) == 0
    assert "none: teeth grow" in capsys.readouterr().out


def test_transmission_error_is_that_of_hot_flanks(tmp_path, capsys):
    out, errors = tmp_path / "te.json", {}
    for heat in ("none", "chongqing_rated"):
        assert (
            main(
                [
                    "transmission-error",
                    *HOT[:-4],
                    *HOT[-3:],
                    f"heat={heat}",
                    "--json",
                    str(out),
                ]
            )
            == 0
        )
        errors[heat] = json.loads(out.read_text())
    assert (
        errors["chongqing_rated"]["transverse_contact_ratio"]
        > errors["none"]["transverse_contact_ratio"]
    )
    assert errors["chongqing_rated"]["mean_um"] != pytest.approx(
        errors["none"]["mean_um"], rel=1e-3
    )
    capsys.readouterr()
    unequal = [
        "heat.pinion_temperature_degc=140",
        "heat.wheel_temperature_degc=60",
        "heat.center_distance=false",
    ]
    assert main(["transmission-error", *HOT, *unequal]) == 0
    assert "unequal growth of hot gears" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["stiffness", "heat=chongqing_rated"],
            "heat: system=spur_pair has gears as they are drawn",
        ),
        (
            ["simulate", "heat=chongqing_rated"],
            "heat: system=spur_pair has gears as they are drawn",
        ),
        (
            ["stiffness", *HOT, "heat.pinion_temperature_degc=400"],
            "beyond the material's data, -75 to 300 degrees",
        ),
        (
            ["stiffness", *HOT, "mesh.friction_coefficient=0.5"],
            "beyond the material's data, -75 to 300 degrees",
        ),
        (["stiffness", *HOT, "heat.housing_temperature_degc=0"], "the gears jam"),
        (
            [
                "plan",
                "plan.vary={heat.oil_temperature_degc:{distribution:uniform,low:20,high:60}}",
            ],
            "'heat.oil_temperature_degc' is one value for a whole data set",
        ),
    ],
)
def test_mistakes_are_one_line(words, message, capsys):
    assert main(words) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
