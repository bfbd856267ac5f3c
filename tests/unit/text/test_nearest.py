"""Hints for a name that does not exist."""

import pytest

from gensig.text.nearest import hint, near

FAULTS = ("crack", "cracks", "cracked", "pitting", "wear")


@pytest.mark.parametrize("n", [1, 2, 3])
def test_at_most_n_names_are_near(n):
    close = near("crac", FAULTS, n=n)
    assert len(close) == n
    assert close[0] == "crack"
    assert hint("crac", FAULTS, n=n).count("crack") == n


def test_a_beginning_counts_from_three_letters_on_in_any_case():
    assert near("PIT", FAULTS) == ["pitting"]
    assert near("pi", FAULTS) == []


def test_where_nothing_is_near_all_are_listed_up_to_a_number():
    assert hint("zzz", ()) == "there is none"
    assert hint("zzz", FAULTS) == f"there is {', '.join(FAULTS)}"
    assert hint("zzz", FAULTS, listed=2) == "there is crack, cracks and 3 more"
