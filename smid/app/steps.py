"""The steps of the page as Python: each is a function from the fields of its form to the code that does it.

The code that a step shows is the code that runs. So a step cannot do what it does not show.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from math import isfinite
from typing import Any

from smid.app.model_forms import BUILT_IN, asked_model
from smid.data import DataError
from smid.models import ModelError
from smid.models.parts import plain_name

__all__ = ["FILES", "PRODUCED", "STEPS", "code_of"]

Fields = Mapping[str, str]

STEPS = ("data", "channels", "model", "least", "intervals", "misfit", "cause")
"""A step that runs again takes back what it and the steps below it have found."""

PRODUCED: Mapping[str, tuple[str, ...]] = {
    "data": ("overview",),
    "channels": ("record", "train", "test"),
    "model": ("model",),
    "least": ("least",),
    "intervals": ("estimate",),
    "misfit": ("fitted", "run", "tested"),
    "cause": ("diagnosis",),
}
"""Step -> the names that it defines."""

FILES: Mapping[str, Mapping[str, str]] = {
    "intervals": {
        "intervals.html": "Report",
        "model.toml": "Model",
        "proof.json": "Proof",
        "intervals.json": "Results (JSON)",
    },
    "misfit": {"report.html": "Report with validation", "residuals.html": "Report on the residuals"},
    "cause": {
        "diagnosis.html": "Report",
        "extended.toml": "Extended model",
        "diagnosis.json": "Results (JSON)",
    },
}
"""Step -> file that it may write -> what it is."""

_LONGEST = 100


class _Code(str):
    """A piece of code; any other value is written as its ``repr``."""


def code_of(step: str, fields: Fields, known: Collection[str] = ()) -> str:
    """Return the Python code of a step.

    Parameters
    ----------
    fields
        Of all forms of the page, by name. An empty field counts as not given.
    known
        The names that earlier steps defined.

    Raises
    ------
    DataError, ModelError
        If a field is missing or does not make sense.

    Examples
    --------
    >>> print(code_of("data", {"file": "run.csv", "missing": "-9999"}))
    import smid
    <BLANKLINE>
    overview = smid.data.show("run.csv", missing=["-9999"])
    print(overview)
    """
    needed = {"channels": "overview", "model": "record"}.get(step, "" if step == "data" else "model")
    if needed and needed not in known:
        earlier = next(name for name, made in PRODUCED.items() if needed in made)
        raise DataError(f"the step {step!r} needs the step {earlier!r}: run that one first")
    # The empty bound of one of several channels tells that there are several.
    given = {name: value.strip() for name, value in fields.items() if value.strip() or name.startswith("bound:")}
    return _CODE[step](given, known)


def _data(given: Fields, _: Collection[str]) -> str:
    imports = "import smid\n" + ("from smid.data.bundled import record_path\n" if "bundled" in given else "")
    return f"{imports}\n{_call('overview = smid.data.show', _path(given), **_reading(given))}\nprint(overview)"


def _roles(given: Fields) -> dict[str, list[str]]:
    """Return the channels of the record by their role."""
    roles: dict[str, list[str]] = {"input": [], "output": [], "further": []}
    for name, value in given.items():
        if name.startswith("role:") and value in roles:
            roles[value].append(name.removeprefix("role:"))
    return roles


def _channels(given: Fields, _: Collection[str]) -> str:
    roles = _roles(given)
    if not roles["output"]:
        raise DataError("no channel is an output: choose one in the table")
    path = _path(given)
    lines = [
        _call(
            "record = smid.Dataset.from_file",
            path,
            input=roles["input"],
            output=roles["output"],
            others=roles["further"],
            **_reading(given),
        ),
    ]
    names = {name: plain_name(name) for role in roles.values() for name in role if plain_name(name) != name}
    if names:
        lines.append(f"{_call('record = record.rename', names)}  # names that equations can hold")
    parts = [
        _crop(_whole(given, f"{part}_start", 0), _whole(given, f"{part}_stop", None)) for part in ("train", "test")
    ]
    lines += [f"train, test = {', '.join(parts)}", "print(record)"]
    return "\n".join(lines)


def _model(given: Fields, _: Collection[str]) -> str:
    if given.get("class", "file") not in BUILT_IN:
        if "toml" not in given:
            raise ModelError("the model has no text: write a model file, or choose a built-in model")
        lines = [
            "from pathlib import Path\n",
            f'Path("given.toml").write_text({_long(given["toml"])}, encoding="utf-8")',
            'model = smid.bind(smid.load_model("given.toml"), record)',
            "print(model)",
        ]
        return "\n".join(lines)
    roles = _roles(given)
    channels = {role: [plain_name(name) for name in roles[role]] for role in ("input", "output") if roles[role]}
    made = _call(f"smid.{given['class']}", **asked_model(given["class"], given, channels))
    return f"{_call('model = smid.bind', _Code(made), _Code('record'))}\nprint(model)"


def _least(given: Fields, _: Collection[str]) -> str:
    others = _bounds(given)
    known = (others,) if others and _n_noisy(given) > 1 else ()
    return f"{_call('least = smid.error_bound', _MODEL, _TRAIN, *known, **_work(given, 'intervals'))}\nprint(least)"


def _intervals(given: Fields, _: Collection[str]) -> str:
    settings: dict[str, Any] = {}
    if "tolerance" in given:
        settings["tolerance"] = _number(given, "tolerance")
    if "certificate" in given:
        settings["certificate"] = "proof.json"
    bound = _stated(given)
    if bound is None:
        raise DataError("the noise bound is missing: give the largest error of a sample, from the sensor's data sheet")
    found = _call(
        "estimate = smid.identify", _MODEL, _TRAIN, noise_bound=bound, **settings, **_work(given, "intervals")
    )
    return "\n".join(
        [
            found,
            "print(estimate)",
            'smid.report(estimate, "intervals.html")',
            'smid.report(estimate, "intervals.json")',
            'smid.save_model(estimate.model, "model.toml")',
        ]
    )


def _misfit(given: Fields, known: Collection[str]) -> str:
    bound = _stated(given)
    bounds = {} if bound is None else {"noise_bound": bound}
    found = _Code("estimate" if "estimate" in known else "fitted")
    lines = [] if found == "estimate" else ["fitted = smid.fit(model, train)  # no intervals: a fit by least squares"]
    lines += [_call("run = smid.validate", found, _Code("test"), **bounds), "print(run)"]
    if found == "estimate":
        lines.append('smid.report(estimate, "report.html", validations=[run])')
    lines += [f"tested = smid.residuals({found}, test)", "print(tested)", 'smid.report(tested, "residuals.html")']
    return "\n".join(lines)


def _cause(given: Fields, _: Collection[str]) -> str:
    # A diagnosis explains outputs: the noise of an input is no bound of theirs.
    outputs = {f"bound:{plain_name(k.removeprefix('role:'))}" for k, role in given.items() if role == "output"}
    bound = _stated({k: value for k, value in given.items() if k in outputs})
    settings: dict[str, Any] = {} if bound is None else {"noise_bound": bound}
    if "effects" in given:
        settings["effects"] = [name.strip() for name in given["effects"].split(",") if name.strip()]
    if "share" in given:
        settings["test"] = _number(given, "share")
    found = _call("diagnosis = smid.diagnose", _MODEL, _Code("record"), **settings, **_work(given, "cause"))
    lines = [
        *found.splitlines(),
        "print(diagnosis)",
        'smid.report(diagnosis, "diagnosis.html")',
        'smid.report(diagnosis, "diagnosis.json")',
        'smid.save_model(diagnosis.model, "extended.toml")',
    ]
    return "\n".join(['if __name__ == "__main__":  # diagnose starts processes', *(f"    {line}" for line in lines)])


_CODE: Mapping[str, Callable[[Fields, Collection[str]], str]] = {
    "data": _data,
    "channels": _channels,
    "model": _model,
    "least": _least,
    "intervals": _intervals,
    "misfit": _misfit,
    "cause": _cause,
}
_MODEL, _TRAIN = _Code("model"), _Code("train")


def _path(given: Fields) -> str:
    """Return the expression of the path of the record."""
    if "bundled" in given:
        return _Code(f"record_path({_written(given['bundled'])})")
    if "file" not in given:
        raise DataError("no file was given: drop one on the page, pick one, or choose a bundled record")
    return given["file"]


def _reading(given: Fields) -> dict[str, Any]:
    """Return the options of the form that say how a file is read."""
    found: dict[str, Any] = {
        name: "\t" if given[name] in ("tab", r"\t") else given[name]
        for name in ("time", "delimiter", "decimal", "encoding")
        if name in given
    }
    if "sampling_time" in given:
        found["sampling_time"] = _number(given, "sampling_time")
    if "missing" in given:
        found["missing"] = [value.strip() for value in given["missing"].split(";")]
    if "units" in given:
        pairs = [pair.split("=") for pair in given["units"].split(",")]
        if any(len(pair) != 2 or not pair[0].strip() for pair in pairs):
            raise DataError(f"{given['units']!r} gives no units: write them as in u=V,y=bar")
        found["units"] = {name.strip(): unit.strip() for name, unit in pairs}
    return found


def _stated(given: Fields) -> float | dict[str, float] | None:
    """Return the noise bound of the only noisy channel, those of several by channel, or None if there is none."""
    bounds = _bounds(given)
    return next(iter(bounds.values())) if len(bounds) == _n_noisy(given) == 1 else bounds or None


def _bounds(given: Fields) -> dict[str, float]:
    """Return the noise bounds that are given, by channel."""
    return {
        name.removeprefix("bound:"): _number(given, name)
        for name, value in given.items()
        if name.startswith("bound:") and value
    }


def _n_noisy(given: Fields) -> int:
    return sum(name.startswith("bound:") for name in given)


def _work(given: Fields, step: str) -> dict[str, Any]:
    """Return the settings of long work."""
    limit = {"seconds": _number(given, f"{step}_seconds")} if f"{step}_seconds" in given else {}
    return {**limit, "progress": _Code("print")}


def _number(given: Fields, name: str) -> float:
    try:
        value = float(given[name])
    except ValueError:
        raise DataError(f"{_spoken(name)} is {given[name]!r}: give a number such as 0.3") from None
    return int(value) if value.is_integer() and abs(value) < 1e15 else value


def _whole(given: Fields, name: str, usual: int | None) -> int | None:
    if name not in given:
        return usual
    if not given[name].lstrip("-").isdigit():
        raise DataError(f"{_spoken(name)} is {given[name]!r}: give a number of samples, such as 200")
    return int(given[name])


def _spoken(name: str) -> str:
    return f"the noise bound of {name.removeprefix('bound:')}" if ":" in name else name.replace("_", " ")


def _crop(start: int | None, stop: int | None) -> str:
    return f"record.crop({start})" if stop is None else f"record.crop({start}, {stop})"


def _long(text: str) -> str:
    """Return the code of a text of several lines, line by line where no letter of it stands in the way."""
    text = "\n".join(text.splitlines())
    return _written(text) if "'''" in text or "\\" in text else f"'''\\\n{text}\n'''"


def _call(function: str, *arguments: Any, **keywords: Any) -> str:
    """Return a call in one line, its arguments in a line of their own, or a line for each, as their length asks."""
    written = [_written(value) for value in arguments]
    written += [f"{name}={_written(value)}" for name, value in keywords.items()]
    line = f"{function}({', '.join(written)})"
    if len(line) <= _LONGEST:
        return line
    line = f"    {', '.join(written)}"
    if len(line) <= _LONGEST:
        return f"{function}(\n{line}\n)"
    return "\n".join([f"{function}(", *(f"    {one}," for one in written), ")"])


def _written(value: Any) -> str:
    """Return the code of a value."""
    if isinstance(value, _Code):
        return value
    if isinstance(value, dict):
        return f"{{{', '.join(f'{_written(name)}: {_written(one)}' for name, one in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_written, value))}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # in double quotes, as this package writes them
    return f'float("{value}")' if isinstance(value, float) and not isfinite(value) else repr(value)
