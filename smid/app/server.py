"""The server of the page: this machine only, one user, a secret in its address."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import tempfile
from collections.abc import Callable
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from tornado.httpserver import HTTPServer
from tornado.iostream import StreamClosedError
from tornado.web import Application, HTTPError, RequestHandler

from relaxations.errors import UserError
from smid.app.model_forms import BUILT_IN, model_fields, prior_fields
from smid.app.session import Session
from smid.app.steps import FILES, STEPS
from smid.data.bundled import SHORT_RECORDS

__all__ = ["LARGEST", "serve"]

ADDRESS = "127.0.0.1"
LARGEST = 500  # MB of a file
RECORDS = ("heated_tank", *SHORT_RECORDS)
_HEADERS = {
    # The page loads its own script, and nothing from elsewhere. Figures carry their own styles.
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'unsafe-inline'; img-src data:; "
    "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


async def serve(port: int, opened: Callable[[str], None]) -> None:
    """Serve the page until the task is cancelled.

    Parameters
    ----------
    port
        0 for any free one.
    opened
        Called with the address of the page when it can be loaded.

    Raises
    ------
    OSError
        If the port is in use.
    """
    # The port first: one that is in use is told before a process is started.
    with (
        socket.create_server((ADDRESS, port)) as listening,
        tempfile.TemporaryDirectory(prefix="smid-", ignore_cleanup_errors=True) as folder,
    ):
        listening.setblocking(False)
        number, secret = listening.getsockname()[1], secrets.token_urlsafe(16)
        session = Session(Path(folder))
        server = HTTPServer(application(session, secret, number), max_buffer_size=(LARGEST + 1) * 10**6)
        try:
            server.add_socket(listening)
            await session.ready()  # so that the first record is not kept waiting
            opened(f"http://{ADDRESS}:{number}/{secret}/")
            await asyncio.Event().wait()
        finally:
            server.stop()
            session.close()


def application(session: Session, secret: str, port: int) -> Application:
    """Return the handlers of all addresses; without the secret there is nothing to find."""
    hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
    shared = {"session": session, "hosts": hosts}
    return Application(
        [
            (f"/{secret}/", _Page, shared),
            (f"/{secret}/app.js", _Script, shared),
            (f"/{secret}/file", _File, shared),
            (f"/{secret}/run/({'|'.join(STEPS)})", _Run, shared),
            (f"/{secret}/stop", _Stop, shared),
            (f"/{secret}/download/([a-z]+\\.[a-z]+)", _Download, shared),
        ],
        default_handler_class=_Nothing,
        default_handler_args=shared,
        log_function=lambda _: None,
    )


class _Handler(RequestHandler):
    """A handler that answers this machine's own page only."""

    def initialize(self, session: Session, hosts: set[str]) -> None:
        self.session, self.hosts = session, hosts

    def set_default_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        # A foreign site may let its own name point to this machine, or send a form here: neither knows the right names.
        host, origin = self.request.host, self.request.headers.get("Origin")
        if host not in self.hosts or (origin is not None and origin != f"http://{host}"):
            raise HTTPError(403)

    def write_error(self, status_code: int, **_: Any) -> None:
        """Answer in one line, without a traceback."""
        self.finish(f"{status_code}: the page is at the address that smid app printed, for this machine only\n")

    def refuse(self, error: Exception) -> None:
        """Answer a mistake of the user."""
        self.set_status(400)
        self.finish({"error": str(error)})


class _Nothing(_Handler):
    def prepare(self) -> None:
        super().prepare()
        raise HTTPError(404)


class _Page(_Handler):
    def get(self) -> None:
        environment = Environment(
            loader=ChoiceLoader([PackageLoader("smid.app"), PackageLoader("smid.reports")]),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        self.finish(
            environment.get_template("app.html.j2").render(
                records=RECORDS,
                models=BUILT_IN,
                fields={name: model_fields(name) for name in BUILT_IN},
                priors=prior_fields(),
                largest=LARGEST,
            )
        )


class _Script(_Handler):
    def get(self) -> None:
        self.set_header("Content-Type", "text/javascript; charset=utf-8")
        self.finish((files("smid.app") / "static" / "app.js").read_bytes())


class _File(_Handler):
    def post(self) -> None:
        try:
            self.finish({"file": self.session.keep(self.get_query_argument("name"), self.request.body)})
        except (UserError, OSError) as error:
            self.refuse(error)


class _Run(_Handler):
    async def post(self, step: str) -> None:
        """Answer with a line of JSON for each event."""
        fields = {name: self.get_body_argument(name) for name in self.request.body_arguments}
        try:
            async for event in self.session.run(step, fields):
                self.write(json.dumps(event) + "\n")
                # The reader may be gone; the result is awaited all the same, so that the process is free again.
                with suppress(StreamClosedError):
                    await self.flush()
        except UserError as error:
            self.refuse(error)
        except asyncio.CancelledError:
            pass  # the server ends, and the page with it

    def on_connection_close(self) -> None:
        """Stop the work that nobody waits for."""
        self.session.stop()


class _Stop(_Handler):
    def post(self) -> None:
        self.session.stop()
        self.finish({})


class _Download(_Handler):
    def get(self, name: str) -> None:
        if name == "session.py":
            content = self.session.script.encode()
        elif any(name in written for written in FILES.values()) and (self.session.folder / name).exists():
            content = (self.session.folder / name).read_bytes()
        else:
            raise HTTPError(404)
        self.set_header("Content-Type", "application/octet-stream")
        self.set_header("Content-Disposition", f'attachment; filename="{name}"')
        self.finish(content)
