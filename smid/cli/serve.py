"""``smid app``: a page in the browser, from a file to intervals, misfit and cause."""

from __future__ import annotations

import asyncio
import webbrowser
from importlib.util import find_spec

import click

from smid.cli.console import Command


@click.command("app", cls=Command)
@click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="P", help="Port. [default: a free one]")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
def app(port: int, no_browser: bool) -> None:
    """Open a page in the browser that leads from a record to intervals, misfit and cause.

    The page is for this machine and its address holds a secret. Ctrl-C ends it.
    """
    if find_spec("tornado") is None:
        raise click.ClickException('smid app needs tornado: pip install "smid[app]"')
    from smid.app.server import serve

    def opened(address: str) -> None:
        click.echo(f"{address}  (Ctrl-C ends)")
        if not no_browser:
            webbrowser.open(address)

    try:
        asyncio.run(serve(port, opened))
    except KeyboardInterrupt:
        click.echo("smid app has ended")
    except EOFError:
        raise click.ClickException("the process of the page did not start: run smid doctor") from None
    except OSError as error:
        raise click.ClickException(f"port {port} is not free ({error.strerror}): choose another by --port") from None
