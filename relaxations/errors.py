"""The user's mistakes, told in one line with cause and cure."""


class ProblemError(ValueError):
    """The polynomial problem, or what is asked of it, cannot be treated as given."""
