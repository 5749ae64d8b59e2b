"""Verify a certificate file against a model and data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from relaxations import check
from relaxations.check import bundle, runs
from relaxations.check.read import Document, document
from relaxations.check.report import strongest
from relaxations.check.runs.read import document as document_of_run
from relaxations.check.runs.read import is_run
from relaxations.check.statement import Theorem
from smid.data import DataError, Dataset
from smid.data.window import Window, cut_all
from smid.display.from_plain import fields_from_plain, read
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.models import Model, ModelError
from smid.models.expressions import from_text
from smid.verification.implied import NotProvenError, check_implied, prior_of
from smid.verification.origin import DIGITS, data_statement, exact_samples, model_statement
from smid.verification.verify_bundle import check_bundle
from smid.verification.verify_run import check_statement, origin_of_run, statement_of

__all__ = ["NotProvenError", "Verification", "read_origin", "verify"]


@dataclass(frozen=True, eq=False, repr=False)
class Verification(Result):
    """A proof that holds, about a model and data.

    Parameters
    ----------
    origin
        The file's statement of model, noise bounds, data and software.
    equations
        Number of equalities in the proof; each is an equation of the model at a sample.
    empty
        Whether it is proven that no parameters explain the data.
    intervals
        Proven bounds, rounded outwards; infinite if there is none. Empty if no parameters explain the data.
    """

    origin: Mapping[str, Any]
    equations: int
    empty: bool
    intervals: Mapping[str, tuple[float, float]]

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Verification:
        """Return the proof that `to_dict` described. It is not checked again: `smid.verify` does."""
        pairs = read(content, "intervals", Mapping[str, tuple[float | None, float | None]])
        ends = {n: (-math.inf if a is None else a, math.inf if b is None else b) for n, (a, b) in pairs.items()}
        found: Verification = fields_from_plain(Verification, content, intervals=ends)
        return found

    def _content(self) -> Iterator[Part]:
        model, data = self.origin["model"], self.origin["data"]
        yield f"verified: the proof holds, and its {self.equations} equations are those of the model on these data"
        yield f"model: {model['name']}"
        yield from (f"  d/dt {signal} = {text}" for signal, text in model.get("rates", {}).items())
        yield from (f"  {signal}[t] = {text}" for signal, text in model["lines"].items())
        bounds = {c: float.fromhex(b) for c, b in self.origin["noise_bounds"].items()}
        yield "noise bounds: " + ", ".join(f"{channel} {bound:g}" for channel, bound in bounds.items())
        if self.origin.get("outliers"):
            yield f"outliers: at most {self.origin['outliers']} samples of each output break its noise bound"
        yield f"data: {', '.join(sorted(data['sample_digests']))}; SHA-256 {data['sha256']}"
        if self.empty:
            yield "proven: no parameters explain the data within the noise bounds"
            return
        rows = []
        for name, (low, high) in self.intervals.items():
            prior = " to ".join("no bound" if e is None else f"{float.fromhex(e):g}" for e in model["parameters"][name])
            rows.append((name, prior, f"{low:.9g}", f"{high:.9g}"))
        yield Table("", ("parameter", "prior", "proven lower", "proven upper"), tuple(rows), "lrrr")


def verify(
    proof: str | Path, data: Dataset, model: Model | None = None, noise_bound: float | Mapping[str, float] | None = None
) -> Verification:
    """Check a proof, and that it is about this model and these data.

    :mod:`relaxations.check` checks the proof. Then every equation of the proof is compared with the model's own line,
    evaluated with exact polynomials at the sample, and every box with the priors and noise bounds.

    Parameters
    ----------
    proof
        File of ``identify(certificate=...)``.
    model
        By default the model in the file.
    noise_bound
        In the channel's unit; by default the bounds in the file.

    Raises
    ------
    DataError
        If the file is not a certificate of an identification, or the data are not those of the proof. The message names
        the first channel and sample that differ.
    ModelError
        If model or noise bound are not those of the proof. The message names the difference.
    NotProvenError
        If the proof does not hold, or does not follow from the model and the data.
    TypeError
        If the arguments are in another order.

    Examples
    --------
    >>> import tempfile
    >>> from smid.identification.identify import identify
    >>> from smid.models import OutputError
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> model, file = OutputError(stable=True), Path(tempfile.mkdtemp()) / "proof.json"
    >>> estimate = identify(model, data, noise_bound=0.1, certificate=file)
    >>> verify(file, data, model).intervals["a1"] == (estimate["a1"].lower, estimate["a1"].upper)
    True
    """
    if not (isinstance(proof, str | Path) and isinstance(data, Dataset) and isinstance(model, Model | None)):
        kinds = ", ".join(type(given).__name__ for given in (proof, data, model))
        raise TypeError(f"verify was given {kinds}: give verify(proof, data, model): the file, a Dataset, a Model")
    try:
        content = check.read(proof)
        origin, of_bundle = _origin(content), bundle.is_bundle(content)
        of_run = any(map(is_run, bundle.certificates(content) if of_bundle else [content]))
        part = _proven_part(origin, data)
        _compare_data(origin["data"], part)
        if model is not None:
            own = bind(model, part)
            if own.enclosed and "rates" not in origin["model"]:
                raise NotProvenError(
                    f"{proof}: the proof is about lines of samples, and model {own.name!r} about its differential "
                    f"equation (scheme {own.scheme!r})"
                )
            _compare_models(origin["model"], statement_of(own, part) if of_run else model_statement(own))
        if noise_bound is not None:
            _compare_bounds(origin["noise_bounds"], noise_bound)
        if of_bundle:
            return _bundle_verified(content, origin, data)
        return (_run_verified if of_run else _verified)(content, origin, part)
    except check.Unreadable as error:
        raise DataError(str(error)) from None
    except check.Refused as error:
        raise NotProvenError(f"{proof}: {error}") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, DataError | ModelError | NotProvenError):
            raise
        raise DataError(f"{proof}: its origin is not in the form that smid writes ({error})") from None


def _verified(content: Any, origin: dict[str, Any], data: Dataset) -> Verification:
    found = document(content)
    samples = exact_samples(data, origin["data"]["sample_digests"])
    equations = check_implied(found, origin["model"], samples, origin["noise_bounds"])
    theorems = strongest(check.proven(found))
    empty = any(theorem.empty for theorem in theorems)
    return Verification(origin, equations, empty, {} if empty else _intervals(found, theorems, origin))


def _run_verified(content: Any, origin: dict[str, Any], data: Dataset) -> Verification:
    found = document_of_run(content)
    equations, claim = check_statement(found, data), runs.proven(found)
    intervals = {name: (_rounded(low, -1), _rounded(high, 1)) for name, (low, high) in (claim or {}).items()}
    return Verification(origin, equations, claim is None, intervals)


def _bundle_verified(content: Any, origin: dict[str, Any], data: Dataset) -> Verification:
    found = bundle.document(content)
    claim = bundle.proven(found)
    equations = check_bundle(found, origin, data)
    intervals = {name: (_rounded(low, -1), _rounded(high, 1)) for name, (low, high) in (claim.box or {}).items()}
    return Verification(origin, equations, claim.box is None, intervals)


def read_origin(proof: str | Path) -> dict[str, Any]:
    """Return a proof's statement of its model and data; DataError if there is none."""
    try:
        return _origin(check.read(proof))
    except check.Unreadable as error:
        raise DataError(str(error)) from None


