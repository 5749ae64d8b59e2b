"""Each kind of page in a real Chromium: quiet, without a network, readable on a phone and in the dark."""

import numpy as np
import pytest

import smid
from smid.reports import report
from smid.reports.pdf import find_browser
from smid.theses.chapter import write_chapter
from smid.theses.hybrid.inputs import arm_inputs, input_study
from tests.smid.reports.browser import DESKTOP, PHONE, Browser
from tests.smid.theses.clutch.small_clutch_studies import small_sensor_chapter

KINDS = {
    "identification": ["Proven: all parameters that explain", "Validation on other records", "Not proven"],
    "diagnosis": ["Cause: input dead zone", "Other effects, and why they are rejected", "Before and after"],
    "comparison": ["Best fit: first order", "Free runs", "measured", "static ("],
    "residuals": ["The residuals fail", "The residual is not white", "coherence", "with its past"],
    "projections": ["Pairs of parameters", "lies in its polygon", "a1"],
    "record": ["40 samples, sampling time 0.1 s", "bar"],
    "study": ["All 2 runs have certified intervals", "All runs", "noise bound of y"],
    "sensors": ["One sensor for all temperatures", "An interval for the position", "What cannot be compared"],
    "hybrid": ["Certified intervals", "excites order", "voltage [V]"],
}
# As a reader of the screen hears or sees it: with the text of the figures.
TEXT = "document.body.innerText + [...document.querySelectorAll('svg text')].map(t => t.textContent).join(' ')"
# Letters shrink with their figure; those that stand upright have their size in the other entry of the matrix.
SMALLEST = """Math.min(...[...document.querySelectorAll('svg text')].map(t => {
    const m = t.getScreenCTM(); return parseFloat(getComputedStyle(t).fontSize) * Math.hypot(m.a, m.b); }))"""


@pytest.fixture(scope="module")
def browser():
    program = find_browser()
    if program is None:
        pytest.skip("no Chromium on this machine: apt install chromium")
    with Browser(program) as started:
        yield started


@pytest.fixture(scope="module")
def folder(pages, data, estimate):
    """A folder with one page of each kind."""
    study = smid.order_study(smid.OutputError(na=1, stable=True), data.crop(0, 6), (0.1, 0.2), orders=[1], rounds=1)
    inputs = input_study({"six_unequal": arm_inputs(150)["six_unequal"]}, budget=0)
    report(study, pages / "study.html")
    report(smid.projections(estimate), pages / "projections.html")
    report(data, pages / "record.html")
    write_chapter(small_sensor_chapter(), pages / "sensors.html")
    write_chapter(inputs, pages / "hybrid.html")
    return pages


@pytest.mark.parametrize("kind", KINDS)
def test_it_says_what_it_must_and_nothing_to_console_or_network(browser, folder, kind):
    browser.open(folder / f"{kind}.html")
    text = " ".join(browser.value(TEXT).split())
    for words in KINDS[kind]:
        assert words in text
    assert browser.events("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []
    asked = {event["request"]["url"].split(":")[0] for event in browser.events("Network.requestWillBeSent")}
    assert asked <= {"file", "data"}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_sticks_out_of_a_phone_and_figures_are_legible(browser, folder, kind):
    browser.open(folder / f"{kind}.html", PHONE)
    assert browser.value("innerWidth") == PHONE
    assert browser.value("document.documentElement.scrollWidth") == PHONE
    assert browser.value(SMALLEST) >= 8.0


def test_a_dark_page_has_dark_paper_and_light_figures(browser, pages):
    looks = []
    for scheme in ("light", "dark"):
        browser.open(pages / "identification.html", scheme=scheme)
        looks.append(
            [
                browser.value("getComputedStyle(document.body).backgroundColor"),
                browser.value("getComputedStyle(document.querySelector('svg text')).fill"),
            ]
        )
    assert looks == [["rgb(255, 255, 255)", "rgb(34, 34, 34)"], ["rgb(22, 24, 27)", "rgb(230, 230, 230)"]]


def test_formulas_are_set_as_formulas(browser, pages):
    browser.open(pages / "identification.html")
    subscript = "document.querySelector('.equations msub').lastElementChild.getBoundingClientRect()"
    letter = "document.querySelector('.equations msub').firstElementChild.getBoundingClientRect()"
    assert browser.value(f"{subscript}.bottom") > browser.value(f"{letter}.bottom")


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    """A page of a record of an hour, a minute of which is missing."""
    time = np.arange(36_000) / 10
    y = np.where((time < 600) | (time > 660), np.sin(time / 60), np.nan)
    data = smid.Dataset.from_arrays(input={"u": np.cos(time / 60)}, output={"y": y}, sampling_time=0.1)
    return report(data, tmp_path_factory.mktemp("long") / "long.html")


SPAN = "document.querySelector('.zoom output').value"


def press(browser, name):
    browser.value(f"[...document.querySelectorAll('.zoom button')].find(b => b.title == '{name}').click()")
    return browser.value(SPAN)


def mouse(browser, share, *events, clicks=1):
    """Let the mouse do something at a share of the width of the lower plot."""
    where = "[...document.querySelectorAll('.u-over')].at(-1).getBoundingClientRect()"
    x, y, width = (browser.value(f"{where}.{name}") for name in ("x", "y", "width"))
    for event in events:
        at = {"x": x + share * width, "y": y + 20, "button": "left", "clickCount": clicks}
        browser.ask("Input.dispatchMouseEvent", type=event, **at)


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_a_long_figure_is_zoomed_by_its_buttons(browser, long, width):
    browser.open(long, width)
    assert browser.value("document.querySelectorAll('.zoom canvas').length") == 2
    assert browser.value("document.querySelector('.live .wide').checkVisibility()") is False
    assert browser.value(SPAN) == "0 min to 60 min"
    assert press(browser, "Zoom in") == "15 min to 45 min"
    assert press(browser, "Right") == "30 min to 60 min"
    assert press(browser, "Left") == "15 min to 45 min"
    assert press(browser, "Zoom out") == "0 min to 60 min"
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")
    assert browser.events("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []


def test_a_drag_selects_a_span_of_all_plots_and_a_double_click_resets(browser, long):
    browser.open(long)
    browser.value("document.querySelector('.zoom').scrollIntoView()")
    mouse(browser, 0.25, "mouseMoved", "mousePressed")
    mouse(browser, 0.5, "mouseMoved", "mouseReleased")
    start, _, _, end, unit = browser.value(SPAN).split()
    assert (float(start), float(end), unit) == (pytest.approx(15, abs=0.2), pytest.approx(30, abs=0.2), "min")
    mouse(browser, 0.5, "mousePressed", "mouseReleased")
    mouse(browser, 0.5, "mousePressed", "mouseReleased", clicks=2)
    assert browser.value(SPAN) == "0 min to 60 min"


def test_on_paper_a_long_figure_is_the_picture(browser, long):
    browser.open(long)
    browser.ask("Emulation.setEmulatedMedia", media="print")
    assert browser.value("document.querySelector('.live .wide').checkVisibility()")
    assert not browser.value("document.querySelector('.zoom').checkVisibility()")
    browser.ask("Emulation.setEmulatedMedia", media="")
