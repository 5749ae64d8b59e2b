"""Fisher information: the best precision that an unbiased estimator can reach.

The output noise is independent and normal with standard deviation sigma. With s_k the derivative of sample k with
respect to the parameters, ``M = sum_k s_k s_k' / sigma^2``. No unbiased estimator has a covariance below ``M^-1``
(Cramer-Rao bound). Unknown initial states x reduce the information on the parameters p to
``M_pp - M_px M_xx^-1 M_xp``. The determinant is taken for relative parameters, p / p_0, so it does not depend on units.

References: hybrid thesis, section 7.4; Goodwin and Payne, "Dynamic System Identification: Experiment Design and Data
Analysis" (1977), chapter 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.models import Model, ModelError
from smid.models.running import at_sampling_time
from smid.models.sensitivities import compile_free_run

__all__ = ["FisherInformation", "fisher_information", "model_information"]


SINGULAR = 1e-12  # share of the largest eigenvalue below which a direction is not excited


@dataclass(frozen=True, eq=False, repr=False)
class FisherInformation(Tabular):
    """Fisher information of an experiment.

    Parameters
    ----------
    values
        Shape (n,). Parameter values at which it was evaluated.
    matrix
        Shape (n, n). In the reciprocal units of both parameters.
    """

    names: tuple[str, ...]
    values: Array
    matrix: Array

    @property
    def relative(self) -> Array:
        """Return the information on p / p_0, shape (n, n)."""
        return np.asarray(self.matrix * np.outer(self.values, self.values))

    @property
    def log_determinant(self) -> float:
        """Return the log determinant for relative parameters; minus infinity if singular."""
        eigenvalues = np.linalg.eigvalsh(self.relative)
        if eigenvalues[0] <= SINGULAR * eigenvalues[-1]:
            return -np.inf
        return float(np.log(eigenvalues).sum())

    @property
    def relative_deviations(self) -> Array:
        """Return the smallest relative standard deviations; infinite if the matrix is singular."""
        if not np.isfinite(self.log_determinant):
            return np.full(len(self.names), np.inf)
        return np.sqrt(np.diag(np.linalg.inv(self.relative)))

    @property
    def table(self) -> Table:
        """Return a table of the smallest standard deviation of each parameter."""
        rows = tuple(
            (row["parameter"], f"{row['value']:.5g}", f"{100 * row['relative_deviation']:.2g}%") for row in self._rows()
        )
        return Table("Smallest standard deviations (Cramer-Rao)", ("parameter", "value", "deviation"), rows, "lrr")

    def to_dict(self) -> dict[str, Any]:
        """Return the rows of the table and the matrix as plain data."""
        return {"parameters": plain(tuple(self._rows())), "matrix": plain(self.matrix)}

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        columns = (self.names, self.values.tolist(), self.relative_deviations.tolist())
        return (
            {"parameter": name, "value": value, "relative_deviation": share}
            for name, value, share in zip(*columns, strict=True)
        )


def fisher_information(
    slopes: ArrayLike,
    names: Sequence[str],
    values: ArrayLike,
    deviation: float,
    *,
    nuisance: ArrayLike | None = None,
) -> FisherInformation:
    """Return the Fisher information of a measured output.

    Parameters
    ----------
    slopes
        Shape (n_samples, n). Derivatives of the output with respect to the parameters.
    values
        Shape (n,). Parameter values of these derivatives; none zero.
    deviation
        Standard deviation of the noise, in the output's unit (D / sqrt(3) for uniform noise within +-D).
    nuisance
        Shape (n_samples, m). Derivatives with respect to other unknowns.

    Raises
    ------
    ModelError
        If shapes do not match, there are fewer samples than unknowns, or a value or the deviation is not valid.

    Examples
    --------
    >>> line = np.stack([np.arange(5.0), np.ones(5)], axis=1)
    >>> fisher_information(line, ("slope", "offset"), (2.0, 1.0), 1.0).matrix
    array([[30., 10.],
           [10.,  5.]])
    >>> float(fisher_information(line[:, :1], ("slope",), (2.0,), 1.0, nuisance=line[:, 1:]).matrix[0, 0].round(9))
    10.0
    """
    s, p = np.asarray(slopes, dtype=np.float64), np.asarray(values, dtype=np.float64)
    extra = np.empty((len(s), 0)) if nuisance is None else np.asarray(nuisance, dtype=np.float64)
    if s.ndim != 2 or s.shape[1] != len(names) or p.shape != (len(names),) or len(extra) != len(s):
        raise ModelError(f"slopes of shape {s.shape} do not fit {len(names)} parameters: give one column for each")
    if len(s) < s.shape[1] + extra.shape[1]:
        raise ModelError(
            f"{len(s)} samples for {s.shape[1] + extra.shape[1]} unknowns: use a longer record, or fix parameters"
        )
    if not (np.isfinite(deviation) and deviation > 0):
        raise ModelError(f"the noise deviation is {deviation}: give a positive number in the output's unit")
    if not (np.isfinite(s).all() and np.isfinite(p).all() and (p != 0).all()):
        raise ModelError("slopes and values must be finite and no value zero: choose other parameter values")
    # Remove the nuisance by projection; the Schur complement would square the condition number.
    basis = np.linalg.qr(extra)[0] if extra.size else extra
    kept = s - basis @ (basis.T @ s)
    return FisherInformation(tuple(names), p, kept.T @ kept / deviation**2)


def model_information(
    model: Model,
    inputs: Mapping[str, ArrayLike],
    values: Mapping[str, float],
    deviation: float,
    *,
    sampling_time: float | None = None,
    initial: Mapping[tuple[str, int], float] | None = None,
    unknown_start: bool = True,
) -> FisherInformation:
    """Return the information on a model's free parameters, from the sensitivities of its free run.

    The effect of a parameter on the time of a jump is not included (sign in a line, as in Coulomb friction).
    `arm_information` includes it for the arm.

    Parameters
    ----------
    model
        With one measured output.
    inputs
        Shape (n,).
    values
        Values of the free parameters.
    deviation
        Standard deviation of the noise, in the output's unit.
    sampling_time
        In seconds; needed for a continuous model.
    initial
        States before the first sample; zero by default.
    unknown_start
        Whether these states are unknown too, which reduces the information.

    Raises
    ------
    ModelError
        If the model has several outputs, a value is missing, or the free run diverges.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u = np.sign(np.sin(0.7 * np.arange(100)))
    >>> found = model_information(OutputError(), {"u": u}, {"a1": -0.8, "b0": 0.5}, 0.1)
    >>> found.names, bool(found.relative_deviations.max() < 0.1)
    (('a1', 'b0'), True)
    """
    if len(model.measurements) != 1 or model.measurements[0].inverse is not None:
        raise ModelError(f"{model.name!r} has several outputs or a sensor curve: keep one output without a curve")
    free_run = compile_free_run(at_sampling_time(model, sampling_time))
    missing = [name for name in free_run.parameters if name not in values]
    if missing:
        raise ModelError(f"no value for {', '.join(missing)}: give a guess of all parameters")
    # Simulate with sensitivities to parameters and initial states.
    point = {name: float(values[name]) for name in free_run.parameters}
    begin = {state: float((initial or {}).get(state, 0.0)) for state in free_run.states}
    arrays = {name: np.asarray(u, dtype=np.float64) for name, u in inputs.items()}
    _, found = free_run.run(arrays, point, begin)
    signal = model.measurements[0].signal
    if signal not in found:
        raise ModelError(f"the free run of {model.name!r} diverges: choose another input or other values")
    count = len(free_run.parameters)
    slopes = found[signal]
    # Only initial states that affect the output reduce the information.
    moved = slopes[:, count:][:, (slopes[:, count:] != 0).any(axis=0)]
    return fisher_information(
        slopes[:, :count],
        free_run.parameters,
        list(point.values()),
        deviation,
        nuisance=moved if unknown_start else None,
    )
