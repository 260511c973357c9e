import numpy as np
import pytest

import wienertree as wt


@pytest.mark.parametrize("name", wt.formulas())
def test_bundled_formulas_hold(name):
    formula = wt.Formula.load(name)
    verification = formula.verify()
    assert verification and verification.degree >= formula.degree
    assert verification.max_error < 1e-12
    assert abs(formula.weights.sum() - 1) < 1e-12 and len(formula) == formula.weights.size == len(formula.paths)
    # Brownian motion's time: dw^0 sums to 1 along every path on average, and squares of increments to the same.
    time = sum(w * p[:, 0].sum() for w, p in zip(formula.weights, formula.paths))
    variance = sum(w * p[:, 1].sum() ** 2 for w, p in zip(formula.weights, formula.paths))
    assert abs(time - 1) < 1e-12 and abs(variance - 1) < 1e-12


def test_paths_are_the_formulas_own_memory():
    formula = wt.construct(5, 2)
    path = formula.paths[0]
    assert path.shape[1] == 3 and not path.flags.writeable and not path.flags.owndata
    assert np.shares_memory(path, formula.paths[0])
    del formula
    assert np.isfinite(path).all()


def test_a_formula_is_saved_and_loaded(tmp_path):
    formula = wt.construct(5, 3)
    formula.save(str(tmp_path / "mine.json"))
    again = wt.Formula.load(str(tmp_path / "mine.json"))
    assert all(np.array_equal(p, q) for p, q in zip(formula.paths, again.paths))


def test_a_wrong_moment_is_found():
    one = wt.construct(5, 1)
    wrong = wt.Formula(one.weights, [1.01 * p for p in one.paths], degree=5, dimension=1)
    verification = wrong.verify()
    assert not verification and verification.first_failure[0] == [0]
    assert str(verification.first_failure[2]) in verification.brief or "expected" in verification.brief or verification.brief


def test_mistakes():
    with pytest.raises(wt.InputError):
        wt.construct(9, 7)
    with pytest.raises(wt.InputError, match="lyons-victoir"):
        wt.Formula.load("lyons-victor-5-1")
    with pytest.raises(wt.InputError, match="weight"):
        wt.Formula([1.0], [], degree=1, dimension=1)
    with pytest.raises(wt.InputError):
        wt.Formula([-1.0], [np.array([[1.0, 0.0]])], degree=1, dimension=1)
    assert wt.find_formula(7, 1).degree == 7
