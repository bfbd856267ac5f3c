"""Requests: typed overrides, derived values, and every mistake in one line."""

import functools
import re
import warnings

import pytest
from fault_cases import option
from refusals import refused

from gensig.errors import ConfigError, GensigError
from gensig.faults.base import faulty_teeth
from gensig.faults.registry import read_faults
from gensig.options.compose import _composed, compose, override_keys, sweep
from gensig.options.configuration import Configuration
from gensig.options.groups import options
from gensig.plan.request import DerivedValueWarning, read_request
from gensig.systems.pair_machine import severity
from gensig.systems.registry import read_system

FOUR = "plan.classes=[healthy,crack,pitting,missing_tooth]"


def check_refusal(needles, words, error=ConfigError):
    """Words are refused in one line that holds all needles."""
    with refused("", error) as caught:
        read_request(words)
    text = str(caught.value)
    assert all(needle in text for needle in needles.split("|")), text


class TestMistakes:
    @pytest.mark.parametrize(
        ("words", "needles"),
        [
            ("gear=foo", "foo|xiamen_23_84"),
            ("excitation=null", "excitation=null: a group takes one of its options"),
            ("seed=1 gear=3", "gear=3: a group|xiamen_23_84"),
            ("model=cnn", "the group 'model' is one of train.yaml, not of generate"),
            ("low_cutoff=1", "did you mean 'sensing.sensor.low_cutoff_hz'?"),
            ("+zzz=1", "unknown key 'zzz'; the configuration has system, gear"),
            ("fault.vary=3", "fault.vary must be a mapping, for instance"),
            ("fault=crack fault.pit_width_mm=1", "fault=crack|crack_depth_mm|pitting"),
            ("fault.crack_depth_mm=1", "fault.crack_depth_mm|fault=healthy|crack"),
            ("plan.classes=[crack,crack]", "plan.classes|different fault options"),
            ("plan.classes=3", "plan.classes = 3|list"),
            ("operating", "cannot read the override|operating"),
            ("fault=(", "cannot read the override"),
            ("out=???", "out is required"),
            ("sensing=measured", "sensing.path.file is required"),
        ],
    )
    def test_composing(self, words, needles):
        check_refusal(needles, words.split())

    def test_a_key_like_no_other_gets_no_hint(self):
        with pytest.raises(ConfigError, match=r"^unknown key 'qqq\.www'$"):
            read_request(["qqq.www=1"])

    def test_a_missing_folder_of_own_options(self, tmp_path):
        with refused("is not a folder"):
            read_request([], config_dir=tmp_path / "none")


def test_overrides_are_kept_as_typed():
    words = ["fault=crack", "operating.speed_rpm=1500"]
    request = read_request(words)
    assert request.overrides == tuple(words)
    assert request.config["operating"]["speed_rpm"] == 1500


@pytest.mark.parametrize(
    "words",
    [
        "seed=3",
        "fault=crack operating.speed_rpm=1500 life/law=wear",
        "plan.classes=[crack] plan.classes=[wear] out='a b'",
        "operating={speed_rpm: 900} operating.speed_rpm=800",
        "operating.speed_rpm=800 operating={speed_rpm: 900}",
        "seed=${plan.n_records}",
        "~heat",
        "+new.key=3",
        "++seed=4",
        "seed=1,2",
        "heat=null",
        "operatng.speed_rpm=1",
        "gear@other=xiamen_23_84",
        "fault=none",
    ],
)
def test_values_set_in_kept_options_are_those_of_a_whole_composition(words):
    def content(compose):
        try:
            composed = compose("generate", tuple(re.split(r" (?=\S+=|~)", words)))
        except ConfigError as error:
            return str(error)
        return Configuration(composed).plain()

    whole = functools.partial(_composed, config_dir=None)
    assert repr(content(compose)) == repr(content(whole))


def test_own_options_are_found(tmp_path):
    (tmp_path / "operating").mkdir()
    text = "defaults: [rated]\nspeed_rpm: 600\ntorque_nm: 5\n"
    (tmp_path / "operating" / "slow.yaml").write_text(text)
    config = read_request(["operating=slow"], config_dir=tmp_path).config
    assert config["operating"]["speed_rpm"] == 600
    assert read_system(config).operating.torque == pytest.approx(5.0)
    with refused("slow"):
        read_request(["operating=slow"])


