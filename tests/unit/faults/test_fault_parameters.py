"""Faults from boundary keys, and faults that do not fit their tooth."""

import math
import re

import pytest
from fault_cases import KINDS, one, option
from numpy.testing import assert_allclose

from gensig.errors import ConfigError, FaultError, GensigError
from gensig.faults.base import faulty_teeth
from gensig.faults.broken import MissingTooth
from gensig.faults.crack import Crack
from gensig.faults.pitting import Pitting
from gensig.faults.registry import COMPOUND, FAULTS, fault_parts, read_faults
from gensig.options.compose import options
from gensig.systems.pair_machine import severity

CRACK, PIT, MISSING = (
    {**option(kind), "tooth": 3} for kind in ("crack", "pitting", "missing_tooth")
)


class TestReading:
    def test_units_are_converted(self):
        crack = one("crack", tooth=3)
        assert isinstance(crack, Crack)
        assert_allclose(
            [crack.crack_depth, crack.crack_angle],
            [1e-3, math.pi / 4],
            rtol=1e-12,
            atol=0,
        )
        pit = one("pitting", tooth=3)
        assert isinstance(pit, Pitting)
        assert pit.pit_position is None
        assert isinstance(one("missing_tooth"), MissingTooth)
        assert one("wear").wear_depth == pytest.approx(20e-6)
        assert one("wear").wear_profile == pytest.approx(
            (1.0, 0.7, 0.4, 0.2, 0.4, 0.7, 1.0)
        )

    def test_a_crack_of_three_keys_is_the_papers(self):
        """What the first version of the format had suffices: through, straight, open, on the
        tension side.
        """
        short = {
            key: CRACK[key]
            for key in (
                "kind",
                "gear",
                "tooth",
                "crack_depth_mm",
                "crack_angle_deg",
                "crack_start",
            )
        }
        assert read_faults(short) == read_faults(CRACK)

    def test_healthy_is_no_fault(self):
        assert read_faults({"kind": "healthy"}) == ()
        assert read_faults({"kind": "healthy", "vary": {}}) == ()

    def test_what_plans_vary_is_passed_over(self):
        assert read_faults(
            {**CRACK, "vary": {"tooth": {"distribution": "tooth"}}}
        ) == read_faults(CRACK)

    @pytest.mark.parametrize("kind", ["crak", None, 3])
    def test_unknown_kinds_list_the_known(self, kind):
        with pytest.raises(FaultError) as caught:
            read_faults({"kind": kind})
        assert (
            str(caught.value)
            == f"fault.kind = {kind!r}; allowed: healthy, compound, {', '.join(FAULTS)}"
        )

    def test_every_kind_has_an_option_and_every_option_a_kind(self):
        assert set(options("fault")) == {*FAULTS, COMPOUND, "healthy"}
        assert all(option(kind)["kind"] == kind for kind in FAULTS)

    @pytest.mark.parametrize(
        ("changes", "text"),
        [
            (
                {"crack_depht_mm": 1.0},
                "fault: unknown key 'crack_depht_mm'; did you mean 'crack_depth_mm'?",
            ),
            (
                {"crack_depth_deg": 1.0},
                "'crack_depth_deg' has the wrong unit; write it as 'crack_depth_mm'",
            ),
            (
                {"crack_width_um": 1.0},
                "'crack_width_um' has the wrong unit; write it as 'crack_width_mm'",
            ),
            (
                {"crack_depth_mm": "deep"},
                "fault.crack_depth_mm = 'deep' is not a number",
            ),
            ({"crack_depth_mm": None}, "fault.crack_depth_mm is null; give a value"),
            ({"crack_start": None}, "fault.crack_start is null; give a value"),
            (
                {"tooth": 1.5},
                "fault.tooth = 1.5 is not a whole number or text or a list of whole numbers",
            ),
            ({"tooth": True}, "fault.tooth = True is not a whole number"),
            (
                {"tooth": [1, 2.5]},
                "fault.tooth = [1, 2.5] is not a whole number or text or a list of whole numbers",
            ),
            ({"tooth": [True]}, "fault.tooth = [True] is not a whole number"),
            ({"tooth": None}, "fault.tooth is null; give a value"),
        ],
    )
    def test_mistakes_in_keys(self, changes, text):
        with pytest.raises(ConfigError, match=re.escape(text)):
            read_faults({**CRACK, **changes})

    @pytest.mark.parametrize("kind", KINDS)
    def test_missing_keys_are_named(self, kind):
        with pytest.raises(ConfigError, match=r"fault: missing .*gear.*tooth"):
            read_faults({"kind": kind})


