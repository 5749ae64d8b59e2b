"""Score of the diagnosis over blind cases, as Markdown.

The yardstick of a test error is the true model's: the rms of recorded minus predictable output over the last 20 %
of the record. It contains what no model can foresee: the noise, the rounding (quantisation), the glitches (outliers;
the diagnosis counts them in its test error as well) and what the input's noise did to the output (input_noise).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.blind.kept import SECONDS

__all__ = ["BINS", "CaseResult", "markdown"]

BINS = ((0.0, 0.2), (0.2, 0.5), (0.5, 0.8), (0.8, 0.95), (0.95, 0.99), (0.99, 1.01))
"""Of probabilities, to compare with how often what has them is right."""

TARGETS = "| asked for | 98 % | at most 1 % | 90 % | 70 % | at most 1.05 | at most 1.2 |"


@dataclass(frozen=True)
class CaseResult:
    """What became of one case.

    Attributes
    ----------
    kind : {"single", "none", "none, bound withheld", "pair", "triple"}
        How many effects were hidden, and whether the noise bound was given.
    seed : int
        Seed of the case.
    truth, named : tuple of str
        Hidden and named effects, the latter in the order found.
    verdict : str
        "named", "none", "ambiguous", or "failed" with the error in `message`.
    rivals : tuple of str
        Rivals of the first cause.
    ratio : float
        Test error over the yardstick; NaN when the diagnosis failed.
    strength : float
        Of the effect.
    plant, signal : str
        Of the case.
    seconds : float
        Processor time of the diagnosis.
    message : str
        Error text.
    probabilities : tuple of float
        Of what is named, in the same order.
    doubts : tuple of (str, float)
        What was weighed and not named, with its probability.
    in_other_words : int
        How many of the hidden effects in `named` the diagnosis gives as a second name of one equation.
    interrupted : bool
        Whether the time allowed ended the search.
    """

    kind: str
    seed: int
    truth: tuple[str, ...]
    named: tuple[str, ...]
    verdict: str
    rivals: tuple[str, ...]
    ratio: float
    strength: float
    plant: str
    signal: str
    seconds: float
    message: str = ""
    probabilities: tuple[float, ...] = ()
    doubts: tuple[tuple[str, float], ...] = ()
    in_other_words: int = 0
    interrupted: bool = False

    @property
    def weighed(self) -> list[tuple[float, bool]]:
        """Probability of each effect named or in doubt, and whether the effect is there."""
        pairs = [*zip(self.named, self.probabilities, strict=False), *self.doubts]
        return [(p, name in self.truth) for name, p in pairs]

    @property
    def is_right(self) -> bool:
        """Single: named first. None: nothing named. Pair and triple: all named."""
        if self.verdict == "failed":
            return False
        if self.kind.startswith("none"):
            return self.verdict != "named"
        if self.verdict != "named":
            return False
        if self.kind == "single":
            return self.named[:1] == self.truth
        return set(self.truth) <= set(self.named)

    @property
    def further(self) -> tuple[str, ...]:
        """What is named and not there."""
        return tuple(name for name in self.named if name not in self.truth)

    @property
    def answer(self) -> str:
        """First name, or the verdict where nothing is named."""
        return self.named[0] if self.verdict == "named" and self.named else self.verdict


def _of(results: Sequence[CaseResult], kind: str) -> list[CaseResult]:
    return [result for result in results if result.kind == kind]


def _share(results: Sequence[CaseResult], right: bool = True) -> str:
    if not results:
        return "-"
    count = sum(result.is_right == right for result in results)
    return f"{100 * count / len(results):.1f} % ({count} of {len(results)})"


def _ratios(results: Sequence[CaseResult]) -> tuple[str, str]:
    ratios = [result.ratio for result in results if np.isfinite(result.ratio)]
    if not ratios:
        return "-", "-"
    return f"{np.median(ratios):.3f}", f"{np.quantile(ratios, 0.9):.3f}"


def confusion(results: Sequence[CaseResult]) -> str:
    """Give the table of hidden effects against first names of the single cases.

    Parameters
    ----------
    results : sequence of CaseResult
        Of any kind; cases without effect make the row "nothing".

    Returns
    -------
    str
        A Markdown table with a row per hidden effect and columns that are counts.
    """
    rows: dict[str, Counter[str]] = {}
    for result in (*_of(results, "single"), *_of(results, "none")):
        rows.setdefault(result.truth[0] if result.truth else "nothing", Counter())[result.answer] += 1
    lines = ["| hidden | right | named instead |", "|---|---|---|"]
    for hidden, counts in sorted(rows.items()):
        right = counts[hidden] if hidden != "nothing" else counts["none"] + counts["ambiguous"]
        own = {hidden} if hidden != "nothing" else {"none", "ambiguous"}
        wrong = ", ".join(f"{name} {count}" for name, count in counts.most_common() if name not in own)
        lines.append(f"| {hidden} | {right} / {sum(counts.values())} | {wrong or '-'} |")
    return "\n".join(lines)


def markdown(results: Sequence[CaseResult]) -> str:
    """Give the whole page.

    Parameters
    ----------
    results : sequence of CaseResult
        Of any kind, in any order.

    Returns
    -------
    str
        Markdown with shares, ratios, confusion and the failures by seed.

    Examples
    --------
    >>> one = CaseResult("single", 3, ("gain",), ("gain",), "named", (), 1.02, 5.0, "cstr", "steps", 2.0)
    >>> "100.0 % (1 of 1)" in markdown([one])
    True
    """
    results = sorted(results, key=lambda result: (result.kind, result.seed))
    single, none, pair, triple = (_of(results, kind) for kind in ("single", "none", "pair", "triple"))
    withheld = _of(results, "none, bound withheld")
    median, worst = _ratios([*single, *pair, *triple])
    seconds = [result.seconds for result in results]
    parts = [
        "# Diagnosis of blind cases",
        "Each case hides an effect in simulated data. `smid.diagnose` gets the base model, the record and the noise "
        "bound. `python -m benchmarks.blind` generates the cases and writes this page.",
        "| | named first | false alarms | both of two named | all of three named | test error / true model's: median "
        "| worst tenth |\n"
        "|---|---|---|---|---|---|---|\n"
        f"{TARGETS}\n"
        f"| reached | {_share(single)} | {_share(none, right=False)} | {_share(pair)} | {_share(triple)} "
        f"| {median} | {worst} |",
        f"A further cause that is not there (asked for: at most 3 %): {_further([*single, *pair, *triple])}. "
        f"{_calibration(results)}",
        "![Share of the effects that are there, by the probability that they are given](pictures/calibration.svg)",
        f"False alarms without a noise bound: {_share(withheld, right=False)}. "
        f"Verdict `ambiguous`: {sum(result.verdict == 'ambiguous' for result in results)} of {len(results)}. "
        f"Right names that are given as a second name of one equation: {sum(r.in_other_words for r in results)}. "
        f"Processor time of a diagnosis: median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s. Each was "
        f"allowed {SECONDS:g} s, of which the search has four fifths; this ended "
        f"{sum(result.interrupted for result in results)} of {len(results)}. Asked for are 15 s and 90 s on two cores.",
        "## Hidden against named first",
        confusion(results),
        "## Test error by kind",
        "| kind | cases | median | worst tenth |\n|---|---|---|---|\n"
        + "\n".join(
            f"| {kind} | {len(some)} | {' | '.join(_ratios(some))} |"
            for kind, some in (("single", single), ("pair", pair), ("triple", triple), ("none", [*none, *withheld]))
        ),
        "## Failures",
        _failures(results),
    ]
    return "\n\n".join(parts) + "\n"


def _further(results: Sequence[CaseResult]) -> str:
    """Say in how many cases more is named than is there, beside a right name."""
    right = [r for r in results if r.verdict == "named" and set(r.named) & set(r.truth)]
    count = sum(bool(r.further) for r in right)
    return f"{100 * count / len(right):.1f} % ({count} of {len(right)})" if right else "-"


def _calibration(results: Sequence[CaseResult]) -> str:
    """Say how many causes are right, by the probability that they are given."""
    pairs = [pair for r in results for pair in r.weighed]
    parts = []
    for low, high in BINS:
        hits = [right for p, right in pairs if low <= p < high]
        if hits:
            said = f"{low:.0%} to {min(high, 1.0):.0%}"
            parts.append(f"{sum(hits)} of {len(hits)} given {said}")
    return f"Causes that are right: {'; '.join(parts) or '-'}."


def _failures(results: Sequence[CaseResult]) -> str:
    wrong = [result for result in results if not result.is_right]
    if not wrong:
        return "None."
    lines = [
        "| kind | seed | hidden | named | verdict | strength | plant | signal |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for result in wrong:
        verdict = f"failed: {result.message}" if result.verdict == "failed" else result.verdict
        if result.verdict == "ambiguous":
            verdict += f" with {', '.join(result.rivals)}" if result.rivals else ""
        lines.append(
            f"| {result.kind} | {result.seed} | {', '.join(result.truth) or '-'} "
            f"| {', '.join(result.named) or '-'} | {verdict} | {result.strength:.1f} "
            f"| {result.plant} | {result.signal} |"
        )
    return "\n".join(lines)
