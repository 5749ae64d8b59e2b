"""The error raised for a mistake in the data."""

from relaxations.errors import UserError


class DataError(UserError):
    """The data, or the request for them, cannot be used; the message names cause and cure.

    Examples
    --------
    >>> raise DataError("no column 'pressur'; did you mean 'pressure'?")
    Traceback (most recent call last):
    ...
    smid.data.errors.DataError: no column 'pressur'; did you mean 'pressure'?
    """