class TestCompound:
    def test_parts_in_order(self):
        faults = read_faults(
            {
                "kind": "compound",
                "parts": [CRACK, PIT, {**MISSING, "gear": "wheel"}],
                "vary": {},
            }
        )
        assert faults == (
            one("crack", tooth=3),
            one("pitting", tooth=3),
            one("missing_tooth", gear="wheel", tooth=3),
        )

    def test_parts_of_a_single_fault_are_itself(self):
        assert fault_parts(CRACK) == [CRACK]
        assert fault_parts({"kind": "healthy"}) == []

    @pytest.mark.parametrize(
        ("values", "text"),
        [
            ({}, "fault.parts = None must be a list of faults, each with its kind"),
            ({"parts": []}, "fault.parts = [] must be a list of faults"),
            ({"parts": "crack"}, "fault.parts = 'crack' must be a list of faults"),
            ({"parts": ["crack"]}, "fault.parts = ['crack'] must be a list of faults"),
            ({"parts": CRACK}, "must be a list of faults"),
            (
                {"parts": [CRACK, {"kind": "crak"}]},
                "fault.parts.1.kind = 'crak'; allowed: ",
            ),
            (
                {"parts": [CRACK, {"gear": "pinion"}]},
                "fault.parts.1.kind = None; allowed: ",
            ),
            (
                {"parts": [{"kind": "compound", "parts": [CRACK]}]},
                "fault.parts.0.kind = 'compound'",
            ),
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
        with pytest.raises(GensigError, match=re.escape(text)):
            read_faults({"kind": "compound", **values})


# kind, keys that do not fit, and what the message must hold: the value and what is allowed
MISFITS = [
    (
        "crack",
        {"crack_depth_mm": -0.1},
        "fault.crack_depth_mm = -0.1 must not be negative",
    ),
    (
        "crack",
        {"crack_depth_mm": 4.2},
        "crack_depth 4.2 mm reaches through the root chord 3.984 mm of the pinion",
    ),
    (
        "crack",
        {"crack_depth_mm": 5, "gear": "wheel"},
        r"crack_depth 5 mm reaches through the root chord 4.8",
    ),
    ("crack", {"crack_angle_deg": 0}, "fault.crack_angle_deg = 0 must lie in 0..90"),
    ("crack", {"crack_angle_deg": 91}, "fault.crack_angle_deg = 91 must lie in 0..90"),
    (
        "crack",
        {"crack_start": "tip"},
        "fault.crack_start = 'tip'; allowed: arc_mid, gamma_mid",
    ),
    (
        "crack",
        {"crack_front": "round"},
        "fault.crack_front = 'round'; allowed: straight, parabolic, linear",
    ),
    (
        "crack",
        {"crack_side": "both"},
        "fault.crack_side = 'both'; allowed: tension, compression",
    ),
    (
        "crack",
        {"crack_faces": "shut"},
        "fault.crack_faces = 'shut'; allowed: open, breathing",
    ),
    (
        "crack",
        {"crack_width_mm": 20.5},
        "fault.crack_width_mm = 20.5 must lie in 0..20, the face width of the pinion",
    ),
    ("crack", {"crack_width_mm": -1}, "fault.crack_width_mm = -1 must lie in 0..20"),
    ("pitting", {"pit_width_mm": -1}, "fault.pit_width_mm = -1 must not be negative"),
    ("pitting", {"pit_length_mm": -1}, "fault.pit_length_mm = -1 must not be negative"),
    ("pitting", {"pit_depth_mm": -1}, "fault.pit_depth_mm = -1 must not be negative"),
    (
        "pitting",
        {"pit_width_mm": 21},
        "the pit from -0.5 to 20.5 mm across the face leaves the pinion tooth, which is 20 mm",
    ),
    (
        "pitting",
        {"pit_face_position_mm": 4},
        "the pit from -1 to 9 mm across the face leaves the pinion tooth",
    ),
    (
        "pitting",
        {"pit_face_position_mm": 16},
        "the pit from 11 to 21 mm across the face leaves",
    ),
    (
        "pitting",
        {"pit_length_mm": 9},
        "mm above the root chord leaves the flank of the pinion tooth, which reaches from ",
    ),
    (
        "pitting",
        {"pit_position_mm": 0.1},
        "the pit from -0.4 to 0.6 mm above the root chord leaves the flank",
    ),
    (
        "pitting",
        {"pit_position_mm": 9},
        "the pit from 8.5 to 9.5 mm above the root chord leaves the flank",
    ),
    (
        "pitting",
        {"pit_depth_mm": 3},
        "pit_depth 3 mm reaches the centreline of the pinion tooth (half thickness 1.4",
    ),
    (
        "spalling",
        {"spall_width_mm": -1},
        "fault.spall_width_mm = -1 must not be negative",
    ),
    (
        "spalling",
        {"spall_width_mm": 20.2},
        "the spall from -0.1 to 20.1 mm across the face leaves the pinion tooth",
    ),
    (
        "spalling",
        {"spall_length_mm": 9},
        "above the root chord leaves the flank of the pinion tooth",
    ),
    ("spalling", {"spall_depth_mm": 3}, "spall_depth 3 mm reaches the centreline"),
    (
        "spalling",
        {"spall_shape": "round"},
        "fault.spall_shape = 'round'; allowed: rectangular, elliptic",
    ),
    (
        "distributed_pitting",
        {"pitted_share": 0.4},
        "fault.pitted_share = 0.4 must lie in 0..0.35, 0.7 of the region",
    ),
    (
        "distributed_pitting",
        {"pitted_share": -0.1},
        "fault.pitted_share = -0.1 must lie in 0..0.35",
    ),
    (
        "distributed_pitting",
        {"region_low": 0.6},
        "fault.region_low = 0.6 must lie below region_high",
    ),
    (
        "distributed_pitting",
        {"region_low": 0.8},
        "fault.region_low = 0.8 must lie below region_high",
    ),
    (
        "distributed_pitting",
        {"pit_diameter_mm": 0},
        "fault.pit_diameter_mm = 0 must be positive",
    ),
    (
        "distributed_pitting",
        {"depth_ratio": 0.6},
        "fault.depth_ratio = 0.6 must lie in 0..0.5",
    ),
    (
        "distributed_pitting",
        {"diameter_scatter": 1.1},
        "fault.diameter_scatter = 1.1 must lie in 0..1",
    ),
    (
        "distributed_pitting",
        {"pit_seed": -1},
        "fault.pit_seed = -1 must not be negative",
    ),
    (
        "distributed_pitting",
        {"pit_seed": 1.5},
        "fault.pit_seed = 1.5 is not a whole number",
    ),
    (
        "distributed_pitting",
        {"pit_diameter_mm": 1e-3},
        "pits of 0.001 mm do not make fault.pitted_share = 0.1",
    ),
    (
        "broken",
        {"broken_height_mm": -1},
        "fault.broken_height_mm = -1 must not be negative",
    ),
    (
        "broken",
        {"broken_height_mm": 5},
        "broken_height 5 mm is above the height 4.676 mm of the pinion tooth",
    ),
    (
        "chipped",
        {"chip_height_mm": -1},
        "fault.chip_height_mm = -1 must not be negative",
    ),
    ("chipped", {"chip_width_mm": -1}, "fault.chip_width_mm = -1 must not be negative"),
    (
        "chipped",
        {"chip_height_mm": 5},
        "chip_height 5 mm is above the height 4.676 mm of the pinion tooth",
    ),
    (
        "chipped",
        {"chip_width_mm": 21},
        "chip_width 21 mm is above the face width 20 mm of the pinion",
    ),
    (
        "chipped",
        {"chip_shape": "round"},
        "fault.chip_shape = 'round'; allowed: triangular, rectangular",
    ),
    ("wear", {"wear_depth_um": -1}, "fault.wear_depth_um = -1 must not be negative"),
    (
        "wear",
        {"wear_profile": [1.0]},
        "fault.wear_profile = (1.0,) must hold two depths or more, none negative",
    ),
    (
        "wear",
        {"wear_profile": []},
        "fault.wear_profile = () must hold two depths or more",
    ),
    (
        "wear",
        {"wear_profile": [1.0, -0.1]},
        "fault.wear_profile = (1.0, -0.1) must hold two depths or more, none",
    ),
    (
        "wear",
        {"wear_profile": "even"},
        "fault.wear_profile = 'even' is not a list of numbers or null",
    ),
    (
        "wear",
        {"wear_profile": [1, "x"]},
        "fault.wear_profile = [1, 'x'] is not a list of numbers",
    ),
    (
        "profile_error",
        {"profile_form_um": -1},
        "fault.profile_form_um = -1 must not be negative",
    ),
    (
        "profile_error",
        {"profile_waves": -1},
        "fault.profile_waves = -1 must not be negative",
    ),
    (
        "runout",
        {"eccentricity_um": -1},
        "fault.eccentricity_um = -1 must not be negative",
    ),
    (
        "runout",
        {"tooth": "all"},
        "fault.tooth = 'all' must be the one tooth that stands back most",
    ),
    (
        "runout",
        {"tooth": [1, 2]},
        "fault.tooth = (1, 2) must be the one tooth that stands back most",
    ),
    ("tip_relief", {"relief_um": -1}, "fault.relief_um = -1 must not be negative"),
    (
        "tip_relief",
        {"relief_length_mm": -1},
        "fault.relief_length_mm = -1 must not be negative",
    ),
    (
        "tip_relief",
        {"relief_length_mm": 11},
        "fault.relief_length_mm = 11 must not be above 10.55 mm, the involute",
    ),
    (
        "tip_relief",
        {"relief_curve": "round"},
        "fault.relief_curve = 'round'; allowed: linear, parabolic",
    ),
    *(
        (kind, {"limit_um": limit}, f"fault.limit_um = {limit} must be positive")
        for kind in (
            "wear",
            "pitch_error",
            "profile_error",
            "runout",
            "misalignment",
            "tip_relief",
        )
        for limit in (0, -1)
    ),
    *(
        (
            kind,
            {"gear": gear, "tooth": n_teeth},
            f"fault.tooth = {n_teeth} is not on the {gear}, whose teeth are 0..",
        )
        for kind in KINDS
        for gear, n_teeth in (("pinion", 23), ("wheel", 84))
    ),
    *(
        (kind, {"gear": "ring"}, "fault.gear = 'ring'; allowed: pinion, wheel")
        for kind in KINDS
    ),
    ("crack", {"tooth": -1}, "fault.tooth = -1 must be at least 0"),
    ("crack", {"tooth": [4, -2]}, "fault.tooth = -2 must be at least 0"),
    (
        "crack",
        {"tooth": [1, 5, 1]},
        "fault.tooth = [1, 5, 1] must name one tooth or more, each once",
    ),
    ("crack", {"tooth": []}, "fault.tooth = [] must name one tooth or more"),
    (
        "crack",
        {"tooth": [0, 23]},
        "fault.tooth = 23 is not on the pinion, whose teeth are 0..22",
    ),
    (
        "crack",
        {"tooth": "every"},
        "fault.tooth = 'every'; give a number, a list of numbers, or all",
    ),
    (
        "crack",
        {"tooth": "3"},
        "fault.tooth = '3'; give a number, a list of numbers, or all",
    ),
]


@pytest.mark.parametrize(("kind", "changes", "text"), MISFITS)
def test_faults_that_do_not_fit(xiamen, kind, changes, text):
    with pytest.raises(GensigError, match=re.escape(text)) as caught:
        faulty_teeth(xiamen.pair, [one(kind, **{"tooth": 3, **changes})])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", KINDS)
def test_what_fits_is_taken(xiamen, kind):
    """The twin: the same options as they are, and with their largest tooth number."""
    for gear, last in (("pinion", 22), ("wheel", 83)):
        assert (gear, last) in faulty_teeth(
            xiamen.pair, [one(kind, gear=gear, tooth=last)]
        )


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("broken", {}),
        ("pitting", {"pit_width_mm": 20}),
        ("spalling", {"spall_width_mm": 20, "spall_shape": "rectangular"}),
        ("chipped", {"chip_width_mm": 20, "chip_shape": "rectangular"}),
    ],
)
def test_the_papers_law_has_no_gaps(paper_machine, xiamen, kind, changes):
    fault = one(kind, tooth=3, **changes)
    with pytest.raises(
        FaultError, match=r"pinion tooth .*whole face width.* mesh\.law=one_sided"
    ):
        paper_machine.mesh_table((fault,))
    assert (
        xiamen.mesh_table((fault,)).pinion.gap[1].max()
        > xiamen.mesh_table((fault,)).pinion.gap[0].min()
    )


