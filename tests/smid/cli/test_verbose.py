"""``--verbose`` logs what was solved and why it stopped; without it a command is quiet."""

import logging

import pytest

from smid.cli.console import LOGGER, Progress

COMMON = "run.csv --input u --output y --model model.toml"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            f"identify {COMMON} --noise-bound 0.15",
            [
                "a1 in [",
                "lift of order 1, complicating: a1",
                "the solver said",
                "they stopped: every end meets a verified point",
            ],
        ),
        (f"identify {COMMON}", ["least noise bound of y in [", "it stopped: every end", "they stopped: "]),
        (f"error-bound {COMMON}", ["noise_bound in [", "least noise bound of y in [", "it stopped: every end"]),
    ],
)
def test_what_is_logged(smid, line, words):
    quiet, loud = smid(line), smid(f"{line} --verbose")
    assert quiet.exit_code == loud.exit_code == 0, loud.stderr
    assert quiet.stderr == ""
    for word in words:
        assert word in loud.stderr
    assert "it stopped" not in loud.stdout


def test_a_diagnosis_is_logged(smid, folder):
    rows = (folder / "run.csv").read_text().splitlines()
    longer = [row.partition(",")[2] for row in rows[2:]] * 4
    (folder / "run.csv").write_text("\n".join(["u [V],y [bar]", *longer]) + "\n")
    line = f"diagnose {COMMON} --sampling-time 0.1 --effects gain,scheduled_parameter --workers 1 --verbose"
    result = smid(line)
    assert result.exit_code == 0, result.stderr
    for word in ["fitting the base model", "trying 2 effects", "scheduled_parameter was not tested: ", "it stopped: "]:
        assert word in result.stderr


def test_the_log_ends_with_the_command(smid):
    smid(f"error-bound {COMMON} --verbose")
    assert LOGGER.handlers == []
    assert LOGGER.level == logging.NOTSET


def test_progress_goes_to_the_log(caplog):
    with caplog.at_level(logging.INFO, logger="smid"), Progress() as progress:
        progress("first round")
    assert caplog.messages == ["first round"]
