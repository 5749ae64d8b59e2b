"""A diagnosis in several processes gives the same result as in one."""

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

from smid.diagnosis import EFFECTS, Effect, diagnose, prove_name
from smid.diagnosis.proof.decide import Status
from smid.diagnosis.search.trial import fitted_base
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, lag, record, steps


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_effect_of_the_library_can_be_sent_to_another_process(effect):
    assert pickle.loads(pickle.dumps(effect)) == effect


@pytest.fixture(scope="module")
def base():
    u = steps(1, 120)
    data = record(u, lag(dead_zone(u, 0.3)))
    return fitted_base(LAG, data, (np.ones(120, bool),), "u", "y")


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_what_an_effect_offers_can_be_sent_back(effect, base):
    for offered in effect.extensions(base.fit.model, base.site()):
        back = pickle.loads(pickle.dumps(offered))
        assert tuple(back.starts) == tuple(offered.starts)


def tells_where(_model, _site):
    raise RuntimeError(f"in process {os.getpid()}")


def compare():
    """Diagnose in one process and in two, in a process that has one thread."""
    u = steps(1, 240)
    data = record(u, lag(dead_zone(u, 0.3)))
    where = Effect("tells_where", "it fails and tells where", tells_where, needs="nothing")
    effects = [where, "input_dead_zone", "input_saturation", "input_noise", "quantisation"]
    one, two = (diagnose(LAG, data, BOUND, effects, certify=False, workers=n) for n in (1, 2))
    assert one.skipped.pop("tells_where") == f"RuntimeError: in process {os.getpid()}"
    assert two.skipped.pop("tells_where") != f"RuntimeError: in process {os.getpid()}"
    assert [cause.effect for cause in two.causes] == ["input_dead_zone"]
    assert two.to_dict() == one.to_dict()


def compare_proofs():
    """Prove a name in one process and in two, in a process that has one thread."""
    u = steps(1, 300)
    found = diagnose(LAG, record(u, lag(dead_zone(u, 0.3))), BOUND, ["input_dead_zone", "gain"], certify=False)
    one, two = (prove_name(found, BOUND, workers=n).name_proof for n in (1, 2))
    assert one.rivals
    assert [found.status for _, found in two.decisions] == [found.status for _, found in one.decisions]
    assert one.base.excluded
    assert one.extended.status is two.extended.status is Status.FEASIBLE


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux makes copies of a process")
@pytest.mark.parametrize("function", [compare, compare_proofs])
def test_two_processes_find_what_one_finds(function):
    # A test process may have further threads, and is not copied then.
    code = f"from tests.smid.diagnosis.test_in_processes import {function.__name__} as same; same()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
