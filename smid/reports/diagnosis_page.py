"""The report of a diagnosis: what the simulation gets wrong, why, what to add, and by how much the error falls."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from smid.diagnosis.cause import Cause, CauseParameter, Rival, percent
from smid.diagnosis.diagnosis import ENDED_EARLY, Diagnosis, Verdict
from smid.diagnosis.evidence.misfit_figures import shows_something
from smid.diagnosis.figures import (
    before_and_after,
    correlation_figure,
    experiment_figure,
    on_test_part,
    rivals_figure,
    spoken,
)
from smid.diagnosis.proof.name_proof import NameProof
from smid.diagnosis.proof.posed import REACH
from smid.display.table import Table
from smid.models import Parameter
from smid.reports.content import Block, Facts, Folded, Heading, Items, Page, Picture, Remark, Section, coloured, joined
from smid.reports.documents import diagnose_document
from smid.reports.page import capitalised, data_section, equations, is_simulated, parameter

_LARGEST_ODDS = 1e6
_NO_FAULT = (
    "No fault found: no rounding, stuck sensor, glitch, irregular sampling, feedback from output to input, or lack of "
    "excitation."
)


def diagnosis_page(
    diagnosis: Diagnosis,
    *,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Page:
    """Return the report of a diagnosis; see :func:`smid.report`."""
    sections = (
        *_experiment(diagnosis),
        _misfit(diagnosis),
        Section("The evidence", tuple(_evidence(diagnosis))),
        *_correlations(diagnosis),
        *_rivals(diagnosis),
        *_further(diagnosis),
        Section("Faults in the data", (_faults(diagnosis),)),
        _model(diagnosis),
        _gain(diagnosis),
        *_skipped(diagnosis),
        _data(diagnosis),
        _not_proven(diagnosis),
    )
    return Page(
        _title(diagnosis),
        tuple(_result(diagnosis, notes)),
        sections,
        diagnose_document(diagnosis),
        is_simulated([diagnosis.data.source]),
        settings or {},
        links or {},
        (_lead(diagnosis),),
    )


def _title(diagnosis: Diagnosis) -> str:
    names = [spoken(cause.effect) for cause in diagnosis.causes]
    if diagnosis.verdict is Verdict.AMBIGUOUS:
        names[-1] = _alternatives(diagnosis)
    return f"Diagnosis of {diagnosis.output}: {', then '.join(names) or 'no cause named'}"


def _alternatives(diagnosis: Diagnosis, word: str = "or") -> str:
    return f" {word} ".join(map(spoken, diagnosis.alternatives))


def _conclusion(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield the verdict for the top of the page, a paragraph for each cause, in words that need no context."""
    ambiguous = diagnosis.verdict is Verdict.AMBIGUOUS
    for number, cause in enumerate(diagnosis.causes[:-1] if ambiguous else diagnosis.causes):
        yield f"{'Then' if number else 'Cause'}: {_said(cause)}"
    if ambiguous:
        yield (
            f"{diagnosis.verdict.sentence} These data do not decide between {_alternatives(diagnosis, 'and')}. "
            f"One of them: {_said(diagnosis.causes[-1])}"
        )
    if diagnosis.verdict is Verdict.NONE:
        rest = "" if diagnosis.unexplained else " The error of the base model looks like noise."
        yield f"{diagnosis.verdict_sentence}{rest}"


def _said(cause: Cause) -> str:
    return f"{spoken(cause.effect)} (probability {percent(cause.confidence)}). {cause.sentence}"


def _result(diagnosis: Diagnosis, notes: Sequence[str]) -> Iterator[str]:
    if diagnosis.interrupted:
        yield coloured(ENDED_EARLY, "bad")
    yield from _conclusion(diagnosis)
    ambiguous = diagnosis.verdict is Verdict.AMBIGUOUS
    rest = "the experiment below can decide between the causes" if ambiguous else "no effect of the library explains it"
    left = f" The remaining error is not only noise: {rest}." if diagnosis.unexplained else ""
    yield diagnosis.gain_sentence + left
    if diagnosis.name_proof is not None:
        yield _spoken_in(diagnosis.name_proof.sentence, diagnosis.name_proof.causes)
    yield from notes


def _lead(diagnosis: Diagnosis) -> Picture:
    return Picture(
        on_test_part(diagnosis),
        "Free runs on the test part, which no fit and no choice has seen: the models use only the input.",
        f"{diagnosis.output} measured and simulated on the test part, and the errors",
    )