def _origin(content: Any) -> dict[str, Any]:
    """Return the origin of a certificate, and what it states of the model."""
    if bundle.is_bundle(content):
        origin = bundle.document(content).origin
    elif is_run(content):
        origin = origin_of_run(document_of_run(content))
    else:
        origin = document(content).origin
    if not isinstance(origin, dict) or not {"model", "noise_bounds", "data", "software"} <= origin.keys():
        raise DataError(
            "the certificate states no model and data, so there is nothing to compare: write it with "
            "smid identify --certificate"
        )
    return origin


def _proven_part(origin: Mapping[str, Any], data: Dataset) -> Dataset:
    """Return the windows that the proof is about, or the whole record."""
    windows = [Window.from_dict(told) for told in origin.get("windows", ())]
    for w in windows:
        if not (
            0 <= w.experiment < len(data.experiments)
            and 0 <= w.first <= w.last < data.experiments[w.experiment].n_samples
        ):
            raise DataError(
                f"the proof is about samples {w.first} to {w.last} of experiment {w.experiment}, which the data lack: "
                "give the whole record that was identified"
            )
    return cut_all(data, windows) if windows else data


def _compare_data(stated: Mapping[str, Any], data: Dataset) -> None:
    """Raise an error that names the first sample that differs from the proof."""
    channels = tuple(stated["sample_digests"])
    missing = [c for c in channels if c not in data.names]
    if missing:
        raise DataError(f"the data have no channel {missing[0]!r}, which the proof is about")
    lengths = [(run.name, run.n_samples) for run in data.experiments]
    wanted = [(run["name"], run["samples"]) for run in stated["experiments"]]
    if [n for _, n in lengths] != [n for _, n in wanted]:
        have, need = (" + ".join(str(n) for _, n in runs) for runs in (lengths, wanted))
        raise DataError(f"the data have {have} samples, the proof is about {need} ({stated['source']})")
    own = data_statement(data, channels)
    for name in channels:
        pairs = zip(own["sample_digests"][name], stated["sample_digests"][name], strict=True)
        for (run, count), (left, right) in zip(lengths, pairs, strict=True):
            places = (slice(DIGITS * k, DIGITS * (k + 1)) for k in range(count))
            first = next((k for k, place in enumerate(places) if left[place] != right[place]), None)
            if first is not None:
                inside = f" of experiment {run!r}" if len(lengths) > 1 else ""
                raise DataError(
                    f"the data are not those of the proof: channel {name!r} differs first at sample {first}{inside}"
                )
    if own["sampling_time"] != stated["sampling_time"]:
        both = (float.fromhex(own["sampling_time"]), float.fromhex(stated["sampling_time"]))
        raise DataError("the sampling time is {:g} s, the proof is about {:g} s".format(*both))
    if own["sha256"] != stated["sha256"]:
        raise DataError("the data are not those of the proof: the SHA-256 differs")


