"""Observations: 1859 returns of the DAX, the volatility behind them, and which of two parameters they speak for.

    python3 volatility.py [FILE]        draws to FILE (volatility.svg)
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import wienertree as wt

model = wt.Model("stochastic-volatility")
t, y = wt.read_observations(wt.data_directory() / "observations" / "dax.csv", model)

result = wt.filter(model, (t, y))
rival = wt.filter(model.replace(phi=0.95, s=0.3, beta=0.7), (t, y))
print(f"log evidence {result.log_evidence[-1]:.3f}, of the rival {rival.log_evidence[-1]:.3f}")

# The law itself at the step of the largest return, from the filter as an iterator.
largest = t[np.argmax(np.abs(y))]
posterior = next(p for p in wt.Filter(model, (t, y)) if p.t == largest)
x = np.linspace(posterior.q05[0] - 1, posterior.q95[0] + 1, 300)
density = posterior.density("x", x)

beta = model.parameters["beta"]
figure, (above, below, law) = plt.subplots(3, 1, figsize=(8, 8), constrained_layout=True)
above.plot(t, np.abs(y), ".", ms=2, color="0.7", label="|return|, per cent")
above.fill_between(result.t, beta * np.exp(result["q05_x"] / 2), beta * np.exp(result["q95_x"] / 2), alpha=0.3,
                   label="standard deviation, 5-95 %")
above.plot(result.t, beta * np.exp(result["q50_x"] / 2), lw=1, label="its median")
above.set_ylim(0, 6)
above.legend(loc="upper left")
below.plot(result.t, result.log_evidence - rival.log_evidence, lw=1)
below.axhline(0, color="0.7", lw=0.8)
below.set_ylabel("log Bayes factor")
below.set_xlabel("trading day")
law.plot(beta * np.exp(x / 2), density / (beta * np.exp(x / 2) / 2))
law.set_xlabel(f"standard deviation on day {largest:.0f}, given the returns until then")
law.set_ylabel("density")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "volatility.svg")