class TestFaultKeys:
    def test_they_go_to_the_classes_that_have_them(self):
        words = [FOUR, "fault.crack_depth_mm=1.5", "fault.gear=wheel"]
        classes = read_request(words).config["classes"]
        assert classes["crack"]["crack_depth_mm"] == pytest.approx(1.5)
        gears = [fault.get("gear") for fault in classes.values()]
        assert gears == [None, "wheel", "wheel", "wheel"]
        assert "crack_depth_mm" not in classes["pitting"]
        assert classes["healthy"] == {"kind": "healthy", "vary": {}}

    def test_a_typed_key_is_pinned_and_leaves_the_severity_draw(self):
        typed = ("fault.crack_depth_mm=1.5", "fault.tooth=4")
        free, pinned = (
            read_request([FOUR, *words]).config["classes"] for words in ((), typed)
        )
        assert set(free["crack"]["vary"]) == {"tooth", "crack_depth_mm"}
        assert pinned["crack"]["vary"] == {}
        left = set(free["pitting"]["vary"]) - {"tooth"}
        assert set(pinned["pitting"]["vary"]) == left

    def test_typing_a_fault_narrows_the_classes(self):
        config = read_request(["experiment=quickstart", "fault=crack"]).config
        assert config["plan"]["classes"] == ["crack"]
        assert list(config["classes"]) == ["crack"]
        assert config["fault"]["kind"] == "crack"


EVERY = ",".join(options("fault"))


class TestEveryFaultOption:
    @pytest.fixture(scope="class")
    @classmethod
    def classes(cls):
        return read_request([f"plan.classes=[{EVERY}]"]).config["classes"]

    @pytest.mark.parametrize("name", options("fault"))
    @pytest.mark.parametrize("gear", ["pinion", "wheel"])
    @pytest.mark.parametrize("end", ["low", "high"])
    def test_every_draw_that_it_offers_fits(self, classes, name, gear, end, xiamen):
        """At the ends of what plans vary nothing leaves its tooth or passes its limit."""
        faults = read_faults(at_end(with_keys(classes[name], gear=gear), end))
        teeth = faulty_teeth(xiamen.pair, faults)
        assert bool(teeth) == (name != "healthy")
        assert {result for result, _ in teeth} <= {gear}
        assert 0 <= severity(faults, xiamen.gears) <= 1
        xiamen.mesh_table(
            [fault for fault in faults if fault.alike or fault.kind == "runout"]
        )

    @pytest.mark.parametrize(
        ("name", "word", "teeth"),
        [("crack", "all", "all"), ("crack", "[1,2]", (1, 2)), ("misalignment", "7", 7)],
    )
    def test_tooth_takes_all_and_lists(self, name, word, teeth):
        fault = read_request([f"fault={name}", f"fault.tooth={word}"]).config["fault"]
        assert "tooth" not in fault["vary"]
        assert [own.tooth for own in read_faults(fault)] == [teeth]


def with_keys(fault, **changes):
    """A fault with keys replaced, those of all parts of a compound one."""
    if "parts" in fault:
        return {**fault, "parts": [{**part, **changes} for part in fault["parts"]]}
    return {**fault, **{key: value for key, value in changes.items() if key in fault}}


def at_end(fault, end):
    """A fault with everything that plans vary at one end of its range; teeth are left where they
    are."""
    if "parts" in fault:
        return {**fault, "parts": [at_end(part, end) for part in fault["parts"]]}
    return {
        **fault,
        **{key: spec[end] for key, spec in fault["vary"].items() if end in spec},
    }


