"""The report of tests of residuals: verdicts, correlations and spectra."""

from __future__ import annotations

from collections.abc import Mapping

from smid.reports.content import Facts, Items, Page, Picture, Remark, Section
from smid.reports.documents import residuals_document
from smid.reports.page import capitalised, data_section, equations, is_simulated
from smid.validation import Residuals

_HOW = (
    "The residual is the measured output minus the free run of the model. A test counts the lags at which the "
    "correlation lies outside its 99 % band. The probability is that chance alone gives a correlation as large as the "
    "largest one at any lag, or, for the own past, as many lags outside the band. A test is failed below 1 %."
)


def residuals_page(residuals: Residuals, *, settings: Mapping[str, str] | None = None) -> Page:
    """Return the report of tests of residuals; see :func:`smid.report`."""
    model, data, spectrum = residuals.validation.model, residuals.validation.data, residuals.spectrum
    pictures = tuple(
        Picture(
            residuals.plot(number),
            f"Residual of {one.channel} over time; left: correlations; right: spectrum, and coherence with the input. "
            "Bands: 99 % of chance.",
            f"Residual of {one.channel}, its correlations, its spectrum and its coherence with the inputs",
        )
        for number, one in enumerate(residuals.outputs)
    )
    values = tuple((parameter, f"{value:.6g}") for parameter, value in model.values.items())
    sections = (
        Section("Tests", (Items(residuals.sentences), residuals.table, Remark(_HOW))),
        Section("Residuals", pictures),
        Section("Spectra of residual and input", (spectrum.table, spectrum.coherence_table)),
        Section("Model", (equations(model), Facts(values))),
        data_section(data, drawn=False),
    )
    return Page(
        f"{capitalised(model.name)}: residuals",
        (residuals.conclusion,),
        sections,
        residuals_document(residuals),
        is_simulated([data.source]),
        settings or {},
    )
