"""Laws of the tooth network: its sites turn with the gear, and it finds a tooth that differs."""

import numpy as np
import pytest
import torch
from small_studies import settings_of
from torch.nn.functional import pad

from diagnose.data.packed_turns import HEADER
from diagnose.data.targets import GEARS
from diagnose.networks.registry import build_model
from diagnose.networks.tooth_batch import ToothBatch
from diagnose.networks.tooth_entry import EntryEstimator, rolled, sample_of
from diagnose.networks.tooth_network import NEVER
from gensig.errors import ConfigError

TEETH, PER_TOOTH, CHANNELS, CLASSES = (7, 11), 16, 2, 3
FIRST_OF_WHEEL = len(GEARS) + TEETH[0]


def network(seed=0, **changes):
    """A network of small gears with random weights."""
    options = {"samples_per_tooth": PER_TOOTH}
    options |= {"unexplained": False, **changes}
    torch.manual_seed(seed)
    config = settings_of("model=tooth").model | options
    return build_model(config, n_channels=CHANNELS, n_classes=CLASSES).eval()


def windows(n=4, seed=1, teeth=TEETH):
    """Random turns of both gears with the mean passage behind them."""
    torch.manual_seed(seed)
    random = torch.randn(n, CHANNELS, PER_TOOTH * (sum(teeth) + 1))
    header = torch.tensor(teeth, dtype=torch.float32).expand(n, CHANNELS, HEADER)
    return torch.cat([header, random], dim=-1)


def turned(packed, samples):
    """Both turns and the passage, begun some samples later."""
    lengths = [HEADER, *(teeth * PER_TOOTH for teeth in (*TEETH, 1))]
    shift = torch.full((len(packed),), samples)
    header, *parts = packed.split(lengths, -1)
    return torch.cat([header, *(rolled(part, shift) for part in parts)], -1)


@pytest.fixture(scope="module")
def scores():
    with torch.inference_mode():
        return network().site_scores(windows())


def test_a_site_is_no_gear_a_whole_gear_or_a_tooth(scores):
    sites = network().sites(TEETH)
    assert scores.shape == (4, len(sites), CLASSES)
    assert sites[:3] == (("none", -1), ("pinion", -1), ("wheel", -1))
    assert sites[FIRST_OF_WHEEL] == ("wheel", 0)
    assert [gear for gear, _ in sites].count("wheel") == 1 + TEETH[1]


@pytest.mark.parametrize(("passages", "level_samples"), [(1, 0), (3, 0), (3, 3)])
def test_sites_turn_with_the_gears(passages, level_samples):
    model = network(level_samples=level_samples)
    with torch.inference_mode():
        scores = model.site_scores(windows())
        later = model.site_scores(turned(windows(), passages * PER_TOOTH))
    whole, pinion, wheel = scores.split((len(GEARS), *TEETH), dim=1)
    expected = [whole, pinion.roll(-passages, 1), wheel.roll(-passages, 1)]
    torch.testing.assert_close(later, torch.cat(expected, dim=1), rtol=1e-4, atol=1e-5)


def test_the_estimated_entry_turns_with_the_passage(scores):
    model, shift = network(), 5
    with torch.inference_mode():
        mesh = windows()[..., -PER_TOOTH:]
        entry = model.entry.entry(mesh)
        later = model.entry.entry(rolled(mesh, torch.full((4,), shift)))
        classes = model(turned(windows(), shift))
        expected = model(windows())
    assert torch.equal(torch.remainder(entry - shift, PER_TOOTH), later)
    torch.testing.assert_close(classes, expected, rtol=1e-4, atol=1e-5)


def test_a_class_has_the_log_sum_of_its_sites(scores):
    with torch.inference_mode():
        answers = network().answers(windows())
    torch.testing.assert_close(answers["classes"], torch.logsumexp(scores, dim=1))
    total = answers["gear"].exp().sum(dim=1)
    torch.testing.assert_close(total, torch.ones(4))
    assert set(answers) == {"classes", "sites", *network().head_names}


def known_teeth(n):
    """(window, gear) teeth of some windows."""
    return torch.tensor([TEETH] * n)


def known(label, gear, tooth, entry=0.25):
    """Label and targets of windows with faults on teeth, counted from the first that enters."""
    position = np.where(np.array(tooth) < 0, np.nan, np.array(tooth) + entry)
    return torch.tensor(label), {
        "gear": torch.tensor(gear),
        "position": torch.tensor(position),
        "entry": torch.full((len(label),), entry),
        "severity": torch.where(torch.tensor(label) > 0, 0.5, torch.nan),
    }


@pytest.mark.parametrize("entry", [0.0, 0.25, 0.98, 0.999])
def test_a_known_fault_is_at_the_site_of_its_tooth(entry):
    _, targets = known([0, 1, 1, 2], [0, 1, 2, 2], [-1, 3, 10, -1], entry)
    wrap = int(sample_of(torch.tensor(entry), PER_TOOTH) == 0 and entry > 0.5)
    teeth = [3 + 3 + wrap, FIRST_OF_WHEEL + (10 + wrap) % TEETH[1]]
    assert network()._known_site(targets, known_teeth(4)).tolist() == [0, *teeth, 2]


