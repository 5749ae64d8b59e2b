"""The thesis's printed Hammerstein model, compared with certified intervals.

Three checks need no data. An interval whose lower end is above its upper end is empty. With unit DC gain, (3.12),
``beta = 1 + alpha``, so the exact interval of alpha determines that of beta. A model identified from a set must lie
inside that set's intervals.

Two checks need data, and the thesis's are not public:

- The thesis's central model makes data over a bundled current, with uniform noise up to its own noise bound. There
  model and noise bound are right. The certified intervals, whose widths verified points attain, show the information
  in 400 samples.
- On the bundled record the widths just above the least noise bound are as small as the thesis's.

The unit of the thesis's noise bound is not printed. We take the unit of its pressure, of which the bound is 4 %.

Reference: clutch thesis, section 3.2.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.identification.estimate import Estimate
from smid.identification.identify import identify
from smid.models import Hammerstein, Model
from smid.study.finished import finished
from smid.study.widths import WidthStudy
from smid.theses.clutch.hammerstein.model import clutch_hammerstein

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "PRINTED",
    "PRINTED_NOISE_BOUND",
    "Printed",
    "PrintedComparison",
    "compare_with_printed",
    "printed_central_model",
    "printed_model",
    "printed_step_model",
]


@dataclass(frozen=True)
class Printed:
    """One parameter as the thesis prints it.

    Parameters
    ----------
    lower, upper, central
        Interval and central estimate.
    model
        Value in the model that is printed below the table.
    """

    name: str
    lower: float
    upper: float
    central: float
    model: float

    @property
    def width(self) -> float:
        """Return upper minus lower end; negative if they are inverted."""
        return self.upper - self.lower

    @property
    def inverted(self) -> bool:
        """Tell whether the lower end is above the upper end."""
        return self.lower > self.upper

    @property
    def outside(self) -> float:
        """Return the distance of the printed model from the interval, its ends sorted; zero inside."""
        low, high = sorted((self.lower, self.upper))
        return max(low - self.model, self.model - high, 0.0)


PRINTED = (
    Printed("alpha", -0.651574, -0.651257, -0.65142, -0.62932623),
    Printed("beta", 0.348427, 0.348777, 0.34860, 0.3706738),
    Printed("gamma1", -0.002722, -0.0027232, -0.00272, -0.0026051),
    Printed("gamma2", 0.039016, 0.039050, 0.03903, 0.0375240),
    Printed("gamma3", -0.081878, -0.081552, -0.08172, -0.0771024),
)
PRINTED_NOISE_BOUND = 1.41
_STEP_POLE = 0.9562  # (3.22)
_STEP_CURVE = {5: 7.31e-15, 4: -2.28e-11, 3: 2.36e-8, 2: -6.9e-6, 1: 5.77e-4}  # (3.23), current in mA


def printed_central_model() -> Model:
    """Return the thesis's Hammerstein model with its central estimates."""
    return _with({p.name: p.central for p in PRINTED})


def printed_model() -> Model:
    """Return the Hammerstein model that the thesis prints below its intervals."""
    return _with({p.name: p.model for p in PRINTED})


def _with(values: dict[str, float]) -> Model:
    model = clutch_hammerstein()
    return model.with_values({p.name: values[p.name] for p in model.parameters})


def printed_step_model() -> Model:
    """Return the thesis's HS20, (3.22)-(3.23), identified on steps by MATLAB and printed without a delay.

    The gain of the linear part is moved into the polynomial, whose input is the current in mA.
    """
    model = Hammerstein(poles=1, powers=tuple(_STEP_CURVE), delay=0, stable=True)
    gains = {f"gamma{k}": c / (1.0 - _STEP_POLE) for k, c in enumerate(_STEP_CURVE.values(), start=1)}
    return model.with_values({"alpha": -_STEP_POLE, **gains})


