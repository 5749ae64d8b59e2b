"""Mistakes of the user. Each is told in one line that names the cause and the cure."""

__all__ = ["ProblemError", "UserError"]


class UserError(ValueError):
    """Base of the errors that a user can mend: in the problem, the model or the data.

    Examples
    --------
    >>> issubclass(ProblemError, UserError)
    True
    """


class ProblemError(UserError):
    """The polynomial problem, or what is asked of it, cannot be treated as given.

    Examples
    --------
    >>> from relaxations.library import load
    >>> try:
    ...     load("atlantis")
    ... except ProblemError as error:
    ...     print(error)
    the library holds no problem 'atlantis': relaxations.library.names() lists them
    """