def _experiment(diagnosis: Diagnosis) -> Iterator[Section]:
    if diagnosis.experiment is None:
        return
    sentence = _spoken_in(diagnosis.experiment.sentence, diagnosis.experiment.rivals)
    picture = Picture(
        experiment_figure(diagnosis.experiment, diagnosis),
        "The input to apply. It stays within the range of the record.",
        "The input of the experiment to do next",
    )
    yield Section("The experiment to do next", (sentence, picture))


def _misfit(diagnosis: Diagnosis) -> Section:
    wrong = diagnosis.causes or diagnosis.unexplained
    simulated = Picture(
        before_and_after(diagnosis),
        "The whole record. Shaded: the test part.",
        f"{diagnosis.output} measured and simulated, and the errors",
    )
    views: Block = Picture(
        diagnosis.misfit.plot(),
        "The error of the base model against quantities that may explain it. Squares: means of bins. "
        "Percentages: share of the error variance that the quantity explains, corrected for chance.",
        "The error of the base model against quantities that may explain it",
    )
    if not shows_something(diagnosis.misfit):
        views = Folded("No single quantity explains the error significantly", (views,))
    return Section(
        "What the simulation gets wrong" if wrong else "How the simulation compares",
        (diagnosis.misfit.sentence, simulated, views),
    )


def _evidence(diagnosis: Diagnosis) -> Iterator[Block]:
    bound = diagnosis.misfit.noise_bound
    if diagnosis.proof:
        yield diagnosis.proof.sentence
        yield (
            "The proof holds for all values of the free parameters within their boxes, not only for the fitted values. "
            "It encloses every rounding error."
        )
    elif bound is None:
        yield "No noise bound was given, so it was not tested whether the base model can explain the data."
    else:
        within = _number(bound, diagnosis.unit)
        yield f"There is no proof that the base model cannot explain the data within {within}."
    if diagnosis.name_proof is not None:
        yield from _name_proof(diagnosis.name_proof)
    if not diagnosis.causes:
        yield "No effect is probable enough to be named, given the number of effects that were tested."
        return
    for cause in diagnosis.causes:
        yield Heading(capitalised(spoken(cause.effect)) + (f" ({cause.label})" if cause.label else ""))
        yield cause.sentence
        yield _facts(cause, diagnosis.unit)
        if cause.parameters:
            header = ("parameter", "value", "interval", "value for no effect", "this value is", "type of interval")
            yield Table("", header, tuple(_parameter(p) for p in cause.parameters), "lrrrrl")
    yield Remark(
        "Probability: the share of the evidence that the sets with this effect hold, among all sets of effects that "
        "were fitted. Effects that are not in the library were not tested."
    )


def _name_proof(proof: NameProof) -> Iterator[Block]:
    yield Heading(proof.title.rstrip("."))
    header = ("model", "on these samples", "most influential samples, or why nothing is proven")
    rows = []
    for name, found in proof.decisions:
        status = coloured(str(found.status), "good") if found.excluded else str(found.status)
        rows.append((_spoken_in(name, (*proof.causes, *proof.rivals)), status, found.ground))
    yield Table("", header, tuple(rows), "lll")
    yield Remark(
        "Excluded: no parameters within their boxes explain the samples (certified). A parameter or a hidden state "
        f"without a box is taken to be at most {REACH:g} times as large as in the fit, where relaxations decide "
        "nothing. Feasible: parameters and noises that explain them are verified. A rival that is not excluded is "
        "rejected by likelihood only."
    )


def _spoken_in(text: str, effects: Iterable[str]) -> str:
    """Return a text with the names of effects in words."""
    for name in effects:
        text = text.replace(name, spoken(name))
    return text


def _facts(cause: Cause, unit: str) -> Facts:
    evidence = cause.evidence
    facts = {"probability": percent(cause.confidence)}
    if "chance" in evidence:
        before, after = evidence["rmse_before"], evidence["rmse_after"]
        facts["RMSE on the test part"] = f"{before:.4g} before, {_number(after, unit)} after ({_fall(before, after)})"
        facts["probability of this gain by chance"] = _chance(evidence["chance"])
        shares = [f"{100 * evidence[f'structure_{when}']:.0f} % {when}" for when in ("before", "after")]
        facts["error variance explained by its own past"] = ", ".join(shares)
    else:
        facts |= {spoken(k): f"{v:.4g}" for k, v in evidence.items() if k not in ("rmse_before", "rmse_after")}
    return Facts(tuple(facts.items()))


