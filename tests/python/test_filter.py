import csv
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import tracemalloc

import numpy as np
import pytest

import wienertree as wt

PROGRAM = os.environ["WIENERTREE_PROGRAM"]


def table(file):
    with open(file) as lines:
        rows = list(csv.reader(lines))
    return {name: np.array([float(r[i] or "nan") for r in rows[1:]]) for i, name in enumerate(rows[0])}


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"method": "euler", "nodes": 200, "seed": 4, "launches": 3},
        {"degree": 3, "thin": "tbba", "nodes": 50, "seed": 9, "moments": 3, "steps": 100},
        {"method": "benes"},
    ],
)
def test_the_same_numbers_as_the_command_line(tmp_path, record, options):
    """Bit for bit: both are the shortest texts of the same doubles."""
    observations = tmp_path / "Y.csv"
    with open(observations, "w") as out:
        out.write("t,y1\n")
        out.writelines(f"{t!r},{y!r}\n" for t, y in zip(record.t.tolist(), record.observations[:, 0].tolist()))
    arguments = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    output = tmp_path / "posterior.csv"
    subprocess.run([PROGRAM, "filter", "benes", f"--observations={observations}", "--quiet", f"--output={output}"]
                   + arguments, check=True)
    result = wt.filter("benes", record, **options)
    expected = table(output)
    assert list(result) == list(expected)
    for name, values in expected.items():
        assert np.array_equal(result[name], values, equal_nan=True), name
    from_file = wt.filter("benes", observations, **options)
    assert np.array_equal(from_file.mean, result.mean)


def test_the_weighted_filter_has_its_likelihood_ratio():
    nile = wt.filter("nile", wt.data_directory() / "observations" / "nile.csv", method="weighted", nodes=1000)
    assert nile.log_bayes_factor.shape == nile.log_variance.shape == nile.t.shape
    assert "log_bayes_factor" in nile


def test_what_is_masked_is_missing():
    """The evidence of a mask is that of NaN, and not that of the numbers below the mask."""
    model = {"name": "m", "convention": "ito", "state": {"x": {"initial": 0.0}}, "drift": {"x": "-x"}, "diffusion": {"x": ["1"]},
             "observation": {"kind": "discrete", "h": ["x"], "noise": {"law": "gaussian", "sd": 1.0}}}
    t, y = np.arange(6.0), np.array([0.1, 0.2, 1e9, 0.0, 1e9, 0.3])
    masked = np.ma.masked_greater(y, 1e6)
    missing = np.where(y > 1e6, np.nan, y)
    expected = wt.filter(model, (t, missing), method="kalman").log_evidence
    assert np.array_equal(wt.filter(model, (t, masked), method="kalman").log_evidence, expected)
    whole = np.ma.masked_greater(np.array([0, 0, 9, 0, 9, 0]), 1)
    assert np.isfinite(wt.filter(model, (t, whole), method="kalman").log_evidence).all()
    with pytest.raises(wt.InputError, match="not a finite number"):
        wt.filter(model, (np.ma.masked_equal(t, 3.0), y), method="kalman")


@pytest.mark.parametrize("times", [np.arange("2020-01-01", "2020-01-07", dtype="datetime64[D]"), np.arange(6).astype("timedelta64[s]"), np.arange(6) * 1j, np.array(list("abcdef"))])
def test_what_has_no_unit_or_is_no_number_is_refused(times):
    with pytest.raises(wt.InputError, match="unit|real numbers"):
        wt.filter("nile", (times, np.zeros(6)))
    with pytest.raises(wt.InputError, match="unit|real numbers"):
        wt.thin(times, np.zeros(6), 3)


def test_shapes_and_options():
    record = wt.simulate("linear-3d", horizon=1, steps=100, seed=1)
    result = wt.filter("linear-3d", record, steps=10, nodes=200, moments=3)
    d = len(result.states)
    for values in (result.mean, result.sd, result.q05, result.q50, result.q95, result.moments[3]):
        assert values.shape == (11, d)
    assert result.t.shape == result.log_evidence.shape == result.nodes.shape == result.ess.shape == (11,)
    assert result.options["nodes"] == 200 and result.options["method"] == "klv"
    assert result.statistics["steps"] == 10
    assert result.mc_sd is None and result.log_bayes_factor is None
    assert dict(result)["mean_" + result.states[-1]].shape == (11,)
    # E[x^2] = sd^2 + mean^2, up to the rounding of sums over 200 nodes.
    assert np.allclose(result.moments[2], result.sd**2 + result.mean**2, rtol=1e-10)


def test_arrays_own_the_memory_of_the_library(record):
    result = wt.filter("benes", record)
    assert type(result.mean.base).__name__ == "PyCapsule"
    column = result["mean_x"]
    assert np.shares_memory(column, result.mean)
    del result
    assert np.isfinite(column).all()


def test_arrays_of_doubles_are_read_where_they_lie():
    """NumPy would report a conversion to tracemalloc; what the filter itself allocates, it does not see."""
    rows = 200_001
    t = np.linspace(0, 1, rows)
    y = np.zeros((rows, 1))

    def python_memory(times, values):
        tracemalloc.start()
        wt.filter("benes", (times, values), steps=10)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return peak

    assert python_memory(t, y) < t.nbytes / 4
    assert python_memory(t, y.astype(np.float32)) > y.nbytes  # a conversion is seen


def test_one_posterior_a_step(record):
    result = wt.filter("benes", record, steps=50)
    steps = list(wt.Filter("benes", record, steps=50))
    assert [p.t for p in steps] == result.t.tolist()
    assert np.array_equal([p.mean for p in steps], result.mean)
    assert np.array_equal([p.q95 for p in steps], result.q95)
    assert [p.log_evidence for p in steps] == result.log_evidence.tolist()


