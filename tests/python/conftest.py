import numpy as np
import pytest

import wienertree as wt


@pytest.fixture(scope="session")
def record():
    """A signal of Benes' model and its observations: 400 rows on [0, 4]."""
    return wt.simulate("benes", horizon=4, steps=4000, keep=400, seed=3)


@pytest.fixture(scope="session")
def dax():
    return wt.read_observations(wt.data_directory() / "observations" / "dax.csv", "stochastic-volatility")


@pytest.fixture
def cloud():
    """2000 sites in the plane with their log-weights."""
    random = np.random.default_rng(1)
    return random.normal(size=(2, 2000)), random.normal(size=2000)
