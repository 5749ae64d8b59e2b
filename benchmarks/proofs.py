"""Prove the names of blind cases with a known noise bound: ``python -m benchmarks.proofs``.

A proof uses all cores: nothing else ought to run. Each result is appended to the cache as soon as it is there, so a
run that was interrupted goes on where it stopped. Diagnoses are kept in a folder, that of `benchmarks.blind`, so that
proofs need no second search. Delete the cache when the proofs have changed, and the folder when the diagnosis has.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.blind.cases import draw
from benchmarks.blind.kept import diagnosed
from benchmarks.resumable import kept, run

__all__ = ["ProofResult", "markdown", "prove_case"]

NONE = "-"


@dataclass(frozen=True)
class ProofResult:
    """What was proven of one case.

    Attributes
    ----------
    seed : int
    truth, named : list of str
        Hidden and named effects.
    base, extended : str
        What is proven of these models; "-" where there is none.
    rivals : dict of str to str
        The same for each rival of the first cause.
    reasons : dict of str to str
        By model that is undecided or not posable: why.
    first, last : int
        The samples of the proofs.
    search, proof : float
        Seconds of the diagnosis and of the proof.
    message : str
        Error text, where one was raised.
    """

    seed: int
    truth: list[str]
    named: list[str]
    base: str
    extended: str
    rivals: dict[str, str]
    reasons: dict[str, str]
    first: int
    last: int
    search: float
    proof: float
    message: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether the base model is excluded and the extended model verified, on the same samples."""
        return (self.base, self.extended) == ("excluded", "feasible")


def prove_case(seed: int, samples: int, seconds: float, diagnoses: Path) -> ProofResult:
    """Draw a case with one hidden effect, diagnose it in this process unless that is done, and prove the name."""
    from smid.diagnosis import prove_name  # here, so that reading results does not need the diagnosis

    case = draw(seed, 1, samples)
    truth = list(case.truth)
    try:
        found = diagnosed(case, "single", diagnoses)
        proof = prove_name(found, case.noise_bound, seconds).name_proof
    except Exception as error:  # one broken case must not end the run; it counts as a failure
        message = f"{type(error).__name__}: {error}".replace("\n", " ").replace("|", "/")[:300]
        return ProofResult(seed, truth, [], NONE, NONE, {}, {}, 0, 0, 0.0, 0.0, message)
    assert proof is not None
    named = {"base model": proof.base, **({"extended model": proof.extended} if proof.extended else {}), **proof.rivals}
    reasons = {name: one.reason.replace("|", "/") for name, one in named.items() if one.reason}
    return ProofResult(
        seed,
        truth,
        list(proof.causes),
        str(proof.base.status),
        str(proof.extended.status) if proof.extended else NONE,
        {name: str(one.status) for name, one in proof.rivals.items()},
        reasons,
        proof.first,
        proof.last,
        found.seconds,
        proof.seconds,
    )


def markdown(results: Sequence[ProofResult], seconds: float) -> str:
    """Give the whole page.

    Examples
    --------
    >>> one = ProofResult(3, ["gain"], ["gain"], "excluded", "feasible", {"lag": "excluded"}, {}, 0, 39, 9.0, 1.0)
    >>> "| base model excluded | 1 of 1 |" in markdown([one], 60)
    True
    """
    results = sorted(results, key=lambda result: result.seed)
    done = [r for r in results if not r.message]
    named = [r for r in done if r.named]
    rivals = Counter(status for r in done for status in r.rivals.values())
    posed = sum(rivals.values()) - rivals["not posable"]
    times = [r.proof for r in done] or [np.nan]
    wrong = [f"seed {r.seed} ({name})" for r in done for name in _contradicted(r)]
    rows = {
        "base model excluded": f"{sum(r.base == 'excluded' for r in done)} of {len(results)}",
        "extended model verified feasible, of the cases with a cause": _of(named, "feasible"),
        "extended model excluded": _of(named, "excluded"),
        "both: base model excluded and extended model feasible": f"{sum(r.is_whole for r in named)} of {len(named)}",
        "rivals excluded by proof, of those that can be posed": f"{rivals['excluded']} of {posed}",
        "rivals proven feasible on these samples": f"{rivals['feasible']} of {posed}",
        "rivals undecided": f"{rivals['undecided']} of {posed}",
        "rivals that cannot be posed": f"{rivals['not posable']} of {sum(rivals.values())}",
        "seconds of the proof: median, longest": f"{np.median(times):.1f}, {max(times):.1f}",
        "seconds of the diagnosis before it: median": f"{np.median([r.search for r in done] or [np.nan]):.1f}",
    }
    counted = "| | |\n|---|---|\n" + "\n".join(f"| {what} | {count} |" for what, count in rows.items())
    reasons = Counter(_short(reason) for r in done for reason in r.reasons.values())
    return (
        "\n\n".join(
            [
                "# Proofs of the name",
                "Each case hides one effect in simulated data, and the noise bound is known. "
                "`smid.diagnosis.prove_name` tries to prove three statements about the same samples: the base model "
                "cannot explain them, the extended model can, the rivals of the first cause cannot. It has "
                f"{seconds:g} s a case, with a process for each core. `python -m benchmarks.proofs` writes this page.",
                f"Cases: {len(results)} (seeds {results[0].seed} to {results[-1].seed})." if results else "No cases.",
                counted,
                "A model with the hidden effect that was excluded: "
                + (", ".join(wrong) or "none")
                + ". The extensions are discretised at the sampling time, and the data are simulated in finer steps, "
                "so that such a proof need not be wrong.",
                "## Why models are undecided, or cannot be posed",
                "| models | why |\n|---|---|\n" + "\n".join(f"| {n} | {why} |" for why, n in reasons.most_common()),
                "## Cases",
                "| seed | hidden | named | base model | extended model | rivals excluded | feasible | undecided "
                "| not posable | samples | s |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
                + "\n".join(map(_row, results)),
                "## Cases where base model and extended model are not both decided",
                "\n".join(_failures(results)) or "None.",
            ]
        )
        + "\n"
    )