def test_it_learns_a_tooth_that_differs_on_either_gear():
    model = network().train()
    rng = np.random.default_rng(0)
    n, lengths = 48, [teeth * PER_TOOTH for teeth in (*TEETH, 1)]
    label = np.arange(n) % CLASSES
    gear = np.where(label > 0, 1 + np.arange(n) // CLASSES % 2, 0)
    tooth = np.where(gear > 0, rng.integers(0, 7, n), -1)
    packed = windows(n)
    packed[..., HEADER:] *= 0.2
    for row in range(n):
        if gear[row]:
            first = HEADER + (gear[row] - 1) * lengths[0] + tooth[row] * PER_TOOTH + 8
            sign = 1 if label[row] == 1 else -1
            packed[row, :, first : first + 4] += 2.0 * sign
    labels, targets = known(label.tolist(), gear.tolist(), tooth.tolist(), entry=0.0)
    optimizer = torch.optim.Adam(model.parameters(), lr=0.01)
    for _ in range(40):
        optimizer.zero_grad()
        model.loss(packed, labels, targets, torch.ones(CLASSES)).backward()
        optimizer.step()
    model.eval()
    with torch.inference_mode():
        answers = model.answers(packed)
    assert (answers["classes"].argmax(1) == labels).float().mean() > 0.9
    assert (answers["gear"].argmax(1) == targets["gear"]).float().mean() > 0.9
    at_site = answers["sites"].flatten(1).argmax(1) // CLASSES
    assert (at_site == model._known_site(targets, known_teeth(n))).float().mean() > 0.9


@pytest.mark.parametrize("left_out", ["entry", "gear", "severity", "position"])
def test_a_missing_target_is_left_out_of_the_loss(left_out):
    labels, targets = known([0, 1], [0, 1], [-1, 2])
    del targets[left_out]
    loss = network().loss(windows(2), labels, targets, torch.ones(CLASSES))
    assert torch.isfinite(loss)


def test_an_unknown_entry_is_no_target():
    estimate = EntryEstimator(CHANNELS, PER_TOOTH, 4)
    mesh = windows()[..., -PER_TOOTH:]
    entry = torch.tensor([0.1, torch.nan, 0.3, torch.nan])
    torch.testing.assert_close(
        estimate.loss(mesh, entry), estimate.loss(mesh[::2], entry[::2])
    )
    assert estimate.loss(mesh, torch.full((4,), torch.nan)) == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"level_samples": 4}, "level_samples must be odd, or 0 for none, not 4"),
        ({"strides": [3, 2]}, "6 samples one, which does not divide the 16"),
        ({"kernels": [16, 9]}, "kernels must be odd"),
        ({"kernels": [9]}, "lists of the same length"),
        ({"kernels": [35, 9]}, "reaches beyond the neighboring teeth, 16 samples"),
    ],
)
def test_lists_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        network(**changes)


def test_levels_know_neither_sign_nor_loudness_of_a_turn():
    model, batch = network(level_samples=3), ToothBatch.of(windows())
    responses = torch.randn(4 * sum(TEETH), 8, PER_TOOTH // 4)
    levels = model._levels(responses, batch)
    torch.testing.assert_close(model._levels(-30.0 * responses, batch), levels)
    louder = responses.clone()
    louder[5] *= 10.0
    change = model._levels(louder, batch) - levels
    assert change[5].min() > 1.0
    others = change[batch.turn == batch.turn[5]].flatten(1).mean(dim=1)
    assert (others < 0).sum() == TEETH[0] - 1


OTHER = (5, 17)


def batch_of(*parts):
    """Windows of gears with different numbers of teeth, zeros behind the shorter ones."""
    length = max(part.shape[-1] for part in parts)
    return torch.cat([pad(part, (0, length - part.shape[-1])) for part in parts])


def test_scores_do_not_depend_on_other_windows_of_the_batch():
    few, many = windows(3), windows(2, seed=5, teeth=OTHER)
    model = network()
    with torch.inference_mode():
        together = model.answers(batch_of(few, many))
        alone = [model.answers(few), model.answers(many)]
    for name in ("classes", "gear", "severity"):
        expected = torch.cat([answers[name] for answers in alone])
        torch.testing.assert_close(together[name], expected, rtol=1e-4, atol=1e-5)
    n_sites = len(model.sites(TEETH))
    torch.testing.assert_close(
        together["sites"][:3, :n_sites], alone[0]["sites"], rtol=1e-4, atol=1e-5
    )
    assert torch.all(together["sites"][:3, n_sites:] == NEVER)


@pytest.mark.parametrize("n_behind", [1, 500, 5000])
def test_zeros_behind_a_window_change_nothing(scores, n_behind):
    with torch.inference_mode():
        longer = network().site_scores(pad(windows(), (0, n_behind)))
    assert torch.equal(longer, scores)


def test_gears_of_any_teeth_are_learnt_together():
    packed = batch_of(windows(3), windows(3, seed=5, teeth=OTHER))
    labels, targets = known([0, 1, 2] * 2, [0, 1, 2] * 2, [-1, 3, 10] * 2)
    model = network().train()
    model.loss(packed, labels, targets, torch.ones(CLASSES)).backward()
    for name, weight in model.named_parameters():
        assert torch.isfinite(weight.grad).all(), name
    teeth = torch.tensor([TEETH] * 3 + [OTHER] * 3)
    first = [len(GEARS) + TEETH[0] + 10, len(GEARS) + OTHER[0] + 10]
    assert model._known_site(targets, teeth)[2::3].tolist() == first


def test_a_given_entry_is_used_instead_of_the_estimate():
    model = network()
    with torch.inference_mode():
        estimated = model.entries(windows())
        same = model.site_scores(windows(), estimated)
        other = model.site_scores(windows(), estimated + 5)
        torch.testing.assert_close(same, model.site_scores(windows()))
    assert not torch.allclose(same, other)
