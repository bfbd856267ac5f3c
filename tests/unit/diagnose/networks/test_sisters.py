"""Operations on teeth are those of torch, and so are their gradients."""

import pytest
import torch

from diagnose.networks.sisters import TINY, permuted, standardised

COUNTS, FLOOR = (4, 7, 3), 0.1


def teeth(seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(sum(COUNTS), 2, 5, dtype=torch.float64, generator=generator)


def by_torch(values, floor):
    """The definition, turn by turn."""
    turns = []
    for turn in values.split(COUNTS):
        apart = turn - turn.mean(dim=0)
        turns.append(apart / (torch.sqrt(apart.square().mean(dim=0) + TINY) + floor))
    return torch.cat(turns)


def test_standardised_values_are_the_definition():
    torch.testing.assert_close(
        standardised(teeth(), COUNTS, FLOOR), by_torch(teeth(), FLOOR)
    )


def test_standardised_values_have_the_gradient_of_the_definition():
    values, expected = teeth().requires_grad_(), teeth().requires_grad_()
    weight = teeth(seed=1)
    (standardised(values, COUNTS, FLOOR) * weight).sum().backward()
    (by_torch(expected, FLOOR) * weight).sum().backward()
    torch.testing.assert_close(values.grad, expected.grad)


def test_equal_teeth_have_a_finite_gradient():
    values = torch.ones(sum(COUNTS), 3, dtype=torch.float64, requires_grad=True)
    standardised(values, COUNTS, FLOOR).square().sum().backward()
    assert torch.isfinite(values.grad).all()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_turn_depends_on_no_other(scale):
    values = teeth()
    other = values.clone()
    other[COUNTS[0] :] *= scale
    alone = standardised(values, COUNTS, FLOOR)[: COUNTS[0]]
    torch.testing.assert_close(standardised(other, COUNTS, FLOOR)[: COUNTS[0]], alone)


def test_permuted_values_and_their_gradient():
    place = torch.randperm(sum(COUNTS), generator=torch.Generator().manual_seed(2))
    inverse, weight = torch.argsort(place), teeth(seed=1)
    values, expected = teeth().requires_grad_(), teeth().requires_grad_()
    assert torch.equal(permuted(values, place, inverse), expected[place])
    (permuted(values, place, inverse) * weight).sum().backward()
    (expected[place] * weight).sum().backward()
    torch.testing.assert_close(values.grad, expected.grad)
