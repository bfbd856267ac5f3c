"""An option of the faults by itself: composed without the words that cannot change it."""

from importlib import resources

import pytest

from gensig.options.compose import compose, options
from gensig.plan.request import _fault_option, read_request


class TestFaultOptionAlone:
    OTHERS = ("experiment=quickstart", "gear.normal_module_mm=3", "operating.torque_nm=7", "seed=4", "out=x.y")

    def test_no_option_of_the_package_refers_to_another_group(self):
        folder = resources.files("gensig.configs").joinpath("fault")
        texts = [path.read_text(encoding="utf-8") for path in folder.iterdir() if path.name.endswith(".yaml")]
        assert len(texts) == len(options("fault"))
        assert not any("${" in text for text in texts)

    @pytest.mark.parametrize("fault", options("fault"))
    def test_it_is_that_of_the_whole_configuration(self, fault):
        words = [*self.OTHERS, f"fault={fault}"]
        assert _fault_option(words, None) == compose("generate", words)["fault"]

    def test_a_reference_to_another_group_is_followed(self):
        words = ["operating.torque_nm=3", "fault.crack_depth_mm=${operating.torque_nm}", "fault=crack"]
        request = read_request(["plan.classes=[crack]", *words[:2]])
        assert request.config["classes"]["crack"]["crack_depth_mm"] == 3
        assert _fault_option(words, None)["crack_depth_mm"] == 3

    def test_nobody_can_change_what_the_next_one_gets(self):
        _fault_option(["fault=crack"], None)["vary"].clear()
        assert _fault_option(["fault=crack"], None)["vary"]
