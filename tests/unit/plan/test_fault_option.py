"""Fault options, composed alone."""

import pytest

from gensig.options.compose import compose
from gensig.options.groups import options
from gensig.plan.request import read_request
from gensig.plan.sources import OptionFiles, StoredConfiguration
from gensig.plan.words import typed_words


def files_of(words):
    return OptionFiles(words=typed_words(words), config_dir=None)


class TestFaultOptionAlone:
    OTHERS = (
        "experiment=quickstart",
        "gear.normal_module_mm=3",
        "operating.torque_nm=7",
        "seed=4",
        "out=x.y",
    )

    @pytest.mark.parametrize("fault", options("fault"))
    def test_it_is_that_of_the_whole_configuration(self, fault):
        words = [*self.OTHERS, f"fault={fault}"]
        whole = compose("generate", words)["fault"]
        assert files_of(words).fault_option(fault) == whole

    @pytest.mark.parametrize("choice", ["plan.classes=[crack]", "fault=crack"])
    def test_a_reference_to_another_group_is_followed(self, choice):
        words = ["operating.torque_nm=3", "fault.crack_depth_mm=${operating.torque_nm}"]
        classes = read_request([choice, *words]).config["classes"]
        assert classes["crack"]["crack_depth_mm"] == 3

    def test_the_whole_configuration_is_composed_once(self, monkeypatch):
        composed = []

        def counted(name, *args, **kwargs):
            composed.append(name)
            return compose(name, *args, **kwargs)

        monkeypatch.setattr("gensig.plan.sources.compose", counted)
        read_request(["experiment=quickstart", "fault.crack_depth_mm=1.25"])
        assert composed.count("generate") == 1
        assert all(name == "generate" or name.startswith("fault/") for name in composed)

    def test_nobody_can_change_what_the_next_one_gets(self):
        files = files_of([])
        files.fault_option("crack")["vary"].clear()
        assert files.fault_option("crack")["vary"]

    def test_what_an_experiment_sets_of_every_fault_is_kept(self):
        classes = read_request(["experiment=engine_test_point"]).config["classes"]
        assert {fault["gear"] for fault in classes.values()} == {"wheel"}


STORED = read_request(["plan.classes=[healthy,crack,pitting]"]).config.plain()
PITTING = {**STORED["classes"]["pitting"], "gear": "wheel"}
STORED["classes"]["pitting"] = PITTING
STORED["fault"] = {**STORED["classes"]["crack"], "crack_depth_mm": 1.25}


class TestFaultOfADataSet:
    @staticmethod
    def of(words, name, fault_words=()):
        stored = StoredConfiguration(
            words=typed_words(words), config_dir=None, content=STORED
        )
        return stored.fault_option(name, fault_words)

    def test_no_name_is_the_stored_fault_whatever_is_typed(self):
        assert self.of([], None) == STORED["fault"]
        assert self.of(["fault=pitting"], None) == STORED["fault"]

    def test_a_class_is_as_stored_unless_it_is_typed(self):
        assert self.of([], "pitting") == PITTING
        assert self.of(["fault=crack"], "pitting") == PITTING
        option = files_of([]).fault_option("pitting")
        assert option != PITTING
        assert self.of(["fault=pitting"], "pitting") == option

    def test_a_class_that_is_not_stored_is_its_option(self):
        assert self.of([], "wear") == files_of([]).fault_option("wear")

    def test_typed_keys_go_on_top_of_a_copy(self):
        changed = self.of([], None, ("fault.crack_depth_mm=0.5",))
        assert changed == {**STORED["fault"], "crack_depth_mm": 0.5}
        assert STORED["fault"]["crack_depth_mm"] == 1.25

    def test_nobody_can_change_what_is_stored(self):
        self.of([], None)["vary"].clear()
        assert self.of([], None)["vary"]
