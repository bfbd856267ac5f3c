"""Names with units at the boundary, SI inside."""

import math
from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from gensig.errors import ConfigError
from gensig.units import (
    UNITS,
    check_choice,
    check_limits,
    check_positive,
    check_ranges,
    from_si,
    naming,
    read,
    read_kind,
    split_unit,
    to_si,
    unit,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    name: str
    length: float = unit("mm")
    inertia: float = unit("kg_m2")
    angle: float | None = unit("deg")
    n_keys: int
    hollow: bool
    share: float
    labels: tuple[str, ...] = field(default=())
    seats: tuple[float, ...] | None = unit("mm", default=None)
    places: int | str | tuple[int, ...] = 0
    width: float | None = unit("mm", default=None)


GOOD = {
    "length_mm": 12.5,
    "inertia_kg_m2": 2,
    "angle_deg": 90,
    "n_keys": 2,
    "hollow": True,
    "share": 0.5,
}


def shaft(**changes):
    return read(
        Shaft,
        {**GOOD, **changes},
        "gear.shaft",
        name="shaft",
    )


@given(
    st.sampled_from(sorted(UNITS)),
    st.floats(-1e9, 1e9),
)
def test_there_and_back(suffix, value):
    name = f"quantity_{suffix}"
    assert_allclose(
        from_si(name, to_si(name, value)),
        value,
        rtol=1e-14,
        atol=1e-300,
    )


@given(st.floats(-1e9, 1e9))
def test_a_name_without_unit_is_taken_as_it_is(value):
    assert_array_equal(
        [to_si("share", value), from_si("share", value)],
        value,
    )


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("normal_module_mm", 2, 2e-3),
        ("backlash_um", 80, 80e-6),
        ("pressure_angle_deg", 180, math.pi),
        ("speed_rpm", 60, 2 * math.pi),
        ("youngs_modulus_gpa", 206, 206e9),
        ("inertia_kg_m2", 3, 3),
        ("snr_db", 20, 20),
    ],
)
def test_factors(name, value, expected):
    assert_allclose(to_si(name, value), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("inertia_kg_m2", ("inertia", "kg_m2")),
        ("stiffness_x_n_per_m", ("stiffness_x", "n_per_m")),
        ("damping_ns_per_m", ("damping", "ns_per_m")),
        ("stiffness_nm_per_rad", ("stiffness", "nm_per_rad")),
        ("mass_kg", ("mass", "kg")),
        ("n_teeth", ("n_teeth", None)),
        ("profile_shift", ("profile_shift", None)),
        ("mm", ("mm", None)),
    ],
)
def test_the_longest_suffix_wins(name, parts):
    assert split_unit(name) == parts


def test_read_converts_and_fills():
    result = shaft(
        labels=["a", "b"],
        seats_mm=[1, 2.5],
        width_mm=4,
    )
    assert_allclose(
        (result.length, result.inertia),
        (12.5e-3, 2.0),
    )
    assert_allclose(
        (result.angle, result.width),
        (math.pi / 2, 4e-3),
    )
    assert_allclose(result.seats, (1e-3, 2.5e-3))
    assert (result.name, result.n_keys, result.hollow) == ("shaft", 2, True)
    assert result.labels == ("a", "b")

    empty = shaft(angle_deg=None, seats_mm=None)
    assert empty.angle is empty.seats is empty.width is shaft().seats is None


@pytest.mark.parametrize(
    ("value", "expected"),
    [(3, 3), ("all", "all"), ([3], (3,)), ([1, 5], (1, 5)), ((1, 5), (1, 5)), ([], ())],
)
def test_a_number_a_word_or_a_list(value, expected):
    result = shaft(places=value).places
    assert result == expected
    assert type(result) is type(expected)


NUMBERS = "is not a list of numbers or null"
PLACES = "is not a whole number or text or a list of whole numbers"
MISTAKES = [
    ("lenght_mm", 1, ": unknown key 'lenght_mm'; did you mean 'length_mm'?"),
    ("length_um", 1, ": 'length_um' has the wrong unit; write it as 'length_mm'"),
    ("length", 1, ": 'length' has the wrong unit; write it as 'length_mm'"),
    ("share_mm", 1, ": 'share_mm' has the wrong unit; write it as 'share'"),
    ("seats", [1], ": 'seats' has the wrong unit; write it as 'seats_mm'"),
    ("name", "x", ": unknown key 'name'"),
    ("zzz", 1, ": unknown key 'zzz'; known: length_mm, inertia_kg_m2, angle_deg, n_k"),
    ("length_mm", "long", ".length_mm = 'long' is not a number"),
    ("length_mm", True, ".length_mm = True is not a number"),
    ("length_mm", math.inf, ".length_mm = inf is not finite"),
    ("length_mm", None, ".length_mm is null; give a value"),
    ("length_mm", [1], ".length_mm = [1] is not a number"),
    ("n_keys", 2.5, ".n_keys = 2.5 is not a whole number"),
    ("n_keys", True, ".n_keys = True is not a whole number"),
    ("hollow", "yes", ".hollow = 'yes' is not true or false"),
    ("labels", "ab", ".labels = 'ab' is not a list of names"),
    ("labels", ["a", 1], ".labels = ['a', 1] is not a list of names"),
    ("labels", None, ".labels is null; give a value"),
    ("seats_mm", [1, "x"], f".seats_mm = [1, 'x'] {NUMBERS}"),
    ("seats_mm", [1, math.nan], f".seats_mm = [1, nan] {NUMBERS}"),
    ("seats_mm", 3, f".seats_mm = 3 {NUMBERS}"),
    ("angle_deg", "x", ".angle_deg = 'x' is not a number or null"),
    ("angle_deg", math.inf, ".angle_deg = inf is not finite"),
    ("places", 1.5, f".places = 1.5 {PLACES}"),
    ("places", True, f".places = True {PLACES}"),
    ("places", [1, True], f".places = [1, True] {PLACES}"),
    ("places", ["all"], f".places = ['all'] {PLACES}"),
    ("places", {"a": 1}, f".places = {{'a': 1}} {PLACES}"),
]