def test_the_law_at_a_step(record):
    run = wt.Filter("benes", record, method="klv", steps=50)
    for _ in range(20):
        posterior = next(run)
    x, w = posterior.points, posterior.weights
    assert x.shape == (1, w.size) and abs(w.sum() - 1) < 1e-12
    # Sums of about 200 terms: rounding of 1e-13.
    assert abs((x[0] * w).sum() - posterior.mean[0]) < 1e-12
    assert abs(posterior.expectation("x^2") - (x[0] ** 2 * w).sum()) < 1e-12
    assert abs(posterior.expectation(lambda x: x[0] ** 2) - posterior.expectation("x^2")) < 1e-12
    assert np.allclose(posterior.quantiles("x", [0.05, 0.5, 0.95]),
                       [posterior.q05[0], posterior.q50[0], posterior.q95[0]])
    grid = np.linspace(posterior.mean[0] - 10 * posterior.sd[0], posterior.mean[0] + 10 * posterior.sd[0], 4001)
    density = posterior.density("x", grid)
    # A sum of smooth Gaussians: the trapezoidal rule errs by far less.
    assert abs(np.trapz(density, grid) - 1) < 1e-6
    assert np.allclose(np.gradient(posterior.distribution(0, grid), grid)[1:-1], density[1:-1], atol=1e-3 * density.max())
    next(run)
    assert posterior.mean.shape == (1,)
    with pytest.raises(wt.RunError, match="next step"):
        posterior.points
    with pytest.raises(wt.RunError, match="next step"):
        posterior.expectation("x")


def test_a_density_where_an_observation_leaves_whole_families_one_child(dax):
    """The 35th return: the leftmost families have weights below 1e-240."""
    posterior = next(p for p in wt.Filter("stochastic-volatility", dax) if p.t == 35)
    x = np.linspace(posterior.q05[0] - 5, posterior.q95[0] + 5, 2001)
    assert abs(np.trapz(posterior.density("x", x), x) - 1) < 1e-6


def test_functions_that_fail_under_an_expectation(record):
    posterior = next(wt.Filter("benes", record))
    with pytest.raises(ZeroDivisionError):
        posterior.expectation(lambda x: 1 // 0)
    with pytest.raises(wt.InputError, match="one value for each node"):
        posterior.expectation(lambda x: np.zeros(x.shape[1] + 1))


def test_missing_values(dax):
    nile = wt.data_directory() / "observations" / "nile.csv"
    t, y = wt.read_observations(nile, "nile")
    y = y.copy()
    y[10] = np.nan
    exact = wt.filter("nile", (t, y), method="kalman")
    tree = wt.filter("nile", (t, y))
    assert np.abs(tree.mean - exact.mean).max() < 0.05 * exact.sd.min()


def test_dax_evidence(dax):
    """Against quadrature on a grid, -2511.197502 (docs/volatility.md)."""
    result = wt.filter("stochastic-volatility", dax)
    assert abs(result.log_evidence[-1] + 2511.197502) < 0.01


def test_a_formula_of_ones_own(record):
    bundled = wt.Formula.load("lyons-victoir-5-1")
    mine = wt.Formula(bundled.weights, bundled.paths, degree=5, dimension=1, name="mine")
    by_name = wt.filter("benes", record, formula="lyons-victoir-5-1")
    by_value = wt.filter("benes", record, formula=mine)
    assert np.array_equal(by_name.mean, by_value.mean)
    assert by_value.options["formula"] == "mine"
    with pytest.raises(wt.InputError, match="Brownian"):
        wt.filter("benes", record, formula=wt.construct(5, 2))
    with pytest.raises(wt.InputError, match="method"):
        wt.filter("benes", record, formula=mine, method="euler")
    wrong = wt.Formula(bundled.weights[::-1] * [1, 1, 1.001], bundled.paths, degree=5, dimension=1)
    with pytest.raises(wt.InputError):
        wt.filter("benes", record, formula=wrong)


LONG = """
    import numpy as np, wienertree as wt
    t = np.linspace(0, 1000, 1_000_001)
    run = lambda: wt.filter("benes", (t, np.zeros(t.size)), steps=1_000_000, method="euler", nodes=1000)
"""


def test_other_threads_run_meanwhile(record):
    t = np.linspace(0, 100, 100_001)
    counted = []

    def count():
        while not done:
            counted.append(1)
            time.sleep(0.001)

    done = False
    other = threading.Thread(target=count)
    other.start()
    before = len(counted)
    wt.filter("benes", (t, np.zeros(t.size)), steps=2000, method="euler", nodes=10000)
    during = len(counted) - before
    done = True
    other.join()
    # It takes at least a tenth of a second, and the other thread asks for its turn every millisecond.
    assert during > 20


def test_a_filter_belongs_to_one_thread_at_a_time():
    t = np.linspace(0, 1, 11)
    run = wt.Filter("benes", (t, np.zeros(11)), method="euler", nodes=3_000_000)
    next(run)
    refused = []

    def meddle():
        time.sleep(0.02)
        try:
            next(run)
        except wt.RunError as error:
            refused.append(error)

    other = threading.Thread(target=meddle)
    other.start()
    next(run)
    other.join()
    assert refused and "another thread" in str(refused[0])


def test_ctrl_c_ends_a_computation():
    script = textwrap.dedent(LONG) + "print('ready', flush=True)\nrun()\n"
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        time.sleep(0.5)
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode != 0
    assert errors.decode().rstrip().endswith("KeyboardInterrupt")
    assert time.monotonic() - sent < 5
