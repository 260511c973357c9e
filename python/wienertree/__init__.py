"""Cubature on Wiener space: nonlinear filtering by the Kusuoka-Lyons-Victoir tree, and weak approximation.

    import wienertree as wt
    result = wt.filter("benes", "Y.csv")             # the posterior through time
    for posterior in wt.Filter("benes", "Y.csv"):    # one posterior a step
        print(posterior.t, posterior.mean, posterior.sd)
    wt.weak("gbm", "max(s - 1, 0)", horizon=1, tolerance=1e-6).value

Options have the names of the command line, with underscores: help(wt.filter) lists them. Arrays that are handed
in are read where they lie, and those that come out own the library's memory. The interpreter's lock is released
while computing, and Ctrl-C ends a computation at its next step.
"""

import pathlib as _pathlib

from . import _core
from ._core import (
    Filter,
    Formula,
    Model,
    Posterior,
    __version__,
    construct,
    filter,
    find_formula,
    formulas,
    models,
    read_observations,
    simulate,
    thin,
    thinning_methods,
    weak,
)
from .errors import Error, InputError, RunError
from .results import FilterResult, Selection, Simulation, Verification, WeakResult

for _public in (Filter, Formula, Model, Posterior, construct, filter, find_formula, formulas, models,
                read_observations, simulate, thin, thinning_methods, weak):
    _public.__module__ = "wienertree"


def data_directory() -> _pathlib.Path:
    """Where the bundled models, formulas and observations lie."""
    return _pathlib.Path(_core.data_directory())


__all__ = [
    "Error", "Filter", "FilterResult", "Formula", "InputError", "Model", "Posterior", "RunError", "Selection",
    "Simulation", "Verification", "WeakResult", "construct", "data_directory", "filter", "find_formula",
    "formulas", "models", "read_observations", "simulate", "thin", "thinning_methods", "weak",
]
