"""Thinning a weighted measure: what every strategy keeps of 2000 sites in the plane, and how far the averages move.

    python3 thinning.py [FILE]          draws to FILE (thinning.svg)
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import wienertree as wt

random = np.random.default_rng(1)
angle = random.uniform(0, 2 * np.pi, 2000)
x = (1 + 0.2 * random.normal(size=2000)) * np.array([np.cos(angle), np.sin(angle)])  # (d, M): a ring
log_weight = 1.5 * x[0] + 0.3 * random.normal(size=2000)
w = np.exp(log_weight) / np.exp(log_weight).sum()


def f(z):
    return np.sin(2 * z[0]) * np.exp(z[1])


def error(method, nodes, launches):
    """Root mean square over the launches of the change of the average of f."""
    change = []
    for step in range(launches):
        kept = wt.thin(x, log_weight, nodes, method=method, step=step)
        v = np.exp(kept.log_weight)
        change.append((v * f(x[:, kept.site])).sum() / v.sum() - (w * f(x)).sum())
    return np.sqrt(np.mean(np.square(change)))


methods = {"multinomial": 50, "systematic": 50, "tbba": 50, "recombination": 1}
sizes = [20, 50, 100, 200, 500, 1000]
figure, panels = plt.subplots(1, 4, figsize=(13, 3.4), constrained_layout=True)
for panel, method in zip(panels, ("multinomial", "tbba", "recombination")):
    kept = wt.thin(x, log_weight, 100, method=method)
    panel.plot(x[0], x[1], ",", color="0.8")
    panel.scatter(x[0, kept.site], x[1, kept.site], s=1500 * np.exp(kept.log_weight) / np.exp(log_weight).sum(), alpha=0.7)
    panel.set_title(f"{method}, {kept.site.size} nodes", fontsize=9)
    panel.set_aspect("equal")
for method, launches in methods.items():
    errors = [error(method, nodes, launches) for nodes in sizes]
    print(f"{method:14}", *(f"{e:9.2e}" for e in errors))
    panels[3].loglog(sizes, errors, "o-", ms=3, label=method)
panels[3].set_xlabel("nodes")
panels[3].set_title("error of an average", fontsize=9)
panels[3].legend(fontsize=7)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "thinning.svg")
