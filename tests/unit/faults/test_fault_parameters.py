"""Faults from boundary keys, refusals, and severity."""

import math

import pytest
import yaml
from fault_cases import KINDS, one, option, side_of
from numpy.testing import assert_allclose
from refusals import refused

from gensig.errors import ConfigError, FaultError, GensigError
from gensig.faults.base import faulty_teeth
from gensig.faults.broken import MissingTooth
from gensig.faults.registry import COMPOUND, FAULTS, fault_parts, read_faults
from gensig.options.groups import options
from gensig.systems.pair_machine import severity

CRACK, PIT, MISSING = (
    {**option(kind), "tooth": 3} for kind in ("crack", "pitting", "missing_tooth")
)


def typed(words):
    """A fault from its kind and the keys typed after it."""
    kind, *pairs = words.split()
    return one(
        kind,
        **{k: yaml.safe_load(v) for k, v in (p.split("=") for p in pairs)},
    )


class TestReading:
    def test_units_are_converted(self):
        crack = one("crack")
        assert type(crack) is FAULTS["crack"]

        angle = pytest.approx(math.pi / 4)
        assert (crack.crack_depth, crack.crack_angle) == (pytest.approx(1e-3), angle)
        assert one("pitting").pit_position is None
        assert_allclose(one("wear").wear_depth, 20e-6)
        assert one("wear").wear_profile == (1.0, 0.7, 0.4, 0.2, 0.4, 0.7, 1.0)

    def test_a_crack_of_three_keys_is_the_papers(self):
        """The keys of the first format: through, straight, open, on the tension side."""
        first_format = ("crack_depth_mm", "crack_angle_deg", "crack_start")
        short = {key: CRACK[key] for key in ("kind", "gear", "tooth", *first_format)}
        assert read_faults(short) == read_faults(CRACK)

    def test_healthy_and_vary_are_no_fault(self):
        assert read_faults({"kind": "healthy", "vary": {}}) == ()
        varied = {
            **CRACK,
            "vary": {"tooth": {"distribution": "tooth"}},
        }
        assert read_faults(varied) == read_faults(CRACK)

    @pytest.mark.parametrize(
        "kind",
        ["crak", None, 3],
    )
    def test_unknown_kinds_list_the_known(self, kind):
        with pytest.raises(FaultError) as caught:
            read_faults({"kind": kind})
        allowed = f"healthy, compound, {', '.join(FAULTS)}"
        assert str(caught.value) == f"fault.kind = {kind!r}; allowed: {allowed}"

    def test_every_kind_has_an_option_and_every_option_a_kind(self):
        assert set(options("fault")) == {*FAULTS, COMPOUND, "healthy"}
        assert all(option(kind)["kind"] == kind for kind in FAULTS)

    @pytest.mark.parametrize("kind", KINDS)
    def test_missing_keys_are_named(self, kind):
        with pytest.raises(ConfigError, match=r"fault: missing .*gear.*tooth"):
            read_faults({"kind": kind})


class TestCompound:
    def test_parts_in_order(self):
        parts = [CRACK, PIT, {**MISSING, "gear": "wheel"}]
        faults = read_faults({"kind": "compound", "parts": parts, "vary": {}})
        assert faults == tuple(read_faults(part)[0] for part in parts)

    def test_parts_of_a_single_fault_are_itself(self):
        assert fault_parts(CRACK) == [CRACK]
        assert fault_parts({"kind": "healthy"}) == []

    @pytest.mark.parametrize(
        ("values", "text"),
        [
            ({}, "fault.parts = None must be a list of faults, each with its kind"),
            ({"parts": []}, "fault.parts = [] must be a list of faults"),
            ({"parts": ["crack"]}, "fault.parts = ['crack'] must be a list of faults"),
            ({"parts": CRACK}, "must be a list of faults"),
            ({"parts": [CRACK, "pitting"]}, "must be a list of faults"),
            ({"parts": [CRACK, {"kind": "crak"}]}, "parts.1.kind = 'crak'; allowed: "),
            ({"parts": [CRACK, {}]}, "fault.parts.1.kind = None; allowed: crack, "),
            ({"parts": [{"kind": COMPOUND}]}, "fault.parts.0.kind = 'compound'"),
            (
                {"parts": [PIT, {**CRACK, "crack_dept_mm": 1}]},
                "fault.parts.1: unknown key 'crack_dept_mm'; did you mean 'crack_depth_mm'?",
            ),
            (
                {"parts": [PIT, {**CRACK, "crack_depth_mm": "x"}]},
                "fault.parts.1.crack_depth_mm = 'x' is not a number",
            ),
            (
                {"parts": [PIT], "tooth": 3},
                "fault: unknown key 'tooth'; a compound fault has parts",
            ),
        ],
    )
    def test_mistakes(self, values, text):
        with refused(text, GensigError):
            read_faults({"kind": "compound", **values})


