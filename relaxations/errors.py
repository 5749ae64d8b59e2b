"""Errors in the user's input. Each message is one line with the cause and the cure."""

__all__ = ["ProblemError", "UserError"]


class UserError(ValueError):
    """Base class of errors that the user can correct in the problem, the model or the data.

    Examples
    --------
    >>> issubclass(ProblemError, UserError)
    True
    """


class ProblemError(UserError):
    """The polynomial problem or a request about it is not valid.

    Examples
    --------
    >>> from relaxations.library import load
    >>> try:
    ...     load("atlantis")
    ... except ProblemError as error:
    ...     print(error)
    the library holds no problem 'atlantis': relaxations.library.names() lists them
    """