class TestCompound:
    CRACK = "fault.parts=[{kind: crack, gear: pinion, tooth: 3, crack_depth_mm: 1.0}]"

    def test_a_part_takes_the_rest_from_its_option(self):
        config = read_request(["fault=compound", self.CRACK]).config
        (part,) = config["fault"]["parts"]
        assert part == {**option("crack"), "tooth": 3, "vary": {}}
        assert config["fault"] == config["classes"]["compound"]

    def test_what_is_not_typed_is_varied_and_a_part_can_say_what(self):
        limit = "{distribution: uniform, low: 90, high: 99}"
        wear = f"{{kind: wear, vary: {{limit_um: {limit}}}}}"
        other = "{kind: crack, tooth: 3}, {kind: spalling, spall_width_mm: 4}"
        words = ["fault=compound", f"fault.parts=[{other}, {wear}]"]
        parts = read_request(words).config["fault"]["parts"]
        keys = [{"crack_depth_mm"}, {"tooth", "spall_length_mm"}, {"limit_um"}]
        assert [set(part["vary"]) for part in parts] == keys
        assert parts[1]["spall_width_mm"] == 4

    def test_one_key_of_one_part(self):
        words = ["fault=compound", "fault.parts.1.tooth=4"]
        parts = read_request(words).config["fault"]["parts"]
        assert [part["tooth"] for part in parts] == [0, 4]

    def test_typed_keys_of_single_faults_leave_it_alone(self):
        words = ["plan.classes=[crack,compound]", "fault.crack_depth_mm=1.5"]
        classes = read_request(words).config["classes"]
        assert classes["crack"]["crack_depth_mm"] == pytest.approx(1.5)
        assert classes["compound"]["parts"][0]["crack_depth_mm"] == pytest.approx(1.0)

    @pytest.mark.parametrize(
        ("parts", "needles"),
        [
            ("[{kind: crak}]", "crak|did you mean 'crack'"),
            ("[{gear: pinion}]", "fault.parts|kind = None"),
            ("[{kind: healthy}]", "fault.parts|'healthy'|single fault"),
            ("[{kind: compound}]", "fault.parts|'compound'|single fault"),
            ("[]", "fault.parts = []|list of faults"),
            ("[crack]", "fault.parts = ['crack']|list of faults"),
            ("3", "fault.parts = 3|list of faults"),
        ],
    )
    def test_mistakes(self, parts, needles):
        words = ["fault=compound", f"fault.parts={parts}"]
        check_refusal(needles, words, GensigError)

    def test_an_unknown_key_in_a_part_is_named_with_its_place(self):
        parts = "fault.parts=[{kind: pitting}, {kind: crack, crack_dept_mm: 1}]"
        fault = read_request(["fault=compound", parts]).config["fault"]
        with refused("fault.parts.1: unknown key 'crack_dept_mm'; did you mean"):
            read_faults(fault)

    @pytest.mark.parametrize(
        "word", ["fault.gear=wheel", "fault.vary={tooth: {distribution: tooth}}"]
    )
    def test_it_has_no_keys_of_its_own(self, word):
        with refused("for fault=compound, it has parts"):
            read_request(["fault=compound", word])


class TestPinnedKeys:
    def test_a_typed_key_leaves_vary(self):
        key = "operating.speed_rpm"
        free = read_request(["experiment=quickstart"]).config["plan"]["vary"]
        config = read_request(["experiment=quickstart", f"{key}=1500"]).config
        assert set(free) - set(config["plan"]["vary"]) == {key}
        assert config["operating"]["speed_rpm"] == 1500


class TestMassAndInertia:
    @pytest.mark.parametrize(
        ("word", "sides"),
        [
            ("gear.pinion.n_teeth=30", {"pinion"}),
            ("gear.wheel.face_width_mm=25", {"wheel"}),
            ("gear.normal_module_mm=3", {"pinion", "wheel"}),
        ],
    )
    def test_they_are_derived_anew_where_the_size_changes(self, word, sides):
        with pytest.warns(DerivedValueWarning, match=re.escape(word.partition("=")[0])):
            gear = read_request([word]).config["gear"]
        for key in ("mass_kg", "inertia_kg_m2"):
            derived = {side for side in ("pinion", "wheel") if gear[side][key] is None}
            assert derived == sides

    def test_a_typed_mass_stays(self):
        words = ["gear.pinion.n_teeth=30", "gear.pinion.mass_kg=0.3"]
        with pytest.warns(DerivedValueWarning, match="inertia_kg_m2"):
            pinion = read_request(words).config["gear"]["pinion"]
        assert pinion["mass_kg"] == pytest.approx(0.3)
        assert pinion["inertia_kg_m2"] is None

    def test_nothing_changes_silently_otherwise(self):
        words = ["operating.speed_rpm=1500", "gear.pinion.profile_shift=0.1"]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            gear = read_request(words).config["gear"]
        assert gear["pinion"]["mass_kg"] == pytest.approx(0.22)