NOT_NEGATIVE = {
    "crack": ["crack_depth_mm"],
    "pitting": [
        "pit_width_mm",
        "pit_length_mm",
        "pit_depth_mm",
        "pit_edge_height_um",
        "pit_edge_width_mm",
    ],
    "spalling": [
        "spall_width_mm",
        "spall_length_mm",
        "spall_depth_mm",
        "spall_edge_height_um",
        "spall_edge_width_mm",
    ],
    "distributed_pitting": [
        "region_low",
        "pit_seed",
        "pit_edge_height_um",
        "pit_edge_width_mm",
    ],
    "surface_damage": [
        "spall_depth_mm",
        "edge_height_um",
        "edge_width_mm",
        "roughness_um",
        "n_dents",
        "dent_depth_um",
        "dent_shoulder_um",
        "damage_seed",
    ],
    "broken": ["broken_height_mm", "broken_edge_height_um", "broken_edge_width_mm"],
    "chipped": [
        "chip_height_mm",
        "chip_width_mm",
        "chip_edge_height_um",
        "chip_edge_width_mm",
    ],
    "wear": ["wear_depth_um"],
    "profile_error": ["profile_form_um", "profile_waves"],
    "runout": ["eccentricity_um"],
    "tip_relief": ["relief_um", "relief_length_mm"],
}
WITH_LIMIT = (
    "wear",
    "pitch_error",
    "profile_error",
    "runout",
    "misalignment",
    "tip_relief",
)
# what is typed: words of the message; keys that are not typed are those of the kind's option
REFUSED = {
    "crack crack_depht_mm=1": "unknown key 'crack_depht_mm'; did you mean 'crack_d",
    "crack crack_depth_mm=null": "fault.crack_depth_mm is null; give a value",
    "crack tooth=-1": "fault.tooth = -1 must be at least 0",
    "crack tooth=[4,-2]": "fault.tooth = -2 must be at least 0",
    "crack tooth=[1,5,1]": "= [1, 5, 1] must name one tooth or more, each once",
    "crack tooth=[]": "fault.tooth = [] must name one tooth or more",
    "crack tooth=[0,23]": "fault.tooth = 23 is not on the pinion, whose teeth are 0",
    "crack tooth=every": "fault.tooth = 'every'; give a number, a list of numbers, or",
    "crack tooth='3'": "fault.tooth = '3'; give a number, a list of numbers, or all",
    "crack crack_depth_mm=4.2": "through the root chord 3.984 mm of the pinion",
    "crack crack_depth_mm=5 gear=wheel": "crack_depth 5 mm reaches through the root chord 4.8",
    "crack crack_angle_deg=0": "fault.crack_angle_deg = 0 must lie in 0..90",
    "crack crack_angle_deg=91": "fault.crack_angle_deg = 91 must lie in 0..90",
    "crack crack_start=tip": "crack_start = 'tip'; allowed: arc_mid, gamma_mid",
    "crack crack_front=round": "= 'round'; allowed: straight, parabolic, linear",
    "crack crack_side=both": "crack_side = 'both'; allowed: tension, compression",
    "crack crack_faces=shut": "crack_faces = 'shut'; allowed: open, breathing",
    "crack crack_width_mm=20.5": "= 20.5 must lie in 0..20, the face width of the pi",
    "crack crack_width_mm=-1": "fault.crack_width_mm = -1 must lie in 0..20",
    "pitting pit_width_mm=21": (
        "pit from -0.5 to 20.5 mm across the face leaves the pinion tooth, which is 20 mm"
    ),
    "pitting pit_face_position_mm=4": "the pit from -1 to 9 mm across the face leaves",
    "pitting pit_face_position_mm=16": "pit from 11 to 21 mm across the face leaves",
    "pitting pit_length_mm=9": "leaves the flank of the pinion tooth, which reaches f",
    "pitting pit_position_mm=0.1": "the pit from -0.4 to 0.6 mm above the root chord",
    "pitting pit_position_mm=9": "the pit from 8.5 to 9.5 mm above the root chord",
    "pitting pit_depth_mm=3": (
        "pit_depth 3 mm reaches the centreline of the pinion tooth (half thickness 1.4"
    ),
    "spalling spall_width_mm=20.2": "the spall from -0.1 to 20.1 mm across the face",
    "spalling spall_length_mm=9": "above the root chord leaves the flank of the pinio",
    "spalling spall_depth_mm=3": "spall_depth 3 mm reaches the centreline",
    "spalling spall_shape=round": "= 'round'; allowed: rectangular, elliptic",
    "distributed_pitting pitted_share=0.4": (
        "fault.pitted_share = 0.4 must lie in 0..0.35, 0.7 of the region"
    ),
    "distributed_pitting pitted_share=-0.1": "= -0.1 must lie in 0..0.35",
    "distributed_pitting region_low=0.6": "= 0.6 must lie below region_high",
    "distributed_pitting region_high=1.1": "= 1.1 must not be above 1, the tip",
    "distributed_pitting pit_diameter_mm=0": "pit_diameter_mm = 0 must be positive",
    "distributed_pitting depth_ratio=0.6": "depth_ratio = 0.6 must lie in 0..0.5",
    "distributed_pitting diameter_scatter=1.1": "= 1.1 must lie in 0..1",
    "distributed_pitting pit_diameter_mm=0.001": (
        "pits of 0.001 mm do not make fault.pitted_share = 0.1"
    ),
    "pitting pit_edge_height_um=20": (
        "fault.pit_edge_width_mm = 0 is too narrow for a raised edge: the pinion tooth is drawn"
    ),
    "spalling spall_edge_height_um=9": "fault.spall_edge_width_mm = 0 is too narrow",
    "distributed_pitting pit_edge_height_um=9": "pit_edge_width_mm = 0 is too narrow",
    "chipped chip_edge_height_um=9": "fault.chip_edge_width_mm = 0 is too narrow",
    "broken broken_edge_height_um=9": "or set fault.broken_edge_height_um=0",
    "surface_damage edge_width_mm=0.01 tooth=1": "fault.edge_width_mm = 0.01 is too narrow",
    "surface_damage damage=1.1": "fault.damage = 1.1 must lie in 0..1",
    "surface_damage spalled_share=-0.1": "spalled_share = -0.1 must lie in 0..1",
    "surface_damage spall_length_share=2": "_length_share = 2 must lie in 0..1",
    "surface_damage dented_share=0.8": "0.8 must be at most 0.67: other teeth are sp",
    "surface_damage roughness_length_mm=0": "_length_mm = 0 must be positive",
    "surface_damage dent_diameter_mm=0": "dent_diameter_mm = 0 must be positive",
    "surface_damage dent_depth_um=200": "200 must be at most 150, half of the smallest",
    "surface_damage dent_diameter_mm=4 spalled_share=0 dented_share=1": (
        "fault.dent_diameter_mm = 4 makes dents up to 6 mm, above the flank's height"
    ),
    "surface_damage spall_depth_mm=3 tooth=1": "spall_depth 3 mm reaches the centrel",
    "broken broken_height_mm=5": "5 mm is above the height 4.676 mm of the pinion",
    "chipped chip_height_mm=5": "5 mm is above the height 4.676 mm of the pinion t",
    "chipped chip_width_mm=21": "chip_width 21 mm is above the face width 20 mm of",
    "chipped chip_shape=round": "= 'round'; allowed: triangular, rectangular",
    "wear wear_profile=[1.0]": "(1.0,) must hold two depths or more, none negative",
    "wear wear_profile=[]": "fault.wear_profile = () must hold two depths or more",
    "wear wear_profile=[1.0,-0.1]": "= (1.0, -0.1) must hold two depths or more, no",
    "runout tooth=all": "= 'all' must be the one tooth that stands back most",
    "runout tooth=[1,2]": "= (1, 2) must be the one tooth that stands back most",
    "tip_relief relief_length_mm=11": "11 must not be above 10.55 mm, the involute",
    "tip_relief relief_curve=round": "= 'round'; allowed: linear, parabolic",
}
for kind in KINDS:
    REFUSED[f"{kind} gear=ring"] = "gear = 'ring'; allowed: pinion, wheel"
    for gear, n in (("pinion", 23), ("wheel", 84)):
        words = f"{kind} gear={gear} tooth={n}"
        REFUSED[words] = f"fault.tooth = {n} is not on the {gear}, whose teeth"
    for key in NOT_NEGATIVE.get(kind, ()):
        REFUSED[f"{kind} {key}=-1"] = f"fault.{key} = -1 must not be negative"
