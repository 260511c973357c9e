"""Averages E[f(X_T)]: an Asian call under Heston's model, its error in the number of steps, and its price by strike.

    python3 payoffs.py [FILE]           draws to FILE (payoffs.svg)
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import wienertree as wt

model = wt.Model("heston")
discount = np.exp(-model.parameters["r"])

# One tree for all strikes: the average of s over time is a state of its own.
strikes = np.linspace(0.8, 1.3, 11)
calls = [f"max(average_s - {k}, 0)" for k in strikes]
prices = discount * wt.weak(model, calls, horizon=1, steps=8, average="s", richardson=True).extrapolated

# A smooth payoff shows the order: E[s^2] = exp(2 r) + further terms of v, taken from many steps.
steps = np.array([1, 2, 4, 8])
fine = wt.weak(model, "s^2", horizon=1, steps=16, degree=7, richardson=True).extrapolated
errors = {m: [abs(wt.weak(model, "s^2", horizon=1, steps=int(n), degree=m).value - fine) for n in steps] for m in (3, 5)}
for m, error in errors.items():
    slope = np.polyfit(np.log(steps), np.log(error), 1)[0]
    print(f"degree {m}: errors {', '.join(f'{e:.1e}' for e in error)}, slope {slope:.2f}")

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), constrained_layout=True)
left.plot(strikes, prices, "o-", ms=3)
left.set_xlabel("strike")
left.set_ylabel("price of the Asian call")
for m, error in errors.items():
    right.loglog(steps, error, "o-", ms=3, label=f"degree {m}")
right.set_xlabel("steps")
right.set_ylabel("error of E[s$^2$]")
right.legend()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "payoffs.svg")
