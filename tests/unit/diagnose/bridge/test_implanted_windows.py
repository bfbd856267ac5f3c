"""Blocks that carry and stretches that are judged never overlap; a wrong claim is refused."""

from dataclasses import replace

import numpy as np
import pytest
from made_rig import write_rig

from diagnose.bridge.bridge_machine import bridge_machine
from diagnose.bridge.implanted_windows import (
    Stretch,
    check_stretches,
    healthy_stretches,
    judged_stretches,
    judged_windows,
)
from diagnose.bridge.protocol import FROZEN
from diagnose.bridge.rules import handbook_answers
from gensig.errors import DatasetError
from gensig.implants.blocks import Block
from gensig.implants.carriers import samples_digest
from gensig.measured import load

LENGTH = 36_000


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    folder = write_rig(tmp_path_factory.mktemp("rig"))
    return bridge_machine(load(None, folder), FROZEN)


@pytest.fixture(scope="module")
def blocks(machine):
    """Six blocks a recording, the last two of them held out."""
    made = []
    for number, sample in enumerate(machine.healthy):
        for k in range(6):
            made.append(
                Block(
                    number=len(made),
                    recording=number,
                    file=sample.source.name,
                    sha256=sample.source.sha256,
                    samples_sha256=samples_digest(sample.signal),
                    start=6000 * k,
                    stop=6000 * (k + 1),
                    carries=k < 4,
                )
            )
    return tuple(made)


def test_only_what_was_held_out_of_healthy_recordings_is_judged(
    machine, blocks
) -> None:
    stretches = judged_stretches(machine, blocks)
    spans = [(one.start, one.stop) for one in stretches]
    assert spans == [(24_000, 36_000)] * 2 + [(0, LENGTH)] * 4
    learnt = healthy_stretches(machine, blocks, carry=True)
    assert [(one.start, one.stop) for one in learnt] == [(0, 24_000)] * 2


@pytest.mark.parametrize(
    ("start", "stop"), [(0, LENGTH), (23_999, 30_000), (6000, 6001)]
)
def test_a_block_that_carried_is_refused(machine, blocks, start, stop) -> None:
    stretch = Stretch(sample=machine.healthy[0], start=start, stop=stop)
    with pytest.raises(
        DatasetError, match=r"carried implants .* held out are its samples 24000"
    ):
        check_stretches([stretch], blocks)


def test_a_carrier_under_another_name_is_refused_too(machine, blocks) -> None:
    """The samples count, not the name of the file."""
    sample = machine.healthy[0]
    renamed = replace(
        sample, source=replace(sample.source, name="other.npy", sha256="0")
    )
    with pytest.raises(DatasetError, match=r"^other\.npy: samples"):
        check_stretches([Stretch(sample=renamed, start=0, stop=LENGTH)], blocks)


def test_windows_cover_their_stretch_and_know_their_recording(machine, blocks) -> None:
    stretches = judged_stretches(machine, blocks)
    windows = judged_windows(stretches, 2000, FROZEN)
    assert set(windows.record) == set(range(len(stretches)))
    for number, one in enumerate(stretches):
        starts = windows.start[windows.record == number]
        assert starts.min() == 0
        assert one.stop - one.start - starts.max() - 2000 < 1000
    cut = windows.cut(np.arange(len(windows)))
    np.testing.assert_allclose(np.square(cut).mean(axis=-1), 1.0, rtol=1e-3)


def test_the_handbook_rule_reads_kurtosis_and_level(machine, blocks) -> None:
    """Knocks once a turn are impulsive; the level is that of the carrying blocks."""
    stretches = judged_stretches(machine, blocks)
    answers = handbook_answers(
        healthy_stretches(machine, blocks, carry=True), stretches
    )
    labels = [one.sample.label for one in stretches]
    sound, knocking = labels.index("healthy"), labels.index("one_tooth")
    assert answers.predicted[0, sound] == 0
    assert answers.predicted[0, knocking] == 1
    assert answers.faulty[0, knocking] > answers.faulty[0, sound]
