"""Exit codes, one line for each mistake, and progress on a terminal."""

from __future__ import annotations

import logging
import signal
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from types import TracebackType
from typing import Any, NoReturn, Self

import click

from relaxations.errors import UserError
from smid.display.progress import Bar

EMPTY, BAD_INPUT, INTERRUPTED = 1, 2, 130
"""Exit codes other than 0; 130 is the shell's code for a program stopped by Ctrl-C."""

_PAUSE = 15.0
"""Seconds between lines of progress in a file: short work stays quiet."""

LOGGER = logging.getLogger("smid")


class Command(click.Command):
    """A command that refuses an option given twice, where click would take the last one in silence."""

    def parse_args(self, context: click.Context, args: list[str]) -> list[str]:
        """Parse arguments as click does."""
        _, _, given = self.make_parser(context).parse_args(list(args))
        for one in given:
            if isinstance(one, click.Option) and not (one.multiple or one.is_flag) and given.count(one) > 1:
                raise click.UsageError(f"{one.opts[0]} is given twice, and takes one value", context)
        return super().parse_args(context, args)


class Commands(click.Group):
    """A group that imports a command only when it runs, so that the help page appears at once.

    ``targets`` maps a name to "module:function" and its line on the help page; an empty line is read from the command.
    """

    def __init__(self, *args: Any, targets: Mapping[str, tuple[str, str]], **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.targets = targets

    def list_commands(self, _: click.Context) -> list[str]:
        """Return the names in alphabetical order."""
        return sorted(self.targets)

    def get_command(self, _: click.Context, name: str) -> click.Command | None:
        """Import a command; None where the name is unknown."""
        if name not in self.targets:
            return None
        module, function = self.targets[name][0].split(":")
        command: click.Command = getattr(import_module(module), function)
        return command

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the names and their lines on the help page."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, self._line(context, name)) for name in self.list_commands(context)])

    def _line(self, context: click.Context, name: str) -> str:
        command = None if self.targets[name][1] else self.get_command(context, name)
        return command.get_short_help_str(100) if command else self.targets[name][1]


class Face(Commands):
    """A group of commands that shows a user's mistake as one line ``error: cause; cure``, with exit code 2."""

    def main(self, *args: Any, **settings: Any) -> NoReturn:
        """Run a command line and exit; see click's own documentation for the arguments."""
        settings["standalone_mode"] = False
        try:
            with _ended_as_by_ctrl_c():
                code = super().main(*args, **settings)
        except click.Abort:
            code = _fail("interrupted; there is no result yet", INTERRUPTED)
        except click.UsageError as error:
            command = error.ctx.command_path if error.ctx else "smid"
            code = _fail(f"{error.format_message().rstrip('.')}; see {command} --help")
        except click.ClickException as error:
            code = _fail(error.format_message())
        except OSError as error:
            # An error of the operating system names its cause and file; our own errors hold a whole sentence.
            named = f"{error.filename}: {error.strerror}; check the path and its permissions"
            code = _fail(named if error.filename is not None else str(error))
        except MemoryError:
            code = _fail("out of memory; use fewer samples (--stop) or a lower --order")
        except UserError as error:
            code = _fail(str(error))
        sys.exit(code if isinstance(code, int) else 0)


@contextmanager
def _ended_as_by_ctrl_c() -> Iterator[None]:
    """Let SIGTERM (`kill`, `timeout`, a batch system) keep what was found, as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():  # only there a handler can be set
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _fail(message: str, code: int = BAD_INPUT) -> int:
    click.echo(f"error: {' '.join(message.split())}", err=True)
    return code


class Progress:
    """A bar on the terminal; elsewhere a line now and then.

    Each line also goes to the logger ``smid``. With ``--verbose`` the log replaces the progress line.
    """

    def __init__(self) -> None:
        self._shown = not LOGGER.isEnabledFor(logging.INFO)
        self._bar = Bar() if self._shown and sys.stderr.isatty() else None
        self._began = self._last = time.monotonic()

    def __call__(self, line: str) -> None:
        """Show a line in the bar, or after a pause."""
        LOGGER.info(line)
        if not self._shown:
            return
        if self._bar is not None:
            self._bar(line)
        elif (now := time.monotonic()) - self._last >= _PAUSE:
            self._last = now
            click.echo(f"after {now - self._began:.0f} s: {line}", err=True)

    def __enter__(self) -> Self:
        if self._bar is not None:
            self._bar.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.__exit__(kind, error, trace)
