from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .results import Array, FilterResult, Selection, Simulation, Verification, WeakResult

_ModelLike = Union["Model", str, PathLike[str], Mapping[str, Any]]
_Observations = Union[str, PathLike[str], tuple[ArrayLike, ArrayLike], Simulation]
_Set = Optional[Mapping[str, float]]
_Method = Literal["klv", "full-tree", "euler", "gaussian-mixture", "weighted", "benes", "kalman-bucy", "kalman", "grid"]
_Thin = Literal["none", "tbba", "multinomial", "residual", "stratified", "systematic", "recombination", "levelwise", "heavy-first"]
_Order = Literal["tree", "spatial"]
_Flow = Literal["auto", "exact", "explicit", "cvode"]

__version__: str

def data_directory() -> str: ...
def models() -> list[str]: ...
def formulas() -> list[str]: ...
def thinning_methods() -> list[str]: ...

class Model:
    def __init__(self, source: _ModelLike, *, set: _Set = None) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def states(self) -> list[str]: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def noise_dimension(self) -> int: ...
    @property
    def observation(self) -> Literal["none", "continuous", "discrete"]: ...
    @property
    def observation_dimension(self) -> int: ...
    @property
    def initial(self) -> Array: ...
    def analysis(self) -> dict[str, Any]: ...
    def replace(self, **parameters: float) -> Model: ...
    def with_inputs(self, times: ArrayLike, **inputs: ArrayLike) -> Model: ...
    @property
    def inputs(self) -> tuple[Optional[Array], dict[str, Array]]: ...

def simulate(model: _ModelLike, *, horizon: float, steps: int, keep: Optional[int] = None, seed: int = 1, set: _Set = None) -> Simulation: ...
def read_observations(file: Union[str, PathLike[str]], model: _ModelLike, *, set: _Set = None) -> tuple[Array, Array]: ...

class Formula:
    def __init__(self, weights: Sequence[float] | Array, paths: Sequence[ArrayLike], *, degree: int, dimension: int, name: str = "unnamed", source: str = "") -> None: ...
    @staticmethod
    def load(name: str) -> Formula: ...
    @property
    def name(self) -> str: ...
    @property
    def degree(self) -> int: ...
    @property
    def dimension(self) -> int: ...
    @property
    def source(self) -> str: ...
    @property
    def weights(self) -> Array: ...
    @property
    def paths(self) -> list[Array]: ...
    def verify(self, tolerance: float = 1e-12) -> Verification: ...
    def save(self, file: str) -> None: ...
    def __len__(self) -> int: ...

def construct(degree: int, dimension: int) -> Formula: ...
def find_formula(degree: int, dimension: int) -> Formula: ...

class Posterior:
    @property
    def t(self) -> float: ...
    @property
    def mean(self) -> Array: ...
    @property
    def sd(self) -> Array: ...
    @property
    def q05(self) -> Array: ...
    @property
    def q50(self) -> Array: ...
    @property
    def q95(self) -> Array: ...
    @property
    def log_evidence(self) -> float: ...
    @property
    def nodes(self) -> float: ...
    @property
    def ess(self) -> float: ...
    @property
    def points(self) -> Array: ...
    @property
    def weights(self) -> Array: ...
    def expectation(self, f: Union[str, Callable[[Array], ArrayLike]]) -> float: ...
    def density(self, state: Union[str, int], x: ArrayLike) -> Array: ...
    def distribution(self, state: Union[str, int], x: ArrayLike) -> Array: ...
    def quantiles(self, state: Union[str, int], levels: ArrayLike) -> Array: ...