def _parameter(p: CauseParameter) -> tuple[str, ...]:
    known = p.lower is not None and p.upper is not None
    verdict = ""
    if p.null is not None and p.lower is not None and p.upper is not None:
        verdict = "not excluded" if p.lower <= p.null <= p.upper else coloured("excluded", "good")
    kind = "certified" if p.proven else "three standard deviations of the fit"
    return (
        parameter(p.name, p.unit, new=True),
        f"{p.value:.4g}",
        f"{p.lower:.4g} to {p.upper:.4g}" if known else "none",
        "shape parameter" if p.null is None else f"{p.null:.4g}",
        verdict,
        kind if known else "",
    )


def _correlations(diagnosis: Diagnosis) -> Iterator[Section]:
    runs = {"base model": diagnosis.simulated, "extended model": diagnosis.extended}
    found = {name: diagnosis.correlations(free) for name, free in list(runs.items())[: 1 + diagnosis.is_extended]}
    if not all(found.values()):
        return
    rows = []
    for row in zip(*found.values(), strict=True):
        what = f"with {row[0].against}" if row[0].against else "with its own past"
        rows.append((what, *(f"{int(one.outside.sum())} of {one.lags.size}" for one in row)))
    yield Section(
        "Correlation of the error",
        (
            Picture(
                correlation_figure(diagnosis),
                "Correlation of the error on the test part with its own past, and with the input. Shaded: the band "
                "that holds 99 % of the lags if the error is white (own past), or independent of the input. A positive "
                "lag outside it: the error follows the input, so dynamics are missing. A negative lag outside it: the "
                "input reacts on the output.",
                "Correlation of the error with its own past and with the input",
            ),
            Table("", ("lags outside the 99 % band", *found), tuple(rows), "l" + "r" * len(found)),
        ),
    )


def _rivals(diagnosis: Diagnosis) -> Iterator[Section]:
    blocks: list[Block] = []
    for number, cause in enumerate(diagnosis.causes):
        if not cause.rivals:
            continue
        if len(diagnosis.causes) > 1:
            blocks.append(Heading(capitalised(spoken(cause.effect))))
        beside = " added to the effects found before" if number else ""
        blocks += [
            Picture(
                rivals_figure(cause, diagnosis.unit),
                f"Error of the fit with each effect{beside}.",
                f"Error of the fit with {spoken(cause.effect)} and with other effects",
            ),
            Table(
                "",
                (f"effect in place of {spoken(cause.effect)}", "RMSE of the fit", "odds against it", "why"),
                tuple(_rival(rival, diagnosis.unit) for rival in sorted(cause.rivals, key=lambda r: r.odds)),
                "lrrl",
            ),
        ]
    ambiguous = diagnosis.verdict is Verdict.AMBIGUOUS
    if blocks:
        yield Section("Possible effects" if ambiguous else "Other effects, and why they are rejected", tuple(blocks))


def _rival(rival: Rival, unit: str) -> tuple[str, ...]:
    odds = "more than a million to 1" if rival.odds >= _LARGEST_ODDS else f"{rival.odds:.3g} to 1"
    return spoken(rival.effect), _number(rival.rmse, unit), odds, rival.why


def _further(diagnosis: Diagnosis) -> Iterator[Section]:
    """Yield what the record shows beside the causes: details, and effects in doubt."""
    details = [(spoken(c.effect), f"{c.sentence} The test error does not show it.") for c in diagnosis.details]
    doubts = [(spoken(name), f"probability {percent(p)}") for name, p in _sorted(diagnosis.doubts)]
    if details:
        yield Section("Details", (Facts(tuple(details)),))
    if doubts:
        yield Section("Effects in doubt", (Folded(_counted(len(doubts), "not significant"), (Facts(tuple(doubts)),)),))


def _sorted(doubts: Mapping[str, float]) -> list[tuple[str, float]]:
    return sorted(doubts.items(), key=lambda pair: -pair[1])


def _counted(count: int, what: str) -> str:
    return f"{count} effect{'s' if count > 1 else ''} {what}"


def _faults(diagnosis: Diagnosis) -> Block:
    if not diagnosis.faults:
        return _NO_FAULT
    return Items(
        tuple(
            joined(coloured("Warning.", "bad"), f" {fault.sentence}") if fault.severity == "warning" else fault.sentence
            for fault in diagnosis.faults
        )
    )


def _data(diagnosis: Diagnosis) -> Section:
    section = data_section(diagnosis.data, drawn=True)
    return replace(section, blocks=(*section.blocks, *diagnosis.shortened))


