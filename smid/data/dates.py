"""Dates and times of day as seconds since the first.

A date is read as ISO 8601 says, or with the day first where points separate it. With slashes the order of day and month
is taken from the column: only an order that gives valid, rising dates counts, and two that give different times are
asked about.
"""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from smid.data.errors import DataError

if TYPE_CHECKING:
    import pandas as pd

_CLOCK = r"\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?( ?[AaPp][Mm])?"
_ZONE = r"( ?(Z|UTC|[+-]\d{2}:?\d{2}))"
_ISO = re.compile(rf"\d{{4}}([-/.])\d{{1,2}}\1\d{{1,2}}([T ]+{_CLOCK}{_ZONE}?)?|\d{{8}}T\d{{4,6}}{_ZONE}?")
_OF_DAY = re.compile(r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?( ?[AaPp][Mm])?")
_FORMS = (
    (_ISO, (r"\g<0>",)),
    (_OF_DAY, (r"2000-01-01 \g<0>",)),
    (re.compile(rf"(\d{{1,2}})\.(\d{{1,2}})\.(\d{{4}})(?P<clock>( +{_CLOCK})?)"), (r"\3-\2-\1\g<clock>",)),
    (
        re.compile(rf"(\d{{1,2}})[/-](\d{{1,2}})[/-](\d{{4}})(?P<clock>( +{_CLOCK})?)"),
        (r"\3-\2-\1\g<clock>", r"\3-\1-\2\g<clock>"),
    ),
)
"""Each form of a date, and the orders in which its numbers may stand."""

_ZONED = re.compile(rf".*\d{_ZONE}")


def is_date(cell: str) -> bool:
    """Tell whether a cell reads as a date, with or without time, or as a time of day with seconds."""
    return any(form.fullmatch(cell) for form, _ in _FORMS)


def is_day(cell: str) -> bool:
    """Tell whether a cell reads as a date without time."""
    return is_date(cell) and ":" not in cell and "T" not in cell


def is_time_of_day(cell: str) -> bool:
    """Tell whether a cell reads as a time of day."""
    return _OF_DAY.fullmatch(cell) is not None


def read_dates(cells: Sequence[str], where: str) -> NDArray[np.datetime64]:
    """Return dates in nanoseconds of UTC, shape (N,); times of day fall on one day.

    Raises
    ------
    DataError
        If a cell is no date, only some have a time zone, or day and month cannot be told apart. ``where`` begins it.

    Examples
    --------
    >>> read_dates(["31/01/2024 08:00:00", "01/02/2024 08:00:00"], "run.csv") - np.datetime64("2024-01-31T08")
    array([             0, 86400000000000], dtype='timedelta64[ns]')
    """
    if len({_ZONED.fullmatch(cell) is None for cell in cells if cell}) > 1:
        raise DataError(f"{where}: some dates have a time zone and some have none; export all of them with the zone")
    forms = [(form, orders) for form, orders in _FORMS if all(map(form.fullmatch, cells))]
    read = [_parsed(cells, form, order) for form, orders in forms[:1] for order in orders]
    possible = [times for times in read if times is not None]
    rising = [times for times in possible if (np.diff(times) >= np.timedelta64(0)).all()]
    if len(rising) == 2 and not np.array_equal(np.diff(rising[0]), np.diff(rising[1])):
        raise DataError(
            f"{where}: {cells[0]!r} does not tell the day from the month; export the dates as in 2024-01-31"
        )
    dates = next(iter(rising or possible), None)
    if dates is None:
        bad = next((k for k, cell in enumerate(cells) if not is_date(cell)), None)
        what = (
            "dates are not in one form, or do not exist" if bad is None else f"row {bad + 1}: {cells[bad]!r} is no date"
        )
        raise DataError(f"{where}: {what}; export the dates as in 2024-01-31 12:00:00, or the time in seconds")
    return dates


def utc(times: "pd.Series[pd.Timestamp]") -> NDArray[np.datetime64]:
    """Return dates of a frame in nanoseconds of UTC; a time without a zone stays as it is."""
    plain = times if times.dt.tz is None else times.dt.tz_convert("UTC").dt.tz_localize(None)
    return plain.to_numpy("datetime64[ns]")


def _parsed(cells: Sequence[str], form: re.Pattern[str], order: str) -> NDArray[np.datetime64] | None:
    """Return dates of one form, rewritten with the year first; None if one does not exist."""
    import pandas as pd  # slow to import

    # pandas reads a comma before the decimals of a second in one form only.
    texts = [form.sub(order, cell).replace(",", ".") for cell in cells]
    try:
        return utc(pd.Series(pd.to_datetime(pd.Series(texts), format="mixed", utc=True)))
    except (ValueError, OverflowError):
        return None