for kind in WITH_LIMIT:
    REFUSED[f"{kind} limit_um=0"] = "fault.limit_um = 0 must be positive"


@pytest.mark.parametrize(("words", "text"), REFUSED.items())
def test_refusals(xiamen, monkeypatch, words, text):
    monkeypatch.setattr("gensig.faults.pitting.MOST_PITS", 200)
    if "do not make" in text:
        text = "200 " + text
    with refused(text, GensigError):
        faulty_teeth(xiamen.pair, [typed(words)])


@pytest.mark.parametrize("gear", [3, "", None])
def test_a_gear_has_a_name(gear):
    with refused("must be the name of a gear", FaultError):
        MissingTooth(gear=gear, tooth=0)


@pytest.mark.parametrize("kind", KINDS)
def test_options_fit_up_to_the_last_tooth(xiamen, kind):
    for gear, last in (("pinion", 22), ("wheel", 83)):
        fault = one(kind, gear=gear, tooth=last)
        assert (gear, last) in faulty_teeth(xiamen.pair, [fault])


@pytest.mark.parametrize(
    "words",
    [
        "broken",
        "pitting pit_width_mm=20",
        "spalling spall_width_mm=20 spall_shape=rectangular",
        "chipped chip_width_mm=20 chip_shape=rectangular",
    ],
)
def test_the_papers_law_has_no_gaps(paper_machine, xiamen, words):
    fault, message = typed(words), r"pinion tooth .*whole face width.* mesh\.law=one_s"
    with pytest.raises(FaultError, match=message):
        paper_machine.mesh_table((fault,))
    gap = side_of(xiamen.mesh_table((fault,)), "pinion").gap
    assert gap[1].max() > gap[0].min()


