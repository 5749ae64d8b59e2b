"""``smid app`` from the command line: what it needs, its port, its end."""

import signal
import socket
import subprocess
import sys

import pytest
from click.testing import CliRunner

from smid.cli import main, serve


def test_without_the_extra_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setattr(serve, "find_spec", lambda _: None)
    run = CliRunner().invoke(main, ["app"])
    assert (run.exit_code, run.stderr) == (2, 'error: smid app needs tornado: pip install "smid[app]"\n')


def test_a_port_in_use_is_told():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        run = CliRunner().invoke(main, ["app", "--no-browser", "--port", str(port)])
    assert run.exit_code == 2
    assert run.stderr.startswith(f"error: port {port} is not free")
    assert run.stderr.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is another thing there")
def test_ctrl_c_ends_it_with_one_line():
    # A shell's background job passes on that SIGINT is ignored.
    listen = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{listen}; from smid.cli import main; main(['app', '--no-browser'])"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        try:
            assert run.stdout.readline().startswith("http://127.0.0.1:")
            run.send_signal(signal.SIGINT)
            assert run.communicate(timeout=30) == ("smid app has ended\n", "")
        finally:
            run.kill()
    assert run.returncode == 0