def filter(
    model: _ModelLike,
    observations: _Observations,
    *,
    steps: Optional[int] = None,
    method: Optional[_Method] = None,
    degree: Optional[int] = None,
    formula: Optional[Union[str, PathLike[str], Formula]] = None,
    nodes: Optional[int] = None,
    thin: Optional[_Thin] = None,
    order: Optional[_Order] = None,
    recombination_degree: Optional[int] = None,
    prune_weights: Optional[Literal["likelihood", "cubature"]] = None,
    conditioning: Optional[Literal["children", "families", "components"]] = None,
    functional: Optional[Literal["picard", "trapezoid", "second-order"]] = None,
    flow: Optional[_Flow] = None,
    rtol: Optional[float] = None,
    atol: Optional[float] = None,
    on_node_failure: Optional[Literal["stop", "drop"]] = None,
    seed: Optional[int] = None,
    threads: Optional[int] = None,
    ess_threshold: Optional[float] = None,
    alpha: Optional[float] = None,
    beta: Optional[float] = None,
    launches: Optional[int] = None,
    moments: Optional[int] = None,
    tolerance: Optional[float] = None,
    work: Optional[float] = None,
    set: _Set = None,
) -> FilterResult: ...

class Filter:
    def __init__(
        self,
        model: _ModelLike,
        observations: _Observations,
        *,
        steps: Optional[int] = None,
        method: Optional[_Method] = None,
        degree: Optional[int] = None,
        formula: Optional[Union[str, PathLike[str], Formula]] = None,
        nodes: Optional[int] = None,
        thin: Optional[_Thin] = None,
        order: Optional[_Order] = None,
        recombination_degree: Optional[int] = None,
        prune_weights: Optional[Literal["likelihood", "cubature"]] = None,
        conditioning: Optional[Literal["children", "families", "components"]] = None,
        functional: Optional[Literal["picard", "trapezoid", "second-order"]] = None,
        flow: Optional[_Flow] = None,
        rtol: Optional[float] = None,
        atol: Optional[float] = None,
        on_node_failure: Optional[Literal["stop", "drop"]] = None,
        seed: Optional[int] = None,
        threads: Optional[int] = None,
        ess_threshold: Optional[float] = None,
        alpha: Optional[float] = None,
        beta: Optional[float] = None,
        launches: Optional[int] = None,
        moments: Optional[int] = None,
        tolerance: Optional[float] = None,
        work: Optional[float] = None,
        set: _Set = None,
    ) -> None: ...
    def __iter__(self) -> Filter: ...
    def __next__(self) -> Posterior: ...
    @property
    def states(self) -> list[str]: ...
    @property
    def options(self) -> dict[str, Any]: ...
    @property
    def statistics(self) -> dict[str, float]: ...

def weak(
    model: _ModelLike,
    payoff: Union[str, Sequence[str]],
    *,
    horizon: Union[float, Sequence[float]],
    steps: Optional[int] = None,
    degree: Optional[int] = None,
    formula: Optional[Union[str, PathLike[str]]] = None,
    grid: Optional[Literal["uniform", "kusuoka"]] = None,
    gamma: Optional[float] = None,
    thin: Optional[_Thin] = None,
    nodes: Optional[int] = None,
    patch_width: Optional[float] = None,
    order: Optional[_Order] = None,
    recombination_degree: Optional[int] = None,
    flow: Optional[_Flow] = None,
    rtol: Optional[float] = None,
    atol: Optional[float] = None,
    average: Optional[Union[str, Sequence[str]]] = None,
    integral: Optional[Union[str, Sequence[str]]] = None,
    kinks: Optional[Literal["auto", "last-step", "kernel", "sharp"]] = None,
    kink_width: Optional[float] = None,
    square_roots: Optional[Literal["auto", "off"]] = None,
    discount: Optional[str] = None,
    tolerance: Optional[float] = None,
    richardson: Optional[bool] = None,
    launches: Optional[int] = None,
    seed: Optional[int] = None,
    threads: Optional[int] = None,
    set: _Set = None,
) -> WeakResult: ...
def thin(
    states: ArrayLike,
    log_weight: ArrayLike,
    nodes: int,
    *,
    method: _Thin = "recombination",
    order: _Order = "spatial",
    recombination_degree: int = 0,
    parents: int = 0,
    seed: int = 1,
    step: int = 0,
    threads: int = 1,
) -> Selection: ...