def _of(results: Sequence[ProofResult], status: str) -> str:
    return f"{sum(r.extended == status for r in results)} of {len(results)}"


def _contradicted(result: ProofResult) -> list[str]:
    """Return the models with exactly the hidden effect that were excluded."""
    models = {tuple(result.named): result.extended}
    models |= {(name, *result.named[1:]): status for name, status in result.rivals.items()}
    return [
        ", ".join(names) for names, status in models.items() if list(names) == result.truth and status == "excluded"
    ]


def _short(reason: str) -> str:
    """Return a reason without the names of the model."""
    kinds: Mapping[str, str] = {
        "not a polynomial": "a line is not a polynomial in parameters, noises and samples",
        "not a fraction": "a line holds an irrational constant",
        "arbitrarily large": "a hidden signal inside Max, Min or Abs has no bound",
        "raised to a power": "Max, Min, Abs or sign are raised to a power, or multiply too many unknowns",
        "no finite box": "no finite box could be proven for the parameters",
        "time": "the time was used up",
    }
    return next((text for part, text in kinds.items() if part in reason), reason)


def _row(r: ProofResult) -> str:
    counts = Counter(r.rivals.values())
    rivals = " | ".join(str(counts[status]) for status in ("excluded", "feasible", "undecided", "not posable"))
    hidden, named = ", ".join(r.truth), ", ".join(r.named) or NONE
    models = f"{r.base} | {r.extended} | {rivals}"
    return f"| {r.seed} | {hidden} | {named} | {models} | {r.first} to {r.last} | {r.proof:.1f} |"


def _failures(results: Sequence[ProofResult]) -> list[str]:
    lines = []
    for r in (r for r in results if not r.is_whole):
        why = [f"{name}: {_short(r.reasons[name])}" for name in ("base model", "extended model") if name in r.reasons]
        lines.append(
            f"- seed {r.seed}, {', '.join(r.truth)}: "
            + (r.message or f"base model {r.base}, extended model {r.extended}" + "".join(f"; {one}" for one in why))
        )
    return lines


def main() -> None:
    """Read the arguments, run what is not in the cache, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proofs", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40, help="number of cases")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--step", type=int, default=2, help="2: the cases of `benchmarks.blind` with one effect")
    parser.add_argument("--workers", type=int, default=1, help="cases side by side, which contend for the cores")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=60.0, help="allowed for the proof of a case")
    parser.add_argument("--output", type=Path, default=Path("docs/proofs.md"))
    parser.add_argument("--cache", type=Path, default=Path(".cache/proofs.jsonl"))
    parser.add_argument("--diagnoses", type=Path, default=Path(".cache/diagnoses"))
    given = parser.parse_args()
    given.diagnoses.mkdir(parents=True, exist_ok=True)

    also = {"samples": given.samples, "allowed": given.seconds}
    known: dict[int, ProofResult] = {}
    for entry in kept(given.cache):
        if {name: entry.pop(name) for name in also} == also:
            known[entry["seed"]] = ProofResult(**entry)
    wanted = range(given.first, given.first + given.step * given.seeds, given.step)
    results = [known[seed] for seed in wanted if seed in known]
    missing = [(seed, given.samples, given.seconds, given.diagnoses) for seed in wanted if seed not in known]
    for result in run(given.cache, prove_case, missing, given.workers, also):
        results.append(result)
        print(f"{len(results)}/{len(wanted)} {_row(result)} {result.message}", flush=True)
    page = markdown(results, given.seconds)
    given.output.write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
