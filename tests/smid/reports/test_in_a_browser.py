"""Each kind of page in a real Chromium: quiet, without a network, readable on a phone and in the dark."""

import pytest

import smid
from smid.reports import report
from smid.reports.pdf import find_browser
from smid.theses.chapter import write_chapter
from smid.theses.hybrid.inputs import arm_inputs, input_study
from tests.smid.reports.browser import PHONE, Browser
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
