"""Blocks that carry and blocks held out, and the refusal of a block that carried."""

import numpy as np
import pytest
from implant_samples import CARRIER_TEETH, carrier
from refusals import refused
from test_implanting import implanter

from gensig.errors import ConfigError, DatasetError
from gensig.implants.blocks import blocks_content, read_blocks, refuse_carried
from gensig.implants.gearing import Gearing


def test_blocks_do_not_overlap_and_every_record_lies_in_one_that_carries(
    pairs, healthy
):
    made = implanter(pairs, healthy, n_records=300)
    blocks = made.cut.blocks
    covered = [np.zeros(each.acceleration.shape[1], dtype=int) for each in healthy]
    for block in blocks:
        covered[block.recording][block.start : block.stop] += 1
    assert max(cover.max() for cover in covered) == 1
    for draw in made.plan.draws:
        assert draw.block.carries
        assert draw.block.start <= draw.start
        assert draw.start + made.cut.n_samples <= draw.block.stop
    held = [block for block in blocks if not block.carries]
    assert {block.recording for block in held} == {0, 1}


@pytest.mark.parametrize("protocol", ["by_unit", "new_machine"])
def test_no_block_and_no_simulated_gears_are_on_two_sides(pairs, healthy, protocol):
    from gensig.dataset.splitting.protocols import make_splits

    table = implanter(pairs, healthy, n_records=240).plan.table
    split = make_splits(table, 0)[protocol]
    subset = dict(zip(split.record_id.tolist(), split.subset.tolist(), strict=True))
    columns = ["unit_id"]
    if protocol == "new_machine":
        columns.append("specimen_id")
    for column in columns:
        sides = {}
        for record, value in zip(
            table.columns["record_id"].tolist(),
            table.columns[column].tolist(),
            strict=True,
        ):
            sides.setdefault(value, set()).add(subset[record])
        assert all(len(each) == 1 for each in sides.values())


def test_a_block_that_carried_is_refused_and_one_held_out_is_not(pairs, healthy):
    blocks = implanter(pairs, healthy).cut.blocks
    config = {"implants": {"blocks": blocks_content(blocks)}}
    stored = read_blocks(config)
    assert stored == blocks
    held = next(block for block in blocks if not block.carries)
    recording = healthy[held.recording]
    refuse_carried(stored, recording, start=held.start, stop=held.stop)
    refuse_carried(stored, held.sha256, start=held.start, stop=held.stop)
    with pytest.raises(
        DatasetError, match=rf"carried implants.*held out.*{held.start}"
    ):
        refuse_carried(stored, recording, start=held.start - 1, stop=held.stop)
    with refused("mine: samples 0 to", DatasetError):
        refuse_carried(stored, held.sha256, name="mine")
    refuse_carried(stored, carrier(9)[0])  # another recording of the machine
    assert read_blocks({"seed": 0}) == ()


def test_a_damaged_list_is_refused():
    with refused("list of blocks is damaged", DatasetError):
        read_blocks({"implants": {"blocks": [{"number": 0}]}})


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"duration": 3.0}, r"too few blocks: 16 s .* 5"),
        ({"duration": 0.1}, r"turns of the slowest shaft; at least 3"),
        ({"n_records": 20}, r"--records 20: .* at least"),
    ],
)
def test_too_few(pairs, healthy, choices, words):
    with pytest.raises(ConfigError, match=words):
        implanter(pairs, healthy, **choices)


@pytest.mark.parametrize("teeth", [(20,), (20, 30, 40), (3, 20), ()])
def test_teeth_that_are_no_stages(teeth):
    with refused("--teeth"):
        Gearing(teeth=teeth)


def test_a_short_set_of_teeth_is_taken():
    assert Gearing(teeth=CARRIER_TEETH).n_stages == 1