@pytest.mark.parametrize(
    ("key", "value", "text"),
    MISTAKES,
)
def test_mistakes_are_answered(key, value, text):
    with refused(f"gear.shaft{text}"):
        shaft(**{key: value})


def test_missing_keys_are_named():
    values = {key: GOOD[key] for key in GOOD if key not in ("length_mm", "n_keys")}
    with refused("gear.shaft: missing length_mm, n_keys"):
        read(Shaft, values, "gear.shaft", name="shaft")


FAULTS = [
    (check_limits, {"length": 0.2}, "gear.length_mm = 200 must lie in 1..100"),
    (check_limits, {"share": math.nan}, "gear.share = nan must lie in 0..1"),
    (check_ranges, {"seats": (0.05, 0.2)}, "gear.seats_mm = [50, 200] must be two ord"),
    (check_ranges, {"seats": (0.05, 0.02)}, "ordered numbers, [low, high], in 0..100"),
    (check_ranges, {"seats": (0.05,)}, "two ordered"),
]
LIMITS = {
    "length": (1e-3, 0.1),
    "share": (0.0, 1.0),
    "seats": (0.0, 0.1),
}


@pytest.mark.parametrize(
    ("check", "changes", "text"),
    FAULTS,
)
def test_checks_name_the_field_in_its_unit(check, changes, text):
    limits = {name: LIMITS[name] for name in changes}
    with refused(text):
        check(
            replace(shaft(), **changes),
            "gear.",
            **limits,
        )


def test_positive_fields_and_choices_are_named():
    with refused("gear.length_mm = 0 must be positive"):
        check_positive(
            replace(shaft(), length=0.0),
            "gear.",
            "share",
            "length",
        )
    with refused("gear.name = 'shaft'; allowed: a, 1"):
        check_choice("gear.name", "shaft", ("a", 1))


def test_checks_pass_what_is_allowed():
    allowed = replace(
        shaft(),
        seats=(0.0, 0.1),
        angle=None,
    )
    check_positive(allowed, "", "length", "angle")
    check_limits(
        allowed,
        "",
        length=(allowed.length, allowed.length),
        angle=(0.0, 1.0),
    )
    check_ranges(allowed, "", seats=(0.0, 0.1))
    check_choice("name", allowed.name, ("shaft",))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"kind": "x"}, "gear.part: kind = 'x'; allowed: shaft"),
        ({"kind": None}, "gear.part: kind = None"),
        ({"kind": ["shaft"]}, "gear.part: kind = ['shaft']"),
        ({"kind": "shaft", "name": 3}, "gear.part.name = 3 is not text"),
    ],
)
def test_a_kind_is_read_by_its_name(values, text):
    given = {**GOOD, "name": "a", "kind": "shaft"}

    def read_part(part):
        return read_kind({"shaft": Shaft}, part, "gear.part")

    assert read_part(given) == replace(shaft(), name="a")
    with refused(text):
        read_part({**GOOD, **values})
    with refused("kind = None"):
        read_part("shaft")


@pytest.mark.parametrize(
    ("text", "named"),
    [("low", "gear.part: low"), ("gear.x: low", "gear.x: low")],
)
def test_an_error_without_its_group_gets_a_name(text, named):
    with pytest.raises(ConfigError, match=f"^{named}$"), naming("gear.part: "):
        raise ConfigError(text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Switch:
    share: float
    is_on: bool = False
    seats: tuple[float, ...] = unit("mm", default=())


def test_equal_keys_are_read_once():
    """Of lists, which have no hash, the values are equal all the same."""
    first, again = (read(Switch, {"share": 0.5}, "switch") for _ in range(2))
    assert again is first
    assert read(Switch, {"share": 0.6}, "switch") != first
    seats = {"share": 0.5, "seats_mm": [1, 2]}
    assert read(Switch, seats, "switch") == read(Switch, seats, "switch") != first


def test_true_is_not_the_one_that_was_read_before():
    """They are equal in Python: neither passes for the other."""
    assert read(Switch, {"share": 1}, "switch").share == 1.0
    with refused("switch.share = True is not a number"):
        read(Switch, {"share": True}, "switch")
    assert read(Switch, {"share": 1, "is_on": True}, "switch").is_on
    with refused("switch.is_on = 1 is not true or false"):
        read(Switch, {"share": 1, "is_on": 1}, "switch")