def test_the_papers_crack_must_leave_a_section(paper_machine):
    with pytest.raises(
        FaultError,
        match=r"crack_depth 3\.9 mm leaves no section near the tip.* hold below 2\.\d+ mm",
    ):
        paper_machine.mesh_table(
            (one("crack", crack_depth_mm=3.9, crack_angle_deg=90),)
        )


class TestSeverity:
    def test_values(self, xiamen):
        pair = xiamen.pair
        assert_allclose(
            severity([one("crack")], pair), 1.0 / (2 * 1.99186), rtol=1e-5, atol=0
        )
        assert_allclose(severity([one("missing_tooth")], pair), 1.0, rtol=1e-12, atol=0)
        assert_allclose(severity([], pair), 0.0, rtol=0, atol=0)
        # height of the involute on the tooth axis, from its lower end to the tip
        tip, low = (
            math.hypot(21.61293e-3, radius) for radius in (12.56508e-3, 2.019e-3)
        )
        height = tip * math.cos(pair.pinion.half_tooth_angle_at(tip)) - low * math.cos(
            pair.pinion.half_tooth_angle_at(low)
        )
        assert_allclose(
            severity([one("pitting")], pair), 1e-5 / (height * 20e-3), rtol=1e-5, atol=0
        )

    @pytest.mark.parametrize(
        ("kind", "changes", "expected"),
        [
            ("distributed_pitting", {}, 0.1),
            ("spalling", {"spall_depth_mm": 0}, 0.0),
            ("pitting", {"pit_depth_mm": 0}, 0.0),
            ("broken", {"broken_height_mm": 0.5 * 4.67576}, 0.5),
            ("chipped", {"chip_height_mm": 0.5 * 4.67576, "chip_width_mm": 10}, 0.125),
            (
                "chipped",
                {
                    "chip_height_mm": 0.5 * 4.67576,
                    "chip_width_mm": 10,
                    "chip_shape": "rectangular",
                },
                0.25,
            ),
            ("wear", {}, 0.2),
            ("wear", {"wear_profile": [0.0, 2.0, 1.0]}, 0.4),
            ("wear", {"wear_profile": None, "limit_um": 40}, 0.5),
            ("pitch_error", {"pitch_error_um": -20}, 0.4),
            ("profile_error", {"profile_slope_um": -10, "profile_form_um": 5}, 0.3),
            ("runout", {}, 0.25),
            ("misalignment", {"misalignment_um": -15}, 0.25),
            ("tip_relief", {}, 0.2),
        ],
    )
    def test_declared_measures(self, xiamen, kind, changes, expected):
        assert_allclose(
            severity([one(kind, **changes)], xiamen.pair), expected, rtol=1e-4, atol=0
        )

    def test_largest_counts(self, xiamen):
        assert severity(
            [one("crack"), one("missing_tooth")], xiamen.pair
        ) == pytest.approx(1.0)

    @pytest.mark.parametrize(
        ("kind", "changes"),
        [
            ("pitting", {"pit_length_mm": 90}),
            ("wear", {"wear_depth_um": 101}),
            ("runout", {"limit_um": 19}),
        ],
    )
    def test_larger_than_its_measure_is_refused(self, xiamen, kind, changes):
        with pytest.raises(FaultError, match="above 1"):
            severity([one(kind, **changes)], xiamen.pair)
