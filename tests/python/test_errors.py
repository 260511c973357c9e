import numpy as np
import pytest

import wienertree as wt


def test_the_family():
    assert issubclass(wt.InputError, (wt.Error, ValueError)) and issubclass(wt.InputError, ValueError)
    assert issubclass(wt.RunError, RuntimeError) and issubclass(wt.RunError, wt.Error)
    assert not issubclass(wt.InputError, RuntimeError)


def test_what_where_and_value(record):
    with pytest.raises(ValueError) as caught:
        wt.filter("benes", record, nodes=0)
    error = caught.value
    assert isinstance(error, wt.InputError)
    assert (error.where, error.value) == ("nodes", "0")
    assert str(error) == f"nodes: {error.what} (0)"


def test_options_are_called_as_they_are_given(record):
    with pytest.raises(wt.InputError) as caught:
        wt.filter("benes", record, method="kalman", recombination_degree=3)
    assert caught.value.where == "recombination_degree"
    assert "--" not in str(caught.value)


def test_an_unknown_option_suggests_the_nearest(record):
    with pytest.raises(wt.InputError, match="nodes"):
        wt.filter("benes", record, node=100)
    with pytest.raises(wt.InputError, match="second-order"):
        wt.filter("benes", record, functional="second_order")


def test_a_run_that_fails_names_step_and_time():
    """x' = x^2 from 1 leaves every bound at time 1."""
    explosive = {
        "name": "explosive",
        "convention": "ito",
        "state": {"x": {"initial": 1.0}},
        "drift": {"x": "x^2"},
        "diffusion": {"x": ["1e-3"]},
        "observation": {"kind": "continuous", "h": ["x"]},
    }
    t = np.linspace(0, 2, 21)
    with pytest.raises(RuntimeError) as caught:
        wt.filter(explosive, (t, np.zeros(21)))
    assert isinstance(caught.value, wt.RunError)
    assert "step" in caught.value.where and "t =" in caught.value.where


@pytest.mark.parametrize(
    "t, y, place",
    [
        ([0, 1, 1], [0, 1, 2], "row 3, column t"),
        ([0, 1, np.nan], [0, 1, 2], "row 3, column t"),
        ([0, 1, 2], [0, np.inf, 2], "row 2, column y1"),
        ([0, 1, 2], [0, np.nan, 2], "row 2, column y1"),
        ([0], [0], "observations"),
        ([0, 1, 2], [0, 1], "observations"),
        ([0, 1, 2], np.zeros((3, 2)), "observations"),
    ],
)
def test_bad_observations_name_row_and_column(t, y, place):
    with pytest.raises(wt.InputError) as caught:
        wt.filter("benes", (np.array(t, float), np.array(y, float)))
    assert place in caught.value.where


def test_observations_of_another_kind_are_refused():
    for wrong in (3, [1, 2], np.zeros(3), (1,), "no-such-file.csv"):
        with pytest.raises(wt.InputError):
            wt.filter("benes", wrong)
