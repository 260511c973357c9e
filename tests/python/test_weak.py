import csv
import io
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import wienertree as wt

PROGRAM = os.environ["WIENERTREE_PROGRAM"]


def test_a_call_under_gbm_to_its_tolerance():
    """Against Black and Scholes (1973)."""
    gbm = wt.Model("gbm")
    names = gbm.parameters
    r, sigma, s0 = names["r"], names["sigma"], gbm.initial[0]
    d1 = (r + sigma**2 / 2) / sigma
    normal = lambda x: (1 + math.erf(x / math.sqrt(2))) / 2
    expected = s0 * (math.exp(r) * normal(d1) - normal(d1 - sigma))
    result = wt.weak(gbm, f"max(s - {s0}, 0)", horizon=1, tolerance=1e-4)
    assert isinstance(result.value, float)
    assert abs(result.value - expected) < 1e-4
    assert result.error < 1e-4 and set(result.error_parts) == {"discretisation", "thinning", "ode", "sampling"}


@pytest.mark.parametrize(
    "options",
    [{"steps": 4}, {"steps": 8, "richardson": True}, {"steps": 4, "thin": "tbba", "nodes": 300, "launches": 4, "seed": 2},
     {"steps": 4, "average": "s"}, {"steps": 4, "richardson": False, "degree": 3, "grid": "kusuoka"}],
)
def test_the_same_numbers_as_the_command_line(options):
    payoffs = ["s", "max(s - 1, 0)"]
    arguments = []
    for name, value in options.items():
        if value is not False:
            arguments.append(f"--{name}" if value is True else f"--{name}={value}")
    run = subprocess.run([PROGRAM, "weak", "heston", "--horizon=1", "--quiet"] + [f"--payoff={p}" for p in payoffs] + arguments,
                         check=True, capture_output=True, text=True)
    rows = list(csv.DictReader(io.StringIO(run.stdout)))
    result = wt.weak("heston", payoffs, horizon=1, **options)
    for name in ("value", "standard_error", "extrapolated"):
        values = getattr(result, name)
        if values is None:
            assert name not in rows[0]
        else:
            assert values.tolist() == [float(row[name]) for row in rows]
    assert result.nodes == int(float(rows[0]["nodes"])) and result.ode_solves == int(float(rows[0]["ode_solves"]))


def test_mistakes_name_the_option():
    for options, where in [({"steps": 2}, "horizon"), ({"horizon": 1}, "steps"), ({"horizon": -1, "steps": 1}, "horizon"),
                           ({"horizon": 1, "steps": 2, "gamma": 3}, "gamma")]:
        with pytest.raises(wt.InputError) as caught:
            wt.weak("gbm", "s", **options)
        assert caught.value.where == where
    with pytest.raises(wt.InputError, match="payoff"):
        wt.weak("gbm", "s +", horizon=1, steps=1)
    with pytest.raises(wt.InputError, match="payoff"):
        wt.weak("gbm", [], horizon=1, steps=1)


def test_ctrl_c_ends_a_computation():
    script = ("import wienertree as wt\nprint('ready', flush=True)\n"
              "wt.weak('heston', 's', horizon=1, steps=1_000_000, nodes=1000)\n")
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert errors.decode().rstrip().endswith("KeyboardInterrupt")
