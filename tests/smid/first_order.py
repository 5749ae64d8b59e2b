"""First-order problems with an oracle that shares nothing with the package: linear programs at every fixed pole."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog, minimize_scalar

from smid import Dataset, Hammerstein, Model, OutputError

TIGHT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


@dataclass(frozen=True)
class FirstOrder:
    """``y = w + eta`` with ``w[t] = -pole w[t-1] + gain(pole) drive[t-1] @ linear``, in one or several records.

    ``gain`` is 1, or ``1 + pole`` for the Hammerstein model of unit DC gain.
    """

    model: Model
    data: Dataset
    drives: tuple[np.ndarray, ...]  # shape (N, n_linear) each
    noise_bound: float
    truth: dict[str, float]
    unit_gain: bool

    @property
    def y(self) -> np.ndarray:
        return self.data.stacked("y")

    @property
    def n_linear(self) -> int:
        return self.drives[0].shape[1]

    def responses(self, pole: float) -> np.ndarray:
        """Return G with w = G (linear, initial states) at a fixed pole."""
        gain = 1 + pole if self.unit_gain else 1.0
        blocks = []
        for number, drive in enumerate(self.drives):
            g = np.zeros((len(drive), self.n_linear + len(self.drives)))
            g[0, self.n_linear + number] = 1.0
            for k in range(1, len(drive)):
                g[k] = -pole * g[k - 1]
                g[k, : self.n_linear] += gain * drive[k - 1]
            blocks.append(g)
        return np.concatenate(blocks)

    def least_noise_at(self, pole: float) -> float:
        """Return the least noise bound that a pole allows."""
        g = self.responses(pole)
        ones = np.ones((len(g), 1))
        found = linprog(
            np.r_[np.zeros(g.shape[1]), 1.0],
            A_ub=np.block([[g, -ones], [-g, -ones]]),
            b_ub=np.r_[self.y, -self.y],
            bounds=[(None, None)] * g.shape[1] + [(0, None)],
            options=TIGHT,
        )
        return float(found.fun)

    def least_noise(self, grid: int = 61) -> float:
        """Return the least noise bound over all stable poles: a grid, then golden section."""
        poles = np.linspace(-1, 1, grid)
        values = [self.least_noise_at(p) for p in poles]
        best = int(np.argmin(values))
        bracket = poles[max(best - 1, 0)], poles[min(best + 1, grid - 1)]
        polished = minimize_scalar(self.least_noise_at, bounds=bracket, method="bounded", options={"xatol": 1e-11})
        return float(min(polished.fun, values[best]))

    def pole_interval(self, grid: int = 41) -> tuple[float, float]:
        """Return the range of the pole: a grid over [-1, 1], then bisection outwards."""
        true = next(iter(self.truth.values()))
        poles = np.unique(np.r_[np.linspace(-1, 1, grid), true])
        feasible = [p for p in poles if self.least_noise_at(p) <= self.noise_bound]
        ends = []
        for inside, outside in (
            (min(feasible), poles[poles < min(feasible)][::-1]),
            (max(feasible), poles[poles > max(feasible)]),
        ):
            if len(outside):
                far = outside[0]
                for _ in range(44):
                    middle = 0.5 * (inside + far)
                    if self.least_noise_at(middle) <= self.noise_bound:
                        inside = middle
                    else:
                        far = middle
            ends.append(float(inside))
        return ends[0], ends[1]

    def _least_linear(self, pole: float, k: int, sign: float) -> float:
        g = self.responses(pole)
        cost = np.zeros(g.shape[1])
        cost[k] = sign
        found = linprog(
            cost,
            A_ub=np.r_[g, -g],
            b_ub=np.r_[self.y + self.noise_bound, self.noise_bound - self.y],
            bounds=(None, None),
            options=TIGHT,
        )
        return float(found.fun) if found.status == 0 else np.inf

    def linear_interval(self, k: int, poles: tuple[float, float], grid: int = 25) -> tuple[float, float]:
        """Return the range of a linear parameter: a grid over the feasible poles, then golden section."""
        ends = []
        for sign in (1.0, -1.0):
            points = np.linspace(*poles, grid)
            values = [self._least_linear(p, k, sign) for p in points]
            best = int(np.argmin(values))
            bracket = points[max(best - 1, 0)], points[min(best + 1, grid - 1)]
            polished = minimize_scalar(
                self._least_linear, args=(k, sign), bounds=bracket, method="bounded", options={"xatol": 1e-11}
            )
            ends.append(sign * min(polished.fun, values[best]))
        return ends[0], ends[1]


def first_order(
    kind: str, n: int | tuple[int, ...], seed: int, noise_bound: float = 0.1, margin: float = 1.0, **priors: object
) -> FirstOrder:
    """Draw a problem; ``n`` is the length of each record, the noise is uniform within its bound over ``margin``."""
    rng = np.random.default_rng(seed)
    hammerstein = kind == "hammerstein"
    pole, linear = (-0.65, (0.6, -1.1)) if hammerstein else (-0.7, (1.2,))
    drives, records = [], []
    for number, size in enumerate((n,) if isinstance(n, int) else n):
        u = np.linspace(-1.2, 1.2, size) + rng.uniform(-0.3, 0.3, size) if hammerstein else rng.choice([-1.0, 1], size)
        drive = np.stack([u**3, u], axis=1) if hammerstein else u[:, None]
        w = np.zeros(size)
        w[0] = rng.normal()
        for k in range(1, size):
            w[k] = -pole * w[k - 1] + (1 + pole if hammerstein else 1.0) * drive[k - 1] @ np.array(linear)
        noise = rng.uniform(-noise_bound, noise_bound, size) / margin
        drives.append(drive)
        records.append(
            Dataset.from_arrays(input={"u": u}, output={"y": w + noise}, sampling_time=1.0, name=f"run{number}")
        )
    settings: dict[str, object] = {"stable": True, **priors}
    model = Hammerstein(1, (3, 1), **settings) if hammerstein else OutputError(1, 0, **settings)
    truth = dict(zip([p.name for p in model.parameters], (pole, *linear), strict=True))
    return FirstOrder(model, Dataset.merge(records), tuple(drives), noise_bound, truth, hammerstein)
