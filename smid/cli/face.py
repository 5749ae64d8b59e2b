"""How the command line speaks: exit codes, one line per mistake, progress on a terminal only."""

from __future__ import annotations

import logging
import shutil
import sys
from types import TracebackType
from typing import Any, NoReturn, Self

import click

from relaxations.errors import ProblemError
from smid.data import DataError
from smid.models import ModelError

EMPTY, BAD_INPUT, INTERRUPTED = 1, 2, 130
"""Exit codes beside 0. What a shell gives a program stopped by Ctrl-C is 130."""


LOGGER = logging.getLogger("smid")


class Face(click.Group):
    """A group of commands that turns a user's mistake into one line ``error: cause; cure`` and code 2."""

    def main(self, *args: Any, **settings: Any) -> NoReturn:
        """Run a command line and exit; see click's own documentation for the arguments."""
        settings["standalone_mode"] = False
        try:
            code = super().main(*args, **settings)
        except click.Abort:
            code = _fail("interrupted; there is no result yet", INTERRUPTED)
        except click.UsageError as error:
            command = error.ctx.command_path if error.ctx else "smid"
            code = _fail(f"{error.format_message().rstrip('.')}; see {command} --help")
        except click.ClickException as error:
            code = _fail(error.format_message())
        except OSError as error:
            # An error of the system knows its cause and file; ours carry a sentence.
            named = f"{error.filename}: {error.strerror}; check the path and its permissions"
            code = _fail(named if error.filename is not None else str(error))
        except MemoryError:
            code = _fail("out of memory; take fewer samples (--stop) or a lower --order")
        except (DataError, ModelError, ProblemError) as error:
            code = _fail(str(error))
        sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str, code: int = BAD_INPUT) -> int:
    click.echo(f"error: {' '.join(message.split())}", err=True)
    return code


class Progress:
    """One line on the terminal that is written over again and again; silent where stderr is no terminal.

    Every line also goes to the logger ``smid``; where that is heard (``--verbose``) the terminal is left to it.

    Examples
    --------
    >>> with Progress() as progress:
    ...     progress("first round")
    """

    def __init__(self) -> None:
        self._shown = sys.stderr.isatty() and not LOGGER.isEnabledFor(logging.INFO)

    def __call__(self, line: str) -> None:
        """Show a line in place of the one before."""
        LOGGER.info(line)
        if self._shown:
            width = shutil.get_terminal_size().columns - 1
            click.echo(f"\r\x1b[K{line[:width]}", nl=False, err=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._shown:
            click.echo("\r\x1b[K", nl=False, err=True)