def _model(diagnosis: Diagnosis) -> Section:
    better, marked = diagnosis.is_extended, diagnosis.new_parameters
    name = capitalised(diagnosis.model.name)
    text = joined(f"{name}. New parameters are ", coloured("highlighted", "new"), ".") if marked else f"{name}."
    return Section(
        "The extended model" if better else "The model",
        (
            joined(text, " The subscript t is the sample number."),
            equations(diagnosis.model, marked),
            Table(
                "",
                _columns(diagnosis, "parameter"),
                tuple(_value(p, diagnosis, p.name in marked) for p in diagnosis.model.parameters),
                "lrr" if better else "lr",
            ),
        ),
    )


def _columns(diagnosis: Diagnosis, first: str) -> tuple[str, ...]:
    return (first, "base model", *(("extended model",) if diagnosis.is_extended else ()))


def _value(p: Parameter, diagnosis: Diagnosis, new: bool) -> tuple[str, ...]:
    value, before = diagnosis.model.values.get(p.name), diagnosis.base.values.get(p.name)
    # The box of a fixed parameter is its value.
    value = p.lower if value is None and p.lower == p.upper else value
    name = parameter(p.name, p.unit, new=new)
    cells = tuple("" if number is None else f"{number:.5g}" for number in (before, value))
    return (joined(name, " ", coloured("new", "new")) if new else name, *cells[: 1 + diagnosis.is_extended])


def _gain(diagnosis: Diagnosis) -> Section:
    g, better, unit = diagnosis.gain, diagnosis.is_extended, diagnosis.unit
    held = f"Free runs over the {g.samples} samples of the test part, which no fit and no choice has seen"
    rows = [
        ("RMSE", _number(g.rmse_before, unit), _number(g.rmse_after, unit)),
        ("fit", _number(g.fit_percent_before, "%", ".2f"), _number(g.fit_percent_after, "%", ".2f")),
        (
            "largest error (least noise bound that explains them)",
            _number(g.noise_bound_before, unit),
            _number(g.noise_bound_after, unit),
        ),
    ]
    if g.violations_before is not None:
        outside = f"samples outside {_number(diagnosis.misfit.noise_bound, unit)}"
        rows.append((outside, f"{g.violations_before} of {g.samples}", f"{g.violations_after} of {g.samples}"))
    return Section(
        "Before and after" if better else "Fit of the model",
        (
            f"{held}: the RMSE is {_fall(g.rmse_before, g.rmse_after)}." if better else f"{held}.",
            Table(
                "",
                _columns(diagnosis, "test part"),
                tuple(row if better else row[:2] for row in rows),
                "lrr" if better else "lr",
            ),
        ),
    )


def _skipped(diagnosis: Diagnosis) -> Iterator[Section]:
    rows = []
    for name, why in diagnosis.skipped.items():
        verb = "failed with " if name in diagnosis.failed else "" if why.startswith("does not") else "needs "
        rows.append((spoken(name), f"not tested: it {verb}{why}"))
    rows += [(spoken(name), "withdrawn: not needed with the later effects") for name in diagnosis.dropped]
    if rows:
        folded = Folded(_counted(len(rows), "not tested, or withdrawn"), (Facts(tuple(rows)),))
        yield Section("Effects not tested, and effects withdrawn", (folded,))


def _not_proven(diagnosis: Diagnosis) -> Section:
    named = (
        "The cause. It is the effect of the library that explains these data best; another cause remains possible."
        if diagnosis.causes
        else "That the model lacks nothing. Effects outside the library were not tested. An effect that these data do "
        "not excite is not visible in them."
    )
    model = "extended model" if diagnosis.is_extended else "model"
    elsewhere = f"The {model} outside the record: in ranges, temperatures or rates that the record does not cover."
    return Section("What this page does not prove", (Items((named, elsewhere)),))


def _number(value: float | None, unit: str, digits: str = ".4g") -> str:
    return "unknown" if value is None else f"{value:{digits}} {unit}".rstrip()


def _chance(value: float) -> str:
    return "less than 1 in 1000" if value < 1e-3 else f"{100 * value:.2g} %"


def _fall(before: float, after: float) -> str:
    """Return by how much an error has fallen."""
    if not (before > 0 and after > 0 and math.isfinite(before / after)):
        return "no change"
    share = 100 * (1 - after / before)
    return "not smaller" if share <= 0 else f"{min(share, 99):.0f} % smaller"
