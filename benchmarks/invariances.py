"""Whether a diagnosis depends on names, orders, units or the processor: ``python -m benchmarks.invariances``.

A blind case with one effect, its record cut in two experiments, is diagnosed as it is and then

- with other names of channels, parameters and signals,
- with its channels in the opposite order,
- with its experiments in the opposite order,
- in other units: the output times 1000, the input times 0.01, time in milliseconds,
- by another kernel of OpenBLAS (``OPENBLAS_CORETYPE``).

The causes have to be the same, in the same order, and the test error within 1 %. Each result is kept in the cache, so
an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import sympy

from benchmarks.blind.cases import draw
from benchmarks.kernels import OLDER, with_kernel
from benchmarks.resumable import kept, run
from smid import Dataset, Model, diagnose
from smid.models import signal
from smid.models.edit_lines import rename_channels
from smid.models.symbols import rename_signals, swapped, t

VARIANTS = ("as it is", "names", "order of channels", "order of experiments", "units", "kernel")
OUTPUT, INPUT, TIME = 1000, sympy.Rational(1, 100), 1000
CLOSE = 0.01


@dataclass(frozen=True)
class VariantResult:
    """What became of one case in one variant; the test error is in the unit of the case."""

    seed: int
    variant: str
    truth: tuple[str, ...]
    named: tuple[str, ...]
    rmse: float
    seconds: float


def diagnose_variant(seed: int, variant: str) -> VariantResult:
    """Draw a case and diagnose a variant of it."""
    if variant == "kernel":
        return replace(with_kernel(OLDER, diagnose_variant, seed, VARIANTS[0]), variant=variant)
    case = draw(seed, 1, 1000)
    model, data, bound, scale = case.model, in_two(case.data), case.noise_bound, 1.0
    if variant == "names":
        model, data = renamed(model, data)
    elif variant == "order of channels":
        data = reordered(data)
    elif variant == "order of experiments":
        data = data.with_experiments(data.experiments[::-1])
    elif variant == "units":
        model, data, bound, scale = in_other_units(model, data), scaled(data), bound * OUTPUT, float(OUTPUT)
    began = time.perf_counter()
    found = diagnose(model, data, bound, certify=False, workers=1)
    named = tuple(cause.effect for cause in found.causes)
    return VariantResult(seed, variant, case.truth, named, found.gain.rmse_after / scale, time.perf_counter() - began)


def in_two(data: Dataset) -> Dataset:
    """Cut a record in two experiments."""
    first, second = (part.experiments[0] for part in data.split(0.5))
    return data.with_experiments((replace(first, name="first"), replace(second, name="second")))


def renamed(model: Model, data: Dataset) -> tuple[Model, Dataset]:
    """Give channels, parameters and signals names that tell nothing."""
    channels = {name: f"q{k}" for k, name in enumerate(data.names)}
    model = rename_channels(model, {name: new for name, new in channels.items() if name in model.channels})
    parameters = {p.name: f"p{k}" for k, p in enumerate(model.parameters)}
    symbols = {sympy.Symbol(old, real=True): sympy.Symbol(new, real=True) for old, new in parameters.items()}
    inner = [line.signal for line in model.lines if line.signal not in channels.values()]
    signals = {name: f"s{k}" for k, name in enumerate(inner)}
    lines = tuple(
        replace(
            line,
            target=signal(signals.get(line.signal, line.signal))[t],
            expression=rename_signals(swapped(line.expression, symbols), signals),
        )
        for line in model.lines
    )
    other = replace(
        model,
        parameters=tuple(replace(p, name=parameters[p.name]) for p in model.parameters),
        lines=lines,
        measurements=tuple(replace(m, signal=signals.get(m.signal, m.signal)) for m in model.measurements),
        constraints=tuple(swapped(constraint, symbols) for constraint in model.constraints),
        values={parameters[name]: value for name, value in model.values.items()},
    )
    return other, data.rename(channels)


def reordered(data: Dataset) -> Dataset:
    """Turn the order of the channels round."""
    runs = tuple(replace(run, values=dict(reversed(run.values.items()))) for run in data.experiments)
    return replace(
        data, experiments=runs, channels=data.channels[::-1], inputs=data.inputs[::-1], outputs=data.outputs[::-1]
    )


def scaled(data: Dataset) -> Dataset:
    """Take the record in other units."""
    factors = {**dict.fromkeys(data.outputs, float(OUTPUT)), **dict.fromkeys(data.inputs, float(INPUT))}
    runs = tuple(
        replace(run, values={name: factors.get(name, 1.0) * x for name, x in run.values.items()})
        for run in data.experiments
    )
    return replace(data, experiments=runs, sampling_time=data.sampling_time * TIME)


def in_other_units(model: Model, data: Dataset) -> Model:
    """Return the model of the scaled record, with the parameters that it had."""
    reads = {
        signal(name)[t - lag]: signal(name)[t - lag] / INPUT
        for line in model.lines
        for name, lag in line.reads
        if name in data.inputs
    }
    lines = tuple(
        replace(line, expression=swapped(line.expression, reads) / (TIME if line.rate else 1)) for line in model.lines
    )
    shown = model.measurements[0].signal
    seen = type(lines[0])(signal("shown")[t], OUTPUT * signal(shown)[t])
    measurements = (replace(model.measurements[0], signal="shown"), *model.measurements[1:])
    interval = None if model.sampling_time is None else model.sampling_time * TIME
    return replace(model, lines=(*lines, seen), measurements=measurements, sampling_time=interval)


def page(results: list[VariantResult]) -> str:
    """Return the table, and what differs, as Markdown."""
    plain = {r.seed: r for r in results if r.variant == VARIANTS[0]}
    lines = [
        "# Invariance of the diagnosis",
        "",
        "`python -m benchmarks.invariances` diagnoses blind cases as they are and otherwise, and writes this.",
        "",
        "| variant | cases | same causes | and test error within 1 % |",
        "|---|---|---|---|",
    ]
    differing = []
    for variant in VARIANTS[1:]:
        pairs = [(plain[r.seed], r) for r in results if r.variant == variant and r.seed in plain]
        same = [(a, b) for a, b in pairs if a.named == b.named]
        close = [(a, b) for a, b in same if abs(b.rmse / a.rmse - 1) <= CLOSE]
        lines.append(f"| {variant} | {len(pairs)} | {len(same)} | {len(close)} |")
        differing += [(a, b) for a, b in pairs if (a, b) not in close]
    lines += ["", "Cases that differ:", ""] if differing else ["", "No case differs."]
    lines += [
        f"- Seed {a.seed}, hidden {', '.join(a.truth)}, {b.variant}: {', '.join(b.named) or 'nothing'} ({b.rmse:.4g}) "
        f"instead of {', '.join(a.named) or 'nothing'} ({a.rmse:.4g})."
        for a, b in differing
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Read the arguments, run what is not in the cache, and write the page."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.invariances", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--seeds", type=int, default=20, help="number of cases")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, default=Path("docs/invariances.md"))
    parser.add_argument("--cache", type=Path, default=Path(".cache/invariances.jsonl"))
    given = parser.parse_args()
    wanted = list(product(range(given.first, given.first + given.seeds), VARIANTS))
    entries = [{**e, "truth": tuple(e["truth"]), "named": tuple(e["named"])} for e in kept(given.cache)]
    results = [r for r in (VariantResult(**e) for e in entries) if (r.seed, r.variant) in wanted]
    missing = [key for key in wanted if key not in {(r.seed, r.variant) for r in results}]
    for result in run(given.cache, diagnose_variant, missing, given.workers):
        results.append(result)
        print(f"{len(results)}/{len(wanted)} {result}", flush=True)
    text = page(sorted(results, key=lambda r: (r.seed, r.variant)))
    given.output.write_text(text, encoding="utf-8")
    print(f"\n{text}", flush=True)


if __name__ == "__main__":
    main()
