"""The page of a diagnosis: what the simulation gets wrong, why, what to add, and what that gains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from smid.diagnosis.cause import Cause, CauseParameter, Rival
from smid.diagnosis.diagnosis import Diagnosis, Verdict
from smid.diagnosis.figures import before_and_after, experiment_figure, rivals_figure, spoken
from smid.models import Parameter
from smid.reports import mathml
from smid.reports.page import render_page
from smid.reports.style import inline_svg
from smid.reports.writing import check_writable, write_text

_TOLD_ODDS = 1e6


def diagnosis_report(
    diagnosis: Diagnosis,
    path: str | PathLike[str],
    *,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Path:
    """Write the page of a diagnosis; see :func:`smid.report`."""
    check_writable(path)
    better = diagnosis.model is not diagnosis.base
    marked = diagnosis.new_parameters
    page = render_page(
        "diagnosis.html.j2",
        data=diagnosis.data,
        links=links,
        title=_title(diagnosis),
        d=diagnosis,
        g=diagnosis.gain,
        better=better,
        ambiguous=diagnosis.verdict is Verdict.AMBIGUOUS,
        conclusion=_conclusion(diagnosis),
        overview=inline_svg(
            before_and_after(diagnosis), f"{diagnosis.output} measured and simulated, and the errors", "overview"
        ),
        misfit=inline_svg(
            diagnosis.misfit.plot(), "The error of the base model against what it may depend on", "misfit"
        ),
        causes=[_cause(number, cause, diagnosis) for number, cause in enumerate(diagnosis.causes)],
        experiment=_experiment(diagnosis),
        equations=mathml.equations(diagnosis.model, marked),
        values=[_value(p, diagnosis, p.name in marked) for p in diagnosis.model.parameters],
        skipped={spoken(name): _skipped(why) for name, why in diagnosis.skipped.items()},
        dropped=[spoken(name) for name in diagnosis.dropped],
        fall=_fall(diagnosis.gain.rmse_before, diagnosis.gain.rmse_after),
        notes=notes,
        settings=settings,
    )
    return write_text(path, page)


def _title(diagnosis: Diagnosis) -> str:
    names = [spoken(cause.effect) for cause in diagnosis.causes]
    if diagnosis.verdict is Verdict.AMBIGUOUS:
        names[-1] = _alternatives(diagnosis)
    return f"Diagnosis of {diagnosis.output}: {', then '.join(names) or 'no cause named'}"


def _alternatives(diagnosis: Diagnosis) -> str:
    return " or ".join(map(spoken, diagnosis.alternatives))


def _conclusion(diagnosis: Diagnosis) -> str:
    """Return the verdict for the top of the page, where every sentence stands alone."""
    if diagnosis.verdict is Verdict.AMBIGUOUS:
        last = f"{diagnosis.verdict.sentence} It is {_alternatives(diagnosis)}; these data cannot tell which."
        return " ".join([f"Cause: {spoken(c.effect)}. {c.sentence}" for c in diagnosis.causes[:-1]] + [last])
    if diagnosis.verdict is Verdict.NONE:
        rest = "" if diagnosis.unexplained else " What the base model leaves looks like noise."
        return f"{diagnosis.verdict.sentence}{rest}"
    words = ("Cause", "Then", "Then", "Then")
    return " ".join(f"{words[min(k, 3)]}: {spoken(c.effect)}. {c.sentence}" for k, c in enumerate(diagnosis.causes))


def _cause(number: int, cause: Cause, diagnosis: Diagnosis) -> dict[str, Any]:
    evidence = cause.evidence
    facts = {"confidence": _confidence(cause.confidence)}
    unit = f" {diagnosis.unit}".rstrip()
    if "chance" in evidence:
        facts["held-out RMSE"] = f"{evidence['rmse_before']:.4g} to {evidence['rmse_after']:.4g}{unit}" + (
            f" ({_fall(evidence['rmse_before'], evidence['rmse_after'])})"
        )
        facts["chance of such a gain by accident"] = _chance(evidence["chance"])
        shares = [f"{100 * evidence[f'structure_{when}']:.0f} % {when}" for when in ("before", "after")]
        facts["share of the error that follows from its own past"] = ", ".join(shares)
    else:
        facts |= {spoken(k): f"{v:.4g}" for k, v in evidence.items() if k not in ("rmse_before", "rmse_after")}
    picture = ""
    if cause.rivals:
        figure = rivals_figure(cause, diagnosis.unit)
        picture = inline_svg(figure, f"Held-out error with {cause.effect} and its rivals", f"rivals-{number}")
    return {
        "name": spoken(cause.effect),
        "label": cause.label,
        "sentence": cause.sentence,
        "facts": facts,
        "parameters": [_parameter(p) for p in cause.parameters],
        "rivals": [_rival(r, unit) for r in cause.rivals],
        "picture": picture,
    }


def _parameter(p: CauseParameter) -> dict[str, Any]:
    excluded = p.null is not None and p.lower is not None and p.upper is not None and not p.lower <= p.null <= p.upper
    return {
        "symbol": mathml.symbol(p.name, [p.name]),
        "unit": p.unit,
        "value": f"{p.value:.4g}",
        "interval": "none" if p.lower is None or p.upper is None else f"{p.lower:.4g} to {p.upper:.4g}",
        "null": "shapes the effect" if p.null is None else f"{p.null:.4g}",
        "verdict": "" if p.null is None or p.lower is None else "excluded" if excluded else "not excluded",
        "kind": "certified" if p.proven else "three standard deviations of the fit",
    }


def _rival(rival: Rival, unit: str) -> dict[str, str]:
    odds = "more than a million to 1" if rival.odds >= _TOLD_ODDS else f"{rival.odds:.3g} to 1"
    return {"name": spoken(rival.effect), "rmse": f"{rival.rmse:.4g}{unit}", "odds": odds, "why": rival.why}


def _experiment(diagnosis: Diagnosis) -> dict[str, str] | None:
    if diagnosis.experiment is None:
        return None
    picture = inline_svg(
        experiment_figure(diagnosis.experiment, diagnosis), "The input of the experiment to do next", "experiment"
    )
    sentence = diagnosis.experiment.sentence
    for name in diagnosis.experiment.rivals:
        sentence = sentence.replace(name, spoken(name))
    return {"sentence": sentence, "picture": picture}


def _value(p: Parameter, diagnosis: Diagnosis, new: bool) -> dict[str, Any]:
    value, before = diagnosis.model.values.get(p.name), diagnosis.base.values.get(p.name)
    # A fixed parameter carries its value in its box.
    value = p.lower if value is None and p.lower == p.upper else value
    return {
        "symbol": mathml.symbol(p.name, [p.name] if new else ()),
        "unit": p.unit,
        "new": new,
        "before": "" if before is None else f"{before:.5g}",
        "value": "" if value is None else f"{value:.5g}",
    }


def _skipped(why: str) -> str:
    return f"not tried: it {why}" if why.startswith("does not") else f"not tried: it needs {why}"


def _confidence(value: float) -> str:
    return "more than 99.9 %" if value > 0.999 else f"{100 * value:.3g} %"


def _chance(value: float) -> str:
    return "less than 1 in 1000" if value < 1e-3 else f"{100 * value:.2g} %"


def _fall(before: float, after: float) -> str:
    """Return how much smaller an error has become, in words."""
    if not (before > 0 and after > 0 and math.isfinite(before / after)):
        return "no change"
    ratio = before / after
    return (
        f"{ratio:.2g} times smaller"
        if ratio >= 2
        else f"{100 * (1 - 1 / ratio):.0f} % smaller"
        if ratio > 1
        else "not smaller"
    )
