"""The white model of the arm, all four constants estimated at once: table F.2.

1/J, b, Ws and Wd are changed until the free run fits the angle. The thesis used Euler's method and ODE23. The result
depends on the integrator, because the constants compensate the error of Euler's method. Here also the exact motion is
used (`smid.theses.hybrid.arm.exact_motion`), which has no step size. With a step size the run jumps when a constant
moves an event across a sample, and derivatives do not include the jump. The exact run is continuous. The linearly
implicit scheme follows sticking in steps of a sample.

Reference: hybrid thesis, section F.2, table F.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.display.result import Part, Result
from smid.hybrid.free_run_error import FreeRunError
from smid.models import Model, ModelError, RotatingArm
from smid.models.errors import refuse_unknown
from smid.networks import descend, levenberg_marquardt
from smid.theses.hybrid.arm.exact_motion import exact_motion

__all__ = ["INTEGRATIONS", "TABLE_F2_START", "WhiteEstimate", "estimate_white", "white_arm", "white_free_run"]

INTEGRATIONS = ("exact", "rosenbrock", "rk4", "euler")
TABLE_F2_START: dict[str, float] = {"theta": 16.0, "b": 0.0016, "Ws": 1.6, "Wd": 0.16}
"""Initial values of table F.2."""

BOX = (0.0, 100.0)
STEP, SMALL, EVALUATIONS = 1e-6, 1e-12, 50
LEVELS = np.geomspace(0.1, 10.0, 13)  # of (Ws - Wd) / Wd


@dataclass(frozen=True, eq=False, repr=False)
class WhiteEstimate(Result):
    """The white arm's constants.

    Parameters
    ----------
    values
        theta, b, Ws, Wd in the units of `smid.theses.hybrid.arm.ARM`.
    integration
        One of `INTEGRATIONS`.
    rmse
        Of the free run over the record, in rad.
    """

    values: Mapping[str, float]
    integration: str
    rmse: float

    def _content(self) -> Iterator[Part]:
        values = ", ".join(f"{name} = {value:.4g}" for name, value in self.values.items())
        yield f"white arm, {self.integration}: {values}; free-run error {self.rmse:.3g} rad"


def white_arm(scheme: str = "rk4", substeps: int = 1) -> Model:
    """Return the arm's white model with theta, b, Ws and Wd free.

    Parameters
    ----------
    scheme, substeps
        Of the integration; see `Model`.

    Examples
    --------
    >>> [p.name for p in white_arm().parameters if p.lower < p.upper]
    ['theta', 'Ws', 'Wd', 'b']
    """
    model = RotatingArm(theta=None, friction=True, drag=True, scheme=scheme, substeps=substeps)
    return model.bound(b=BOX, Ws=BOX, Wd=BOX)


def estimate_white(
    data: Dataset, integration: str = "exact", *, start: Mapping[str, float] = TABLE_F2_START
) -> WhiteEstimate:
    """Estimate the white arm from a record that begins at rest.

    Parameters
    ----------
    data
        One record with input ``u`` in V and output ``y``, the angle in rad.
    integration
        One of `INTEGRATIONS`.

    Raises
    ------
    ModelError
        If there is no such integration, there are several records, or the start is not positive.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> found = estimate_white(held_record(TABLE_F1["one_sine"]), "euler")
    >>> round(found.values["theta"], 1)
    21.9
    """
    refuse_unknown("integration", [integration], INTEGRATIONS)
    if len(data.experiments) != 1 or sorted(start) != sorted(TABLE_F2_START) or not min(start.values()) > 0:
        raise ModelError(
            f"{len(data.experiments)} records, start = {dict(start)}: give one record, and a positive start for each "
            f"of {', '.join(TABLE_F2_START)}"
        )
    if integration == "exact":
        values = _exactly(data, start)
    else:
        model = white_arm(integration)
        free = [p.name for p in model.parameters if p.lower < p.upper]
        problem = FreeRunError(model, data, np.array([start[name] for name in free]))
        # The thesis's method: a constant with little effect on the run, such as Ws, stays at its start.
        found = descend(levenberg_marquardt, problem, np.ones(len(free)), patience=1000).theta
        values = problem.values(found)
    ordered = {name: values[name] for name in TABLE_F2_START}
    residual = white_free_run(ordered, data, integration) - data.experiments[0].values["y"]
    return WhiteEstimate(ordered, integration, float(np.sqrt(np.mean(residual**2))))


def white_free_run(values: Mapping[str, float], data: Dataset, integration: str = "exact") -> Array:
    """Return the angle of the white arm in rad, in a free run from rest, shape (n,).

    Parameters
    ----------
    values
        theta, b, Ws and Wd.
    data
        One record with input ``u``.
    integration
        One of `INTEGRATIONS`.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> record = held_record(TABLE_F1["one_sine"])
    >>> from smid.theses.hybrid.arm.exact_motion import ARM
    >>> truth = {name: ARM[name] for name in TABLE_F2_START}
    >>> bool(np.abs(white_free_run(truth, record) - record.experiments[0].values["y"]).max() < 1e-12)
    True
    """
    refuse_unknown("integration", [integration], INTEGRATIONS)
    record = data.experiments[0]
    if integration == "exact":
        return exact_motion(record.values["u"], data.sampling_time, values=dict(values))[:, 0]
    model = white_arm(integration)
    return model.simulate(data, values, "rest").outputs[0]["y"]


def _exactly(data: Dataset, start: Mapping[str, float]) -> dict[str, float]:
    """Return the fit of the exact motion: with Ws fixed at its start, then of all four constants from several Ws.

    Under a held voltage the arm breaks away at the first sample whose torque exceeds Ws. The error jumps where Ws
    passes such a torque, and no descent crosses the jump, so several levels of Ws are tried. The variables are
    logarithms, and that of Ws - Wd, because all constants are positive and Ws >= Wd.
    """
    u, y = data.experiments[0].values["u"], data.experiments[0].values["y"]

    def values(theta: Array) -> dict[str, float]:
        inertia, b, wd, more = np.exp(theta).tolist()
        return {"theta": inertia, "b": b, "Wd": wd, "Ws": wd + more}

    def residual(theta: Array) -> Array:
        return np.asarray(exact_motion(u, data.sampling_time, values=values(theta))[:, 0] - y)

    def descent(first: Array, free: int) -> tuple[float, Array]:
        rest = first[free:]

        def partly(part: Array) -> Array:
            return residual(np.concatenate([part, rest]))

        found = least_squares(
            partly,
            first[:free],
            diff_step=[STEP] * free,
            xtol=SMALL,
            ftol=SMALL,
            gtol=SMALL,
            max_nfev=EVALUATIONS,
        )
        return float(found.cost), np.concatenate([found.x, rest])

    first = np.log([start["theta"], start["b"], start["Wd"], max(start["Ws"] - start["Wd"], SMALL)])
    _, gliding = descent(first, 3)
    levels = np.log(np.exp(gliding[2]) * LEVELS)
    _, best = min((descent(np.append(gliding[:3], level), 4) for level in levels), key=lambda found: found[0])
    return values(best)
