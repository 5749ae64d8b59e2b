"""Load a result from the JSON that this package writes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import lru_cache
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import Any

from smid.data import DataError, Dataset
from smid.data.dataset import check_dataset
from smid.data.read_csv import read_text
from smid.display.from_plain import NotPlainError
from smid.models import ModelError
from smid.reports import documents

WHOLE = ""
"""The key of a document that is the result itself."""
Record = Dataset | Mapping[str, Dataset] | None


def load(path: str | PathLike[str], data: Record = None) -> Any:
    """Return the result in a JSON file that ``smid --json``, `smid.report` or a ``to_dict`` of a result wrote.

    An estimate is whole but for the verified points. Other results are what the file holds: tables, sentences and
    numbers. Samples are not in the file, so figures and reports need the record.

    Parameters
    ----------
    data
        The record that the result is about, or for a study a mapping of its records. Free runs are repeated.

    Returns
    -------
    Result
        Of the class that was written: an `Estimate`, for example, or an `EmptyFeasibleSetError`, which is not raised. A
        file of several validations or overviews gives a tuple.

    Raises
    ------
    DataError
        If there is no such file, if it holds no result or one of another version, if a key is missing or damaged, or if
        ``data`` is another record.
    ModelError
        If a model in the file is damaged.
    TypeError
        If ``data`` is no data set.

    Examples
    --------
    >>> import tempfile, smid
    >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    >>> record = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> estimate = smid.identify(smid.OutputError(stable=True), record, noise_bound=0.1)
    >>> file = smid.report(estimate, Path(tempfile.mkdtemp()) / "estimate.json")
    >>> load(file) == estimate
    True
    """
    content = _content(Path(path))
    schema = content.get("schema")
    readers = _readers().get(str(schema))
    if readers is None:
        raise DataError(f"{path} {_unknown(schema)}")
    place = next((one for one in readers if one == WHOLE or one in content), None)
    if place is None:
        raise DataError(f"{path}: {' or '.join(readers)}: the key is missing: {_CURE}")
    for record in data.values() if isinstance(data, Mapping) and "records" in content else [data]:
        if record is not None:
            check_dataset(record)
    told = content if place == WHOLE else content[place]
    try:
        found = tuple(_read(readers[place], one, data) for one in (told if isinstance(told, list) else [told]))
    except NotPlainError as error:
        raise DataError(f"{path}: {error}: {_CURE}") from None
    except (DataError, ModelError) as error:
        raise type(error)(f"{path}: {error}") from None
    except (AttributeError, KeyError, TypeError, ValueError) as error:  # a model, or numbers that contradict each other
        raise DataError(f"{path}: {type(error).__name__} {error}: {_CURE}") from None
    return found[0] if len(found) == 1 else found


_CURE = "the file is damaged, or an older smid wrote it; write it again"


@lru_cache
def _readers() -> dict[str, dict[str, Callable[..., Any]]]:
    """Return, by schema, the keys that may hold the result, and what reads it."""
    # Imported here, so that writing a page of an estimate loads neither diagnosis nor studies.
    from smid.data.overview import Overview
    from smid.diagnosis.diagnosis import Diagnosis
    from smid.identification.error_bound import ErrorBound
    from smid.identification.estimate import Estimate
    from smid.identification.identify import EmptyFeasibleSetError
    from smid.responses.band import ResponseBand
    from smid.responses.projections import Projections
    from smid.sensors.files import SENSOR, sensor_from_dict
    from smid.study.study import Study
    from smid.validation import Comparison, ModelFit, Residuals, Validation
    from smid.verification import Verification

    return {
        **{
            kind.SCHEMA: {WHOLE: kind.from_dict}
            for kind in (
                *(Estimate, ModelFit, Validation, Comparison, Residuals, ResponseBand, Projections),
                *(Diagnosis, Study),
            )
        },
        documents.IDENTIFY: {"estimate": Estimate.from_dict, "empty": EmptyFeasibleSetError.from_dict},
        documents.FIT: {"fit": ModelFit.from_dict},
        documents.ERROR_BOUND: {"error_bound": ErrorBound.from_dict},
        documents.VALIDATE: {"validations": Validation.from_dict},
        documents.COMPARE: {"comparison": Comparison.from_dict},
        documents.RESIDUALS: {"analysis": Residuals.from_dict},
        documents.RESPONSE: {"response": ResponseBand.from_dict},
        documents.PROJECTION: {"projections": Projections.from_dict},
        documents.DIAGNOSE: {WHOLE: Diagnosis.from_dict},
        documents.VERIFY: {"verification": Verification.from_dict},
        documents.SHOW: {"overview": Overview.from_dict},
        documents.DATASET: {"experiments": Overview.from_dict},
        SENSOR: {WHOLE: sensor_from_dict},
    }


def _content(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file."""
    try:
        content = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise DataError(
            f"{path} is not valid JSON: {error}; give a file that smid --json or smid.report wrote"
        ) from None
    if not isinstance(content, dict):
        raise DataError(f"{path} holds no result; give a file that smid --json or smid.report wrote")
    return content


def _unknown(schema: object) -> str:
    """Return why a schema is not read."""
    name, _, _ = str(schema).partition("/")
    known = [one for one in _readers() if one.startswith(f"{name}/")]
    if known:
        return f"has the schema {schema}, and this smid reads {known[0]}: use the version of smid that wrote it"
    return f"holds no result that can be loaded (schema {schema!r}); give a file that smid --json or smid.report wrote"


def _read(from_dict: Callable[..., Any], content: Any, data: Record) -> Any:
    if data is None:
        return from_dict(content)
    if "data" not in signature(from_dict).parameters:
        raise DataError("this result needs no record: leave out data")
    return from_dict(content, data)
