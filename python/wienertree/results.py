"""What computations return: values with NumPy arrays that own the library's memory."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Simulation:
    """A signal and its observations at M times."""

    t: Array  # (M,)
    observations: Array  # (M, k), NaN where nothing is observed; no rows without an observation
    signal: Array  # (M, d)
    states: list[str]  # d names


class FilterResult(Mapping[str, Array]):
    """The posterior through time: M times, d states.

    A mapping as well: result["mean_x"], result["q05_x"], result["log_evidence"] are the columns that the
    command line writes, under the same names, so that pandas.DataFrame(result) is its table.
    """

    def __init__(self, **parts: Any):
        self.states: list[str] = parts["states"]
        self.t: Array = parts["t"]  # (M,)
        self.mean: Array = parts["mean"]  # (M, d)
        self.sd: Array = parts["sd"]  # (M, d)
        self.q05: Array = parts["q05"]  # (M, d): quantiles
        self.q50: Array = parts["q50"]
        self.q95: Array = parts["q95"]
        self.moments: dict[int, Array] = parts["moments"]  # order k -> E[X^k], (M, d)
        self.log_evidence: Array = parts["log_evidence"]  # (M,): of the observations so far
        self.nodes: Array = parts["nodes"]  # (M,)
        self.ess: Array = parts["ess"]  # (M,): effective sample size
        # Standard deviations over several launches, else None.
        self.mc_sd: Optional[Array] = parts["mc_sd"]  # (M, d): of the mean
        self.mc_sd_log_evidence: Optional[Array] = parts["mc_sd_log_evidence"]  # (M,)
        # The weighted filter: likelihood ratio against noise alone, else None.
        self.log_bayes_factor: Optional[Array] = parts["log_bayes_factor"]  # (M,)
        self.log_variance: Optional[Array] = parts["log_variance"]  # (M,)
        # Largest estimated errors, "mean", "sd", "quantile" in posterior standard deviations and "log_evidence"; None
        # where nothing is known of them.
        self.error: Optional[dict[str, float]] = parts["error"]
        self.warnings: list[str] = parts["warnings"]  # what makes the answer doubtful, a sentence each
        self.options: dict[str, Any] = parts["options"]  # in force
        self.statistics: dict[str, float] = parts["statistics"]  # work done
        self.seconds: float = parts["seconds"]  # of computing
        self._columns = self._by_name()

    def _by_name(self) -> dict[str, Array]:
        columns = {"t": self.t}

        def add(prefix: str, values: Optional[Array]) -> None:
            if values is not None:
                columns.update({f"{prefix}_{state}": values[:, i] for i, state in enumerate(self.states)})

        for prefix in ("mean", "sd", "q05", "q50", "q95"):
            add(prefix, getattr(self, prefix))
        columns |= {"log_evidence": self.log_evidence, "nodes": self.nodes, "ess": self.ess}
        for order, values in self.moments.items():
            add(f"m{order}", values)
        if self.log_bayes_factor is not None and self.log_variance is not None:
            columns |= {"log_bayes_factor": self.log_bayes_factor, "log_variance": self.log_variance}
        add("mc_sd", self.mc_sd)
        if self.mc_sd_log_evidence is not None:
            columns["mc_sd_log_evidence"] = self.mc_sd_log_evidence
        return columns

    def __getitem__(self, name: str) -> Array:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return (
            f"<wienertree.FilterResult: {len(self.t)} times, t = {self.t[0]:g} .. {self.t[-1]:g}, "
            f"states {', '.join(self.states)}, log evidence {self.log_evidence[-1]:.6f}>"
        )


@dataclass(frozen=True)
class WeakResult:
    """Averages of payoffs: numbers for one payoff at one horizon, else arrays: payoff by payoff, horizon by
    horizon."""

    value: Any
    standard_error: Any  # 0 where nothing is random
    extrapolated: Any  # with richardson, else None
    extrapolated_standard_error: Any
    error: Any  # with tolerance: the estimate, else None
    error_parts: Optional[dict[str, Any]]  # of it: discretisation, thinning, ode, sampling
    nodes: int  # at the end
    ode_solves: int
    options: dict[str, Any]  # in force
    seconds: float


@dataclass(frozen=True)
class Verification:
    """What the moments of a formula are."""

    holds: bool
    stated_degree: int
    degree: int  # the highest up to which every moment holds
    max_error: float
    next_residual: Optional[float]  # norm of the moments missed at the next degree
    first_failure: Optional[tuple[list[int], float, float]]  # word, value, expected
    brief: str

    def __bool__(self) -> bool:
        return self.holds


@dataclass(frozen=True)
class Selection:
    """What a thinning keeps of M sites."""

    site: NDArray[np.uint32]  # (N,)
    log_weight: Array  # (N,)
    count: Optional[NDArray[np.uint32]]  # (N,): particles, for the methods that count, else None
    states: Optional[Array]  # (d, N): where the method moved the nodes, else None: states[:, site]
    discarded: float  # estimate of the error of a deterministic method