def _compare_models(stated: Mapping[str, Any], own: Mapping[str, Any]) -> None:
    """Raise an error that names the first part of the model that differs from the proof."""
    for kind, key in (
        ("parameter", "parameters"),
        ("rate of", "rates"),
        ("line", "lines"),
        ("bounds of", "bounds"),
    ):
        before, now = (of.get(key, {}) for of in (stated, own))  # not every model has rates, or bounds
        for name in dict.fromkeys((*before, *now)):
            left, right = before.get(name), now.get(name)
            same = _same_text(left, right) if key in ("rates", "lines") else left == right
            if not same:
                raise ModelError(
                    f"the {kind} {name!r} of the model is not that of the proof: {_shown(right)}, not {_shown(left)}"
                )
    if stated.get("interval") != own.get("interval"):
        raise ModelError("the time between two samples of the model is not that of the proof")
    for kind, key in (("measurement", "measurements"), ("constraint", "constraints")):
        left, right = stated[key], own[key]
        same = left == right or (key == "constraints" and len(left) == len(right) and all(map(_same_text, left, right)))
        if not same:
            raise ModelError(
                f"the {kind}s of the model are not those of the proof: {_shown(right)}, not {_shown(left)}"
            )


def _same_text(left: str | None, right: str | None) -> bool:
    if left is None or right is None:
        return False
    return left == right or from_text(left) == from_text(right)


def _shown(value: Any) -> str:
    """Return a box, or a text, for a message."""
    if (
        isinstance(value, list)
        and len(value) == 2
        and all(e is None or str(e).lstrip("-").startswith("0x") for e in value)
    ):
        return " to ".join("no bound" if e is None else repr(float.fromhex(e)) for e in value)
    return "none" if value is None else str(value)


def _compare_bounds(stated: Mapping[str, str], given: float | Mapping[str, float]) -> None:
    for channel, text in stated.items():
        own = given.get(channel) if isinstance(given, Mapping) else given
        if own is None or float(own) != float.fromhex(text):
            raise ModelError(f"the noise bound of {channel!r} is {own}, the proof is about {float.fromhex(text)}")


def _intervals(found: Document, theorems: list[Theorem], origin: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Return the box of each parameter, narrowed by the theorems."""
    intervals = {}
    for name in origin["model"]["parameters"]:
        if name not in found.stated.names:  # the certificate is about outputs that do not share it
            low, high = prior_of(origin["model"]["parameters"][name])
            intervals[name] = (float(low), float(high))
            continue
        v = found.stated.names.index(name)
        low, high = found.box[v]
        for theorem in theorems:
            if theorem.single is not None and theorem.single[0] == v:
                slope = theorem.single[1]
                end = theorem.bound / slope
                low, high = (max(low, end), high) if slope > 0 else (low, min(high, end))
        intervals[name] = (_rounded(low, -1), _rounded(high, 1))
    return intervals


def _rounded(value: Fraction | float, side: int) -> float:
    """Return the nearest float that is not inside."""
    nearest = float(value)
    inside = nearest > value if side < 0 else nearest < value
    return math.nextafter(nearest, side * math.inf) if inside else nearest
