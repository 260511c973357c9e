import tracemalloc

import numpy as np
import pytest

import wienertree as wt

METHODS = [m for m in wt.thinning_methods() if m != "none"]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_keeps_mass_and_budget(method, cloud):
    x, log_weight = cloud
    kept = wt.thin(x, log_weight, 100, method=method)
    mass = np.exp(log_weight).sum()
    assert abs(np.exp(kept.log_weight).sum() / mass - 1) < 1e-12
    assert kept.site.size == kept.log_weight.size <= 100 and kept.site.dtype == np.uint32
    assert np.unique(kept.site).size == kept.site.size and kept.site.max() < 2000
    if kept.count is not None:
        assert kept.count.sum() == 100


def test_tbba_is_within_one_particle_of_its_share(cloud):
    """Crisan, Lyons (2002): the count of a site is the integer part of N w_n / sum w, or one more."""
    x, log_weight = cloud
    share = 100 * np.exp(log_weight) / np.exp(log_weight).sum()
    kept = wt.thin(x, log_weight, 100, method="tbba", order="tree")
    count = np.zeros(2000)
    count[kept.site] = kept.count
    assert np.all(np.abs(count - share) < 1 + 1e-9)


@pytest.mark.parametrize("method, moments", [("multinomial", 0), ("systematic", 0), ("tbba", 0)])
def test_random_methods_are_unbiased(method, moments, cloud):
    """H0: E[sum of w f] is the sum before, f the first state. 2000 draws; |z| < 5 has a false-alarm rate of 6e-7 a test."""
    x, log_weight = cloud
    w = np.exp(log_weight)
    sums = []
    for step in range(2000):
        kept = wt.thin(x, log_weight, 20, method=method, seed=7, step=step)
        sums.append((np.exp(kept.log_weight) * x[0, kept.site]).sum())
    z = (np.mean(sums) - (w * x[0]).sum()) / (np.std(sums) / np.sqrt(len(sums)))
    assert abs(z) < 5


def test_recombination_keeps_moments(cloud):
    x, log_weight = cloud
    kept = wt.thin(x, log_weight, 60, recombination_degree=2)
    w, v = np.exp(log_weight), np.exp(kept.log_weight)
    y = x[:, kept.site]
    for f in (lambda z: z[0], lambda z: z[1], lambda z: z[0] ** 2, lambda z: z[0] * z[1], lambda z: z[1] ** 2):
        # Kept to 1e-12 of the mass of each patch, times states of at most 5.
        assert abs((w * f(x)).sum() - (v * f(y)).sum()) < 1e-10 * w.sum()


def test_one_dimension_moves_its_nodes():
    x = np.linspace(-1, 1, 1001)
    kept = wt.thin(x, np.zeros(1001), 20)
    assert kept.states.shape == (1, kept.site.size)
    assert abs((np.exp(kept.log_weight) * kept.states[0] ** 2).sum() - (x**2).sum()) < 1e-9


def test_the_same_draws_for_the_same_seed_and_any_number_of_threads():
    random = np.random.default_rng(2)
    x, log_weight = random.normal(size=(1, 100_000)), random.normal(size=100_000)
    one, two = (wt.thin(x, log_weight, 1000, method="tbba", seed=3, threads=k) for k in (1, 2))
    other = wt.thin(x, log_weight, 1000, method="tbba", seed=4)
    assert np.array_equal(one.site, two.site) and np.array_equal(one.log_weight, two.log_weight)
    assert not np.array_equal(one.site, other.site)


def test_arrays_are_neither_copied_in_nor_out():
    x, log_weight = np.zeros((2, 500_000)), np.zeros(500_000)
    x[:] = np.random.default_rng(3).normal(size=x.shape)
    tracemalloc.start()
    kept = wt.thin(x, log_weight, 10, method="systematic")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < log_weight.nbytes / 4
    assert type(kept.site.base).__name__ == "PyCapsule"


def test_mistakes(cloud):
    x, log_weight = cloud
    with pytest.raises(wt.InputError, match="log_weight"):
        wt.thin(x, log_weight[:-1], 10)
    with pytest.raises(wt.InputError, match="nodes"):
        wt.thin(x, log_weight, 0)
    with pytest.raises(wt.InputError, match="tbba"):
        wt.thin(x, log_weight, 10, method="tbb")
    with pytest.raises(wt.InputError, match="parents"):
        wt.thin(x, log_weight, 10, method="tbba", parents=7)
    with pytest.raises(wt.RunError):
        wt.thin(x, np.full(2000, -np.inf), 10)
    with pytest.raises(wt.RunError):
        wt.thin(x, np.full(2000, np.nan), 10)
