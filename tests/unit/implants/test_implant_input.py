"""Bad input of implants: one line each."""

from dataclasses import replace

import numpy as np
import pytest
from implant_samples import CARRIER_RATE, carrier, write_pairs
from refusals import refused
from test_implanting import implanter

from gensig.errors import ConfigError, DatasetError, TooShortError
from gensig.implants.options import ImplantOptions
from gensig.implants.simulated_pairs import SimulatedPairs, class_of


def implants_refused(kind, words, pairs, recordings, **choices):
    with pytest.raises(kind, match=words) as caught:
        implanter(pairs, recordings, **choices)
    assert "\n" not in str(caught.value)


def test_no_mesh_near_the_stated_speed(pairs, healthy):
    implants_refused(ConfigError, r"h0: no s.* the mesh", pairs, healthy, speed=700.0)


def test_another_rate_or_channel_among_the_recordings(pairs, healthy):
    faster = replace(healthy[1], sampling_rate=1.5 * CARRIER_RATE)
    implants_refused(
        ConfigError, r"h1 has 12288 samples a second", pairs, [healthy[0], faster]
    )
    other = replace(healthy[1], sensors=("lid",))
    implants_refused(
        ConfigError, r"h1 has the channels lid", pairs, [healthy[0], other]
    )
    slow = replace(healthy[0], sampling_rate=4000.0)
    implants_refused(ConfigError, r"at least 5000 are needed", pairs, [slow])


def test_the_same_recording_twice(pairs, healthy):
    implants_refused(
        ConfigError, r"give each recording once", pairs, [healthy[0], healthy[0]]
    )


def test_a_recording_of_too_few_turns(pairs):
    implants_refused(
        TooShortError, r"h0: too short", pairs, [carrier(0, seconds=0.3)[0]]
    )


def test_as_many_speeds_as_recordings(pairs, healthy):
    from gensig.implants.carriers import follow_all, healthy_recording
    from gensig.implants.gearing import Gearing

    taken = [healthy_recording(each, f"h{k}") for k, each in enumerate(healthy)]
    with refused("3 speeds for 2 recordings"):
        follow_all(taken, Gearing(teeth=(20, 30)), [900.0] * 3)
    with refused("at least one healthy recording"):
        follow_all([], Gearing(teeth=(20, 30)), [900.0])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"twins": False}, r"stores no healthy twins.*store_healthy_twin=true"),
        ({"noise": 0.1}, r"records have noise.*sensing.snr_db=null"),
        ({"classes": ("healthy",)}, r"no record differs from its healthy twin"),
    ],
)
def test_sets_that_have_no_residuals(tmp_path, changes, words):
    with (
        write_pairs(tmp_path / "set", n_units=1, **changes) as data,
        pytest.raises(DatasetError, match=words),
    ):
        SimulatedPairs(data)


def test_classes_follow_the_number_of_teeth():
    one = '[{"kind": "crack", "gear": "pinion", "tooth": 4}]'
    same = f'{one[:-1]}, {{"kind": "pitting", "gear": "pinion", "tooth": 4}}]'
    other = f'{one[:-1]}, {{"kind": "pitting", "gear": "wheel", "tooth": 4}}]'
    assert class_of("[]") == "healthy"
    assert class_of(one) == class_of(same) == "one_tooth"
    assert class_of(other) == "many_teeth"
    assert (
        class_of('[{"kind": "wear", "gear": "pinion", "tooth": "all"}]') == "many_teeth"
    )
    assert (
        class_of('[{"kind": "spalling", "gear": "wheel", "tooth": [1, 2]}]')
        == "many_teeth"
    )
    assert class_of('[{"kind": "runout", "gear": "wheel", "tooth": "all"}]') is None


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"gain_db": (3.0, -3.0)}, "lower end first"),
        ({"gain_db": (np.nan, 3.0)}, "--gain-db"),
        ({"path": "some"}, "--path some: allowed are twin, none"),
        ({"residual": "some"}, "--residual some: allowed are physics"),
        ({"n_records": 0}, "--records 0"),
        ({"duration": -1.0}, "--duration"),
        ({"held_out": 1.0}, "--held-out 1"),
        ({"plain_healthy": 1.5}, "--plain-healthy 1.5"),
        ({"seed": -1}, "--seed -1"),
    ],
)
def test_options(choices, words):
    with refused(words):
        ImplantOptions(**choices)