class TestSweeps:
    def test_the_product_first_key_slowest(self):
        assert sweep(["fault=crack,healthy", "seed=1,2"]) == [
            ["fault=crack", "seed=1"],
            ["fault=crack", "seed=2"],
            ["fault=healthy", "seed=1"],
            ["fault=healthy", "seed=2"],
        ]

    @pytest.mark.parametrize(
        ("word", "jobs"),
        [
            ("seed=range(1,4)", ["seed=1", "seed=2", "seed=3"]),
            ("seed=choice(3,4)", ["seed=3", "seed=4"]),
            ("plan.classes=[crack,healthy]", ["plan.classes=[crack,healthy]"]),
            ("out=a/b", ["out=a/b"]),
        ],
    )
    def test_single_words(self, word, jobs):
        assert [job[0] for job in sweep([word])] == jobs

    def test_a_sweep_is_no_single_request(self):
        with refused("several values, where one is needed"):
            override_keys(["seed=1,2"])

    @pytest.mark.parametrize(
        ("word", "instead"),
        [
            ("operating.torque_nm=55,5", "Then type operating.torque_nm=55.5"),
            (
                "protocols=by_unit,cross_specimen",
                "a list is written 'protocols=[by_unit,cross_specimen]'",
            ),
            (
                "plan.classes=healthy,crack",
                "a list is written 'plan.classes=[healthy,crack]'",
            ),
        ],
    )
    def test_what_was_perhaps_meant_by_several_values(self, word, instead):
        with pytest.raises(ConfigError) as caught:
            override_keys([word])
        assert instead in str(caught.value)


def test_paper_experiment_means_every_convention_of_the_paper_and_no_noise():
    config = read_request(["experiment=paper"]).config
    assert config["sensing"]["snr_db"] is config["quality"]["iso1328_grade"] is None
    mesh = read_system(config).mesh
    expected = {
        "law": "paper",
        "phase": "prescribed",
        "pair_coupling": "sum",
        "contact": "linear",
        "elasticity": "plane_stress",
        "body": "sainsot",
        "tooth": "to_contact",
        "crack": "paper",
        "bending": "whole",
    }
    assert {key: getattr(mesh, key) for key in expected} == expected
    words = ["law=paper", "phase=prescribed", "pair_coupling=sum", "contact=linear"]
    words = [f"mesh.{word}" for word in words]
    assert read_system(read_request(words).config).mesh == mesh
    assert read_system(read_request([]).config).mesh.elasticity == "plane_strain"


@pytest.mark.parametrize(
    ("words", "classes", "notes"),
    [
        (
            ["life=mixed"],
            ["crack", "distributed_pitting", "wear"],
            [
                "lives have plan.n_records = null, "
                "plan.classes = [crack, distributed_pitting, wear]"
            ],
        ),
        (["life=wear", "fault=wear"], ["wear"], ["lives have plan.n_records = null"]),
        (
            ["life=wear", "fault=healthy"],
            ["healthy"],
            ["lives have plan.n_records = null"],
        ),
        (["life=common"], ["healthy"], ["lives have plan.n_records = null"]),
        (
            ["life=crack_growth", "plan.n_records=null", "plan.classes=[crack]"],
            ["crack"],
            [],
        ),
    ],
)
def test_a_life_brings_its_plan(words, classes, notes):
    request = read_request(words)
    plan = request.config["plan"]
    assert plan["n_records"] is None
    assert plan["classes"] == classes == list(request.config["classes"])
    assert list(request.notes) == notes


def test_a_typed_number_of_records_stays():
    assert (
        read_request(["life=wear", "plan.n_records=9"]).config["plan"]["n_records"] == 9
    )
