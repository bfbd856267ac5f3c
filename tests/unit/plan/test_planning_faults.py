"""Plans of faults on one tooth, on all teeth, and of several faults at once."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.errors import GensigError
from gensig.faults.registry import read_faults
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader, row_faults
from gensig.record.simulate import simulate_record
from gensig.systems.pair_machine import severity
from gensig.systems.registry import read_system

MIXED = ("healthy", "crack", "compound", "wear", "runout", "distributed_pitting")


class TestManyKindsOfFaults:
    """Columns of a plan whose faults are on one tooth, on all of them, or several at once."""

    @pytest.fixture(scope="class")
    @classmethod
    def config(cls):
        crack = "{kind: crack, gear: wheel, crack_depth_mm: 1.0}"
        parts = f"fault.parts=[{crack}, {{kind: pitting, tooth: 2}}]"
        classes = f"plan.classes=[{','.join(MIXED)}]"
        return read_request([classes, parts, "plan.n_records=60"]).config

    @pytest.fixture(scope="class")
    @classmethod
    def mixed(cls, config):
        return make_plan(config)

    @staticmethod
    def of(plan, name):
        """Records of one class."""
        rows = np.flatnonzero(plan.columns["label_name"] == name)
        return [plan.record(int(row)) for row in rows]

    def test_columns(self, mixed):
        keys = (
            "crack_depth_mm",
            "wear_depth_um",
            "eccentricity_um",
            "pitted_share",
            "parts.0.crack_depth_mm",
            "parts.0.crack_angle_deg",
            "parts.1.pit_length_mm",
        )
        params = {key for key in mixed.columns if key.startswith("params/")}
        assert {f"params/fault.{key}" for key in keys} <= params
        ends = (".tooth", ".kind", ".parts", ".wear_profile")
        assert not [key for key in params if key.endswith(ends)]
        for name, prefix in (("compound", "parts."), ("wear", "wear_")):
            own = mixed.columns["label_name"] == name
            for key in params:
                if key.startswith(f"params/fault.{prefix}"):
                    assert_array_equal(np.isfinite(mixed.columns[key]), own)

    def test_parts_are_recorded_whole(self, mixed):
        drawn = []
        for record in self.of(mixed, "compound"):
            parts = crack, pit = json.loads(record["faults_json"])
            assert (crack["kind"], crack["gear"]) == ("crack", "wheel")
            assert (pit["kind"], pit["gear"], pit["tooth"]) == ("pitting", "pinion", 2)
            assert "vary" not in crack | pit
            assert_allclose(crack["crack_depth_mm"], 1.0, rtol=1e-12, atol=0)
            for number, part in enumerate(parts):
                for key, value in part.items():
                    if isinstance(value, float):
                        stored = record[f"params/fault.parts.{number}.{key}"]
                        assert_allclose(stored, value, rtol=1e-12, atol=0)
            assert record["fault_gear"] == "wheel"
            assert record["fault_tooth"] == crack["tooth"]
            drawn.append((crack["tooth"], pit["pit_length_mm"], pit["pit_width_mm"]))
        teeth, *sizes = zip(*drawn, strict=True)
        assert len(set(teeth)) > 5
        assert max(teeth) > 22  # over the wheel's teeth, not the pinion's
        assert all(len(set(values)) == len(values) for values in sizes)

    def test_row_faults_are_those_of_the_plan(self, mixed):
        for name in MIXED:
            n_faults = {len(row_faults(record)) for record in self.of(mixed, name)}
            assert n_faults == {{"healthy": 0, "compound": 2}.get(name, 1)}

    @pytest.mark.parametrize("name", ["wear", "distributed_pitting"])
    def test_a_fault_on_all_teeth_has_no_number(self, mixed, name):
        for record in self.of(mixed, name):
            assert (record["fault_tooth"], record["fault_gear"]) == (-1, "pinion")
            assert json.loads(record["faults_json"])[0]["tooth"] == "all"

    def test_runout_has_a_tooth(self, mixed):
        teeth = {record["fault_tooth"] for record in self.of(mixed, "runout")}
        assert len(teeth) > 5
        assert min(teeth) >= 0

    def test_whole_numbers_are_drawn_whole(self, mixed):
        records = self.of(mixed, "distributed_pitting")
        seeds = [json.loads(row["faults_json"])[0]["pit_seed"] for row in records]
        assert all(isinstance(seed, int) for seed in seeds)
        assert len(set(seeds)) == len(seeds)

    def test_severity_is_the_largest_of_the_parts(self, mixed, xiamen):
        for record in self.of(mixed, "compound"):
            parts = [severity([fault], xiamen.gears) for fault in row_faults(record)]
            assert_allclose(record["severity"], max(parts), rtol=1e-12, atol=0)
        faulty = mixed.columns["label"] > 0
        assert (mixed.columns["severity"][faulty] > 0).all()
        assert (mixed.columns["severity"] <= 1).all()

    def test_a_sham_keeps_the_faults_on_paper(self, config, mixed):
        sham = make_plan(config.with_keys("plan", sham=True))
        assert not sham.columns["severity"].any()
        size = "params/fault.parts.1.pit_length_mm"
        for key in ("label", "faults_json", "fault_tooth", size):
            assert_array_equal(sham.columns[key], mixed.columns[key])

    @pytest.fixture(scope="class")
    @classmethod
    def hot(cls, config):
        """Names of the classes that ``fault_multihot`` has for a row of the plan."""
        short = config.with_keys("operating", duration_s=0.01)
        short = short.with_keys("sensing", snr_db=None)

        def of_row(row, **classes):
            record = simulate_record(
                InputReader(short.with_keys("classes", **classes)), row
            )
            return {MIXED[k] for k in np.flatnonzero(record.signals["fault_multihot"])}

        return of_row

    @pytest.mark.parametrize(
        ("name", "expected"),
        [
            ("compound", {"compound", "crack"}),
            ("crack", {"crack"}),
            ("wear", {"wear"}),
            ("healthy", {"healthy"}),
        ],
    )
    def test_every_class_of_a_compound_is_hot(self, mixed, hot, name, expected):
        """The classes that are present: the compound one and those of its parts; a single fault
        brings one."""
        assert hot(self.of(mixed, name)[0]) == expected

    def test_two_cracks_are_a_crack(self, mixed, hot):
        row = self.of(mixed, "compound")[0]
        crack = json.loads(row["faults_json"])[0]
        both = json.dumps([crack, {**crack, "gear": "pinion", "tooth": 3}])
        assert hot({**row, "faults_json": both}) == {"compound", "crack"}

    def test_another_class_of_the_same_kind_is_not(self, config, mixed, hot):
        """A single fault is of its own class alone, say small cracks beside large ones."""
        row = self.of(mixed, "crack")[0]
        assert hot(row, wear=config["classes"]["crack"]) == {"crack"}

    @pytest.mark.parametrize(
        ("fault", "text"),
        [
            ("crack, gear: wheel, tooth: 84", "fault.tooth = 84 is not on the wheel"),
            ("crack, crack_depth_mm: 5", "reaches through the root chord"),
            ("wear, wear_depth_um: 200", "above 1"),
            (
                "crack, vary: {crack_dept_mm: {}}",
                "fault.vary: 'crack_dept_mm' is no key of fault=crack",
            ),
            ("crack, crack_dept_mm: 1", "fault.parts.0: unknown key 'crack_dept_mm'"),
        ],
    )
    def test_parts_are_checked_before_anything_runs(self, fault, text):
        words = ["fault=compound", f"fault.parts=[{{kind: {fault}}}]"]
        with refused(text, GensigError):
            make_plan(read_request(words).config)


@pytest.mark.parametrize(
    "words",
    [
        ("fault=broken", "mesh.law=paper"),
        ("fault=crack", "fault.crack_angle_deg=80"),
        ("fault=crack", "fault.crack_depth_mm=3.6"),
    ],
)
def test_what_the_mesh_refuses_is_refused_before_anything_runs(words):
    config = read_request([*words, "plan.n_records=2"]).config
    with pytest.raises(GensigError):
        read_system(config).mesh_table(read_faults(config["fault"]))
    with pytest.raises(GensigError):
        make_plan(config)
