"""What encloses the parameters that fit every sample of a record: by the model's equations and the record's length."""

from __future__ import annotations

from collections.abc import Mapping

from smid.data import Dataset
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import is_polynomial
from smid.identification.encloser import Encloser, Settings
from smid.identification.inversion.inverted import NAME as INVERSION
from smid.identification.inversion.inverted import Inverted
from smid.identification.piecewise import Piecewise
from smid.identification.polynomial import Polynomial
from smid.identification.separated import Separated, separate
from smid.identification.windows.windowed import Windowed, has_windows
from smid.models import Model


def encloser_for(
    model: Model,
    data: Dataset,
    bounds: Mapping[str, float],
    settings: Settings,
    kept: bool = False,
    windows: bool = True,
) -> Encloser:
    """Return the encloser.

    Parameters
    ----------
    bounds
        Of each noisy channel, in its unit.
    kept
        Whether to keep the steps of the proof.
    windows
        Whether a long record may be proven on windows.
    """
    automatic = settings.method == "auto" and settings.order is None

    def of_polynomials(model: Model) -> Encloser:
        own = {m.channel: bounds[m.channel] for m in model.measurements if m.channel in bounds}
        if windows and automatic and has_windows(model, data):
            return Windowed(model, data, own, settings, kept)
        feasible = FeasibleSet(model, data, own)
        return (Piecewise if feasible.openings else Polynomial)(feasible, settings, kept)

    if settings.method == INVERSION or (automatic and not is_polynomial(model)):
        return Inverted(model, data, bounds, settings)
    parts = () if len(model.output_channels) < 2 else separate(model)
    return Separated(model, parts, of_polynomials) if len(parts) > 1 else of_polynomials(model)