def test_the_papers_crack_must_leave_a_section(paper_machine):
    deep = one("crack", crack_depth_mm=3.9, crack_angle_deg=90)
    message = r"depth 3\.9 mm leaves no section near the tip.* hold below 2\.\d+ mm"
    with pytest.raises(FaultError, match=message):
        paper_machine.mesh_table((deep,))


class TestSeverity:
    def test_a_pit_by_the_height_of_the_involute(self, xiamen):
        pinion = xiamen.pair.pinion
        radii = [math.hypot(21.61293e-3, r) for r in (12.56508e-3, 2.019e-3)]
        tip, low = (r * math.cos(pinion.half_tooth_angle_at(r)) for r in radii)
        result = severity([one("pitting")], xiamen.gears)

        assert_allclose(
            result,
            1e-5 / ((tip - low) * 20e-3),
            rtol=1e-5,
        )

    @pytest.mark.parametrize(
        ("words", "expected"),
        [
            ("crack", 1.0 / (2 * 1.99186)),
            ("missing_tooth", 1.0),
            ("distributed_pitting", 0.1),
            ("surface_damage", 0.5),
            ("surface_damage damage=0", 0.0),
            ("spalling spall_depth_mm=0", 0.0),
            ("pitting pit_depth_mm=0", 0.0),
            ("broken broken_height_mm=2.33788", 0.5),
            ("chipped chip_height_mm=2.33788 chip_width_mm=10", 0.125),
            (
                "chipped chip_height_mm=2.33788 chip_width_mm=10 chip_shape=rectangular",
                0.25,
            ),
            ("wear", 0.2),
            ("wear wear_profile=[0.0,2.0,1.0]", 0.4),
            ("wear wear_profile=null limit_um=40", 0.5),
            ("pitch_error pitch_error_um=-20", 0.4),
            ("profile_error profile_slope_um=-10 profile_form_um=5", 0.3),
            ("runout", 0.25),
            ("misalignment misalignment_um=-15", 0.25),
            ("tip_relief", 0.2),
        ],
    )
    def test_declared_measures(self, xiamen, words, expected):
        result = severity([typed(words)], xiamen.gears)
        assert_allclose(result, expected, rtol=1e-4)

    def test_the_largest_of_several(self, xiamen):
        assert severity([], xiamen.gears) == 0.0
        assert severity([one("crack"), one("missing_tooth")], xiamen.gears) == 1.0

    @pytest.mark.parametrize(
        "words",
        ["pitting pit_length_mm=90", "wear wear_depth_um=101", "runout limit_um=19"],
    )
    def test_larger_than_its_measure_is_refused(self, xiamen, words):
        with refused("above 1", FaultError):
            severity([typed(words)], xiamen.gears)
