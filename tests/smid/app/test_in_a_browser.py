"""The page in a real Chromium: by mouse and by keyboard, on a screen and on a phone."""

import json
import time

import pytest

from smid.reports.pdf import find_browser
from tests.smid.reports.browser import DESKTOP, PHONE, Browser

ENOUGH = 60.0  # seconds until a step must be done
KEYS = {"Tab": (9, ""), "Enter": (13, "\r"), " ": (32, " ")}


class Page(Browser):
    """A browser that acts as a user does."""

    def wait_for(self, script):
        """Wait until an expression is true on the page."""
        began = time.monotonic()
        while not self.value(script):
            assert time.monotonic() - began < ENOUGH, f"{script} did not come true: {self.said()}"
            time.sleep(0.05)

    def said(self):
        """Return the error that the page shows."""
        return self.value("[...document.querySelectorAll('.error:not([hidden])')].map(e => e.textContent).join()")

    def press(self, key):
        """Press a key: its name, or a letter."""
        shift, _, key = key.rpartition("+")
        code, text = KEYS[key] if key in KEYS else (ord(key.upper()), key)
        for kind in ("keyDown", "keyUp"):
            more = {"text": text} if text and kind == "keyDown" else {}
            more["modifiers"] = 8 if shift else 0
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, **more)

    def tab_to(self, selector, most=40):
        """Press Tab until an element has the focus."""
        for _ in range(most):
            if self.value(f"document.activeElement === document.querySelector({json.dumps(selector)})"):
                return
            self.press("Tab")
        raise AssertionError(f"{selector} is not reached: {self.value('document.activeElement.outerHTML')}")

    def write(self, text):
        """Replace the text of the field that has the focus."""
        self.value("document.activeElement.select()")
        self.ask("Input.insertText", text=text)

    def click(self, selector):
        """Click the middle of an element."""
        box = self.value(
            f"(e => {{ e.scrollIntoView({{block: 'center'}}); const r = e.getBoundingClientRect();"
            f" return [r.x + r.width / 2, r.y + r.height / 2]; }})(document.querySelector({json.dumps(selector)}))"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.ask("Input.dispatchMouseEvent", type=kind, x=box[0], y=box[1], button="left", clickCount=1)

    def is_done(self, step):
        """Wait until a step has its answer, and the page is no wider than the screen."""
        self.wait_for(f"!busy && document.querySelector('#answer-{step}').children.length > 0")
        assert self.said() == ""
        assert self.value("document.documentElement.scrollWidth <= innerWidth")

    def choose(self, name, option):
        """Choose an option of a list as a mouse does it."""
        self.value(
            f"(s => {{ s.value = {json.dumps(option)}; s.dispatchEvent(new Event('change', {{bubbles: true}})); }})"
            f"(document.querySelector('[name={json.dumps(name)}]'))"
        )


@pytest.fixture(scope="module")
def page():
    program = find_browser()
    if program is None:
        pytest.skip("no Chromium on this machine: apt install chromium")
    with Page(program) as started:
        yield started


DROP = """(carried => { carried.items.add(new File([%s], "run.csv"));
    document.getElementById("drop").dispatchEvent(new DragEvent("drop", {dataTransfer: carried, bubbles: true}));
})(new DataTransfer())"""


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_from_a_dropped_file_to_downloads_by_mouse(page, served, content, width, tmp_path):
    page.open(served.address, width)
    page.value(DROP % json.dumps(content.decode()))
    page.is_done("data")
    assert "run.csv" in page.value("document.getElementById('python-data').innerText")
    page.choose("role:valve", "input")
    page.choose("role:level (LT-1)", "output")
    page.value("document.getElementById('train_stop').value = 12")
    page.click("button[value=channels]")
    page.is_done("channels")
    page.click("button[value=model]")
    page.is_done("model")
    page.click("#bounds input")
    page.write("0.05")
    page.click("button[value=intervals]")
    page.is_done("intervals")
    assert "Proven: all parameters" in page.value("document.getElementById('answer-intervals').innerText")
    page.ask("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    for name in ("intervals.html", "model.toml", "proof.json"):
        page.click(f"#files-intervals a[download='{name}']")
        began = time.monotonic()
        while not (tmp_path / name).exists():
            assert time.monotonic() - began < ENOUGH
            time.sleep(0.05)
    assert 'class = "OwnModel"' in (tmp_path / "model.toml").read_text("utf-8")
    page.click("button[value=misfit]")
    page.is_done("misfit")
    ids = page.value("[...document.querySelectorAll('[id]')].map(e => e.id)")
    assert len(ids) == len(set(ids))
    assert page.events("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []
    asked = {event["request"]["url"] for event in page.events("Network.requestWillBeSent")}
    assert all(url.startswith(served.address) for url in asked)


def test_from_a_bundled_record_to_intervals_by_keyboard_alone(page, served):
    page.open(served.address)
    page.tab_to("#file")
    page.tab_to("#bundled")
    for letter in "hamm":
        page.press(letter)
    page.tab_to("button[value=data]")
    page.press("Enter")
    page.is_done("data")
    page.tab_to("[name='role:current']")
    page.press("i")
    page.tab_to("[name='role:pressure']")
    page.press("o")
    page.tab_to("#train_stop")
    page.write("12")
    page.press("Enter")  # Enter in a field runs its step
    page.is_done("channels")
    page.tab_to("button[value=model]")
    page.press(" ")
    page.is_done("model")
    page.tab_to("button[value=least]")
    page.press("Enter")
    page.is_done("least")
    assert page.value("Number(document.querySelector('#bounds input').value)") > 0
    page.press("Shift+Tab")  # back to the button before
    page.press("Enter")
    page.is_done("intervals")
    assert page.value("document.activeElement.value") == "intervals"  # the focus stays
    assert page.value("document.getElementById('status').textContent").startswith("done in")


def test_every_field_has_a_label_and_errors_are_alerts(page, served):
    page.open(served.address)
    fields = "[...document.querySelectorAll('input:not([type=hidden]), select, textarea')]"
    assert page.value(f"{fields}.filter(e => !e.labels.length && !e.ariaLabel).map(e => e.id)") == []
    page.click("button[value=data]")
    page.wait_for("!busy && document.querySelector('#error-data').textContent")
    assert page.value("document.querySelector('#error-data').getAttribute('role')") == "alert"
    assert "no file was given" in page.said()


def test_a_search_shows_progress_and_can_be_stopped(page, served, long_content):
    page.open(served.address, PHONE)
    page.value(DROP % json.dumps(long_content.decode()))
    page.is_done("data")
    page.choose("role:valve", "input")
    page.choose("role:level (LT-1)", "output")
    for step in ("channels", "model"):
        page.click(f"button[value={step}]")
        page.is_done(step)
    page.click("button[value=cause]")
    # Any line of progress: the first ones may be gone before they are seen.
    page.wait_for("!['', 'working'].includes(document.querySelector('#doing-cause span').textContent)")
    assert page.value("document.documentElement.scrollWidth <= innerWidth")
    page.click(".stop[data-step=cause]")
    page.wait_for("!busy")
    found = page.said() + page.value("document.getElementById('answer-cause').innerText")
    assert "stopped" in found or "ended early" in found
