"""The user's mistakes, told in one line with cause and cure."""


class ProblemError(ValueError):
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
