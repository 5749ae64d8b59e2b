"""The server of the page in a thread, and requests to it."""

import asyncio
import contextlib
import json
import threading
import urllib.error
import urllib.parse
import urllib.request

from smid.app.server import serve


class Served:
    """One server with its process: a context manager. ``fields`` are those of all forms of the page."""

    def __enter__(self):
        opened = threading.Event()
        self.fields = {}

        def tell(address):
            self.address = address
            opened.set()

        async def run():
            self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
            await serve(0, tell)

        def main():
            with contextlib.suppress(asyncio.CancelledError):
                asyncio.run(run())

        self._thread = threading.Thread(target=main)
        self._thread.start()
        assert opened.wait(30)
        return self

    def __exit__(self, *_error):
        self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join(30)
        assert not self._thread.is_alive()

    def ask(self, path, body=None, **headers):
        """Return the status and the text of an answer; a body makes it a POST."""
        request = urllib.request.Request(urllib.parse.urljoin(self.address, path), body, headers)
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def drop(self, name, content):
        """Send a file; return its name in the folder of the server, or the error."""
        answer = json.loads(self.ask(f"file?name={urllib.parse.quote(name)}", content)[1])
        self.fields["file"] = answer.get("file", "")
        return answer.get("file", answer.get("error"))

    def run(self, step, *, stop_at=None, **fields):
        """Run a step with more fields; return its last event, with the code and the lines of progress.

        Parameters
        ----------
        stop_at
            Part of a line of progress, at which the server is asked to stop the step.
        """
        self.fields |= fields
        request = urllib.request.Request(
            urllib.parse.urljoin(self.address, f"run/{step}"), urllib.parse.urlencode(self.fields).encode()
        )
        events = []
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                for line in answer:
                    events.append(json.loads(line))
                    if stop_at and stop_at in events[-1].get("line", ""):
                        self.ask("stop", b"")
        except urllib.error.HTTPError as error:
            return json.loads(error.read())
        code, *lines, last = events
        if last["answer"]:
            self.fields |= last["answer"]["values"]
        return {**last, **code, "lines": [line["line"] for line in lines]}
