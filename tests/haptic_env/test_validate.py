"""The checks of user input themselves."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from haptic_env import validate

NO_NUMBERS = {
    "complex": np.zeros(3, complex),
    "text": ["1", "2", "3"],
    "bytes": np.array([b"1", b"2", b"3"]),
    "objects": np.array([1.0, None, 2.0]),
    "numbers that are objects": [Decimal(1), Decimal(2), Decimal(3)],
    "times": np.zeros(3, "timedelta64[s]"),
    "masked": np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]),
    "records": np.zeros(3, "f4,f4"),
    "ragged": [[1.0], [1.0, 2.0], [3.0]],
    "a dictionary": {0: 1.0},
    "nothing": None,
    "NaN": [0.0, np.nan, 0.0],
    "infinity": [0.0, -np.inf, 0.0],
    "an int beyond all": [10**400, 0, 0],
}


@pytest.mark.parametrize("name", NO_NUMBERS)
def test_what_is_no_array_of_finite_numbers_is_refused(name):
    given = NO_NUMBERS[name]
    for check in (lambda: validate.array("it", given, (3,)), lambda: validate.numbers("it", given)):
        with pytest.raises(ValueError, match=r"^it must be .*finite numbers.* got .+"):
            check()
    with pytest.raises(ValueError, match=r"^it must be 0 or 1.* got .+"):
        validate.binary("it", given, (3,))


@pytest.mark.skipif(np.finfo(np.longdouble).max <= np.finfo(np.float64).max, reason="no wider numbers here")
def test_wider_numbers_are_refused_where_they_do_not_fit():
    with pytest.raises(ValueError, match=r"it must be finite numbers .* at index 0"):
        validate.array("it", np.array([np.longdouble("1e4000")]), (1,))


@pytest.mark.parametrize(
    "given", [[1, 0, 1], (True, False, True), np.array([1, 0, 1], np.uint8), np.float32([1, 0, 1])]
)
def test_numbers_of_any_kind_are_taken(given):
    expected = np.array([1.0, 0.0, 1.0])
    for made in (
        validate.array("it", given, (3,)),
        validate.numbers("it", given, 1),
        validate.probabilities("p", given),
    ):
        assert made.dtype == np.float64
        np.testing.assert_array_equal(made, expected)
    np.testing.assert_array_equal(validate.binary("it", given, (3,)), expected)


def test_an_unmasked_array_is_as_good_as_any():
    np.testing.assert_array_equal(validate.array("it", np.ma.array([1.0, 2.0]), (2,)), [1.0, 2.0])


def test_the_entry_that_is_wrong_is_named():
    with pytest.raises(ValueError, match=r"^angle must lie in \[-2, 2\] rad, got 7\.0 at 'wrist'$"):
        validate.array("angle", [0.0, 7.0], (2,), "rad", bound=2.0, names=("elbow", "wrist"))
    with pytest.raises(ValueError, match=r"got nan at 'elbow'$"):
        validate.array("angle", [np.nan, 7.0], (2,), "rad", bound=2.0, names=("elbow", "wrist"))
    with pytest.raises(ValueError, match=r"got 2 at index \(1, 0\)$"):
        validate.binary("contacts", [[0, 1], [2, 0]], (2, 2))


@pytest.mark.parametrize("value", [-0.1, 1.1])
def test_what_is_no_probability_is_refused(value):
    with pytest.raises(ValueError, match=rf"it must be probabilities in \[0, 1\], got {value} at index 1"):
        validate.probabilities("it", [0.5, value])


@pytest.mark.parametrize("value", [10**400, -(10**400), Fraction(10**400), 1e300, np.float64(np.inf)], ids=range(5))
def test_numbers_beyond_all_are_refused(value):
    with pytest.raises(ValueError, match="it must be a finite number in"):
        validate.number("it", value, -1e200, 1e200)


LONG = {"an int": 10**5000, "text": "x" * 10**6, "a list": [0] * 10**6, "an array": np.zeros(10**4)}


@pytest.mark.parametrize("name", LONG)
def test_what_is_long_is_not_quoted_in_full(name):
    for check in (validate.number, lambda what, value: validate.integer(what, value, 0, 1), validate.boolean):
        with pytest.raises(ValueError, match="it must be") as error:
            check("it", LONG[name])
        assert len(str(error.value)) < 500


@pytest.mark.parametrize("value", [-1, 1.0, "1", True, np.nan, [1]])
def test_what_is_no_seed_is_refused(value):
    with pytest.raises(ValueError, match="seed must be an integer of at least 0, got"):
        validate.seed(value)


@pytest.mark.parametrize("value", [None, 0, 7, 2**70, np.int64(3)])
def test_seeds(value):
    assert validate.seed(value) == value


@pytest.mark.parametrize("value", [None, 3, b"a.npz", "", "a\0b", "a\nb", "\ud800", "a\udcff", Path("a\0b")])
def test_what_is_no_path_is_refused(value):
    with pytest.raises(ValueError, match=r"^recording must be the path of a file, of printable characters, got .+"):
        validate.path("recording", value)


@pytest.mark.parametrize("value", ["a b.npz", Path("~/ü.npz"), "[x] (1).npz"])
def test_paths(value):
    assert validate.path("recording", value) == Path(value)


@pytest.mark.parametrize("value", [np.timedelta64(3, "s"), True])
def test_what_only_counts_as_a_number_is_refused(value):
    with pytest.raises(ValueError, match=r"^it must be a finite number .* got"):
        validate.number("it", value)
    with pytest.raises(ValueError, match=r"^it must be an integer .* got"):
        validate.integer("it", value, 0)


def test_arrays_without_their_numbers_are_refused_before_any_memory_is_taken():
    declared = np.broadcast_to(0.0, (10**10, 8))
    for check in (validate.numbers, validate.probabilities, validate.binary):
        with pytest.raises(ValueError, match=r"it must have \d+ entries at most, got shape \(10000000000, 8\)"):
            check("it", declared)
    with pytest.raises(ValueError, match=r"a and b must have \d+ entries at most"):
        validate.together(a=np.zeros((10**4, 1)), b=np.zeros((1, 10**5)))


def test_numbers_beyond_a_bound_are_named():
    with pytest.raises(ValueError, match=r"it must lie in \[-2, 2\], got -3.0 at index \(0, 1\)"):
        validate.numbers("it", [[1.0, -3.0]], bound=2.0)
    with pytest.raises(ValueError, match=r"b must lie in \[-2, 2\]"):
        validate.together(2.0, a=[1.0], b=[3.0])


@pytest.mark.parametrize("name", ["a\nb", "\ud800", "", "x" * 1000, "\x1b[31m"])
def test_names_that_cannot_be_told_in_a_line_are_quoted(name):
    told = validate.listed(["WRJ1", name])
    assert told.startswith("WRJ1, '")
    assert told.isprintable()
    assert len(told) < 400
    assert validate.listed(["a b", "ü"]) == "a b, ü"


@pytest.mark.parametrize("value", [-1.0, 0.0, 1.7e308, 1e10, np.nan, None])
def test_times_that_no_trial_takes_are_refused(value):
    with pytest.raises(ValueError, match=r"it must be a finite number in \(0, 1e\+09\] s, got"):
        validate.seconds("it", value)
    assert validate.seconds("it", 0.0, above=None) == 0.0


@pytest.mark.parametrize("value", [3, 2.5, np.float64(1.0)])
def test_one_number_is_for_all(value):
    assert validate.one_or_each("it", value, 3, 0.0, 5.0) == validate.one_or_each("it", value, None, 0.0, 5.0) == value


@pytest.mark.parametrize("given", [[1, 2, 5], (1.0, 2.0, 5.0), np.array([1, 2, 5], dtype=np.int8)])
def test_one_of_each_is_a_copy_of_the_right_length(given):
    found = validate.one_or_each("it", given, 3, 0.0, 5.0)
    np.testing.assert_array_equal(found, [1.0, 2.0, 5.0])
    assert found.dtype == np.float64
    assert not np.shares_memory(found, np.asarray(given))
    with pytest.raises(
        ValueError, match=r"it must be a finite number in \[0, 5\] m, or 4, one for each leg, got shape"
    ):
        validate.one_or_each("it", given, 4, 0.0, 5.0, unit="m", of="leg")
    with pytest.raises(
        ValueError, match=r"it must be a finite number in \[0, 4\], or 3, one for each joint, got 5(.0)? at"
    ):
        validate.one_or_each("it", given, 3, 0.0, 4.0)
    with pytest.raises(ValueError, match=r"it must be a finite number in \[0, 5\], got "):
        validate.one_or_each("it", given, None, 0.0, 5.0)


@pytest.mark.parametrize(("count", "told"), [(0, "0 trials"), (1, "1 trial"), (2, "2 trials")])
def test_one_thing_is_not_many(count, told):
    assert validate.counted(count, "trial") == told