@dataclass(frozen=True, eq=False, repr=False)
class PrintedComparison(Result):
    """Printed intervals, and certified ones.

    Parameters
    ----------
    known
        On data that the thesis's central model made, with its noise bound.
    widths
        On the bundled record.
    """

    known: Estimate
    widths: WidthStudy

    @property
    def consistency(self) -> Table:
        """Return the printed numbers of each parameter, and their contradictions."""
        rows = []
        for p in PRINTED:
            verdict = "lower end above upper end; " if p.inverted else ""
            verdict += f"model outside, by {p.outside / abs(p.width):.0f} widths" if p.outside else "model inside"
            values = (f"{value:.8g}" for value in (p.lower, p.upper, p.central, p.model))
            rows.append((p.name, *values, verdict))
        header = ("parameter", "lower", "upper", "central", "model", "contradiction")
        return Table("What the thesis prints: intervals, central estimate and model.", header, tuple(rows), "lrrrrl")

    @property
    def table(self) -> Table:
        """Return the printed and certified widths; beta = 1 + alpha is as wide as alpha."""
        nearest = self.widths.estimates[0]
        rows = []
        for p in PRINTED:
            name = "alpha" if p.name == "beta" else p.name
            interval = self.known[name]
            attained = interval.inner_upper - interval.inner_lower
            ratio = "-" if p.inverted else f"{attained / p.width:.0f}"
            widths = (p.width, interval.width, attained, nearest[name].width)
            rows.append((p.name, *(f"{width:.3g}" for width in widths), ratio))
        header = (
            "parameter",
            "thesis, printed",
            "its model: certified",
            "its model: attained",
            f"our record at {self.widths.factors[0]:g} x least bound",
            "attained / printed",
        )
        caption = (
            f"Widths. 'Its model': {self.known.data.n_samples} samples simulated with the thesis's central estimates, "
            f"uniform noise up to its bound of {PRINTED_NOISE_BOUND}. Verified points attain that width: no valid "
            "interval on these samples is narrower."
        )
        return Table(caption, header, tuple(rows), "lrrrrr")

    @property
    def findings(self) -> tuple[str, ...]:
        """Return what the numbers show, a sentence or two each."""
        by_name = {p.name: p for p in PRINTED}
        alpha, beta = by_name["alpha"], by_name["beta"]
        inverted = [p for p in PRINTED if p.inverted]
        outside = [p.name for p in PRINTED if p.outside]
        interval = self.known["alpha"]
        attained = interval.inner_upper - interval.inner_lower
        factor, nearest = self.widths.factors[0], self.widths.estimates[0]["alpha"].width
        return (
            *(
                f"The interval printed for {p.name}, [{p.lower:g}, {p.upper:g}], is inverted. Taken as printed, no "
                "model explains the data. Certified ends are inverted only if the feasible set is proven empty."
                for p in inverted
            ),
            f"With unit DC gain, beta = 1 + alpha. From the printed interval of alpha, the interval of beta is "
            f"[{1 + alpha.lower:.6f}, {1 + alpha.upper:.6f}]. Printed is [{beta.lower:.6f}, {beta.upper:.6f}]. At "
            "least one of the two does not have the exact ends of (3.15) and (3.16).",
            f"The model printed below the table lies outside the printed intervals of {', '.join(outside)} "
            f"({len(outside)} of {len(PRINTED)} parameters). Its validation suggests that it explains the data within "
            f"the noise bound. Then alpha's interval contains {alpha.lower:g} to {alpha.model:g}, "
            f"{(alpha.model - alpha.lower) / alpha.width:.0f} times the printed width.",
            f"The thesis's central model made {self.known.data.n_samples} samples, with noise up to the thesis's "
            f"bound. Values of alpha with a distance of {attained:.2g} explain these samples (verified). This is "
            f"{attained / alpha.width:.0f} times the printed width of {alpha.width:.2g}.",
            f"A noise bound close to the least one gives widths like the printed ones. On our record alpha's interval "
            f"has a width of {nearest:.2g} at {factor:g} times the least bound. There every interval is narrow, so the "
            "width does not show how well alpha is known.",
        )

    def _content(self) -> Iterator[Part]:
        yield self.consistency
        yield self.table
        yield from self.findings

    def plot(self) -> Figure:
        """Draw the printed interval and model of each parameter over the certified interval."""
        from smid.theses.clutch.hammerstein.figures import printed_figure

        return printed_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        names = ("name", "lower", "upper", "central", "model", "inverted", "outside")
        return {
            "printed": [{name: getattr(p, name) for name in names} for p in PRINTED],
            "known": self.known.to_dict(),
            "findings": list(self.findings),
        }


def compare_with_printed(
    part: Dataset, widths: WidthStudy, *, seed: int = 1, progress: Progress | None = None
) -> PrintedComparison:
    """Compare the intervals that the thesis prints with certified ones.

    The current of the part drives the thesis's central model; the widths are those on the same part.
    """
    # Data of the thesis's central model with noise up to its bound.
    model = bind(printed_central_model(), part)
    free_run = model.simulate(part).outputs[0][part.output]
    noise = np.random.default_rng(seed).uniform(-PRINTED_NOISE_BOUND, PRINTED_NOISE_BOUND, free_run.size)
    run = part.experiments[0]
    made = replace(run, values={**run.values, part.output: free_run + noise})
    data = replace(part.with_experiments([made]), source=f"the thesis's central model over {run.name} (simulated)")
    known = identify(clutch_hammerstein(), data, PRINTED_NOISE_BOUND, tolerance=1e-2, progress=progress)
    return PrintedComparison(finished(known), widths)
