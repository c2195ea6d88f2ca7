"""What once broke a reader is refused now, within seconds; and the fuzzer sees what it is for."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from benchmarks.bad_input_cases import named_cases
from benchmarks.bad_input_files import Case, valid_cases
from benchmarks.bad_inputs import READERS, case_of, judged, report, written
from storage.readers import BadInput
from storage.readers.bad_input import MOST_QUOTED

NAMED = named_cases()
READ_NONETHELESS = {
    ("broken EXIF", "photograph"),
    ("cap.obj", "mesh"),
    ("cap.obj", "scene"),
    ("repeated.obj", "mesh"),
    ("repeated.obj", "scene"),
    ("faces.obj", "mesh"),
    ("faces.obj", "scene"),
    ("library", "scene"),
    ("nodes.glb", "mesh"),
    ("nodes.glb", "scene"),
    ("chain.glb", "mesh"),
    ("chain.glb", "scene"),
}


@pytest.mark.parametrize("case", NAMED, ids=[f"{case.reader}-{case.name}" for case in NAMED])
def test_what_once_broke_a_reader(tmp_path: Path, case: Case) -> None:
    path = written(case, tmp_path / "in")
    begin = time.process_time()
    if (case.name, case.reader) in READ_NONETHELESS:
        READERS[case.reader](path)
    else:
        with pytest.raises(BadInput) as caught:
            READERS[case.reader](path)
        assert re.fullmatch(r".+: .+ is .+; expected .+\.", str(caught.value))
        assert len(caught.value.found) <= MOST_QUOTED
        assert not re.search(r"(.)\1{80}", str(caught.value))
    assert time.process_time() - begin < 5


@pytest.mark.parametrize("case", valid_cases(), ids=lambda case: f"{case.reader}-{case.name}")
def test_the_files_that_are_made_wrong_were_right(tmp_path: Path, case: Case) -> None:
    READERS[case.reader](written(case, tmp_path / "in"))


def test_equal_seeds_make_equal_files_and_others_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the time: zips and colour profiles hold one unless they are told not to."""
    valid = valid_cases()
    inputs = [[case_of(row, 1, [], valid) for row in range(300)]]
    with monkeypatch.context() as later:
        for clock in ("localtime", "gmtime"):
            at = getattr(time, clock)
            later.setattr(time, clock, lambda *_, at=at: at(2_000_000_000))
        inputs += [[case_of(row, seed, [], valid) for row in range(300)] for seed in (1, 2)]
    assert [case.files for case in valid_cases()] == [case.files for case in valid]
    assert inputs[0] == inputs[1]
    same = [one == other for one, other in zip(inputs[0], inputs[2], strict=True)]
    assert sum(same) < 30
    assert {case.reader for case in inputs[0]} == set(READERS) - {"script"}
    assert sum(case in valid for case in inputs[0]) < 30  # hardly any is left as it was


def script(name: str, text: str) -> Case:
    return Case(name, "script", "a.py", {"a.py": text.encode()})


def test_planted_faults_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The readers' errors alone pass; a worker that died or was killed is followed by another."""
    refusal = "from storage.readers import BadInput\nraise BadInput('a', 'b', 'c', 'd')"
    planted = {
        "read": "pass",
        "refused": refusal,
        "key": "{}['missing']",
        "value": "int('x')",
        "crash": "import os\nos.abort()",
        "exit": "raise SystemExit",
        "hang": "import time\ntime.sleep(60)",
        "behind": "pass",
        "last": "pass",
    }
    expected = dict.fromkeys(("read", "behind", "last"), "read")
    expected |= {"refused": "refused", "hang": "hangs"}
    expected |= dict.fromkeys(("key", "value", "crash", "exit"), "wrong_exceptions")
    cases = [script(name, text) for name, text in planted.items()]
    with monkeypatch.context() as quick:
        quick.setattr("benchmarks.bad_inputs.LIMIT_SECONDS", 3.0)
        verdicts = judged(len(cases), 0, cases)
    assert {verdict.case: verdict.kind for verdict in verdicts} == expected
    verdicts += judged(1, 0, [script("memory", "x = b'1' * (9 << 27)")])
    figures = report([verdict._replace(number=row) for row, verdict in enumerate(verdicts)])
    assert figures["bad_inputs"] == 10
    assert (figures["wrong_exceptions"], figures["hangs"], figures["blow_ups"]) == (4, 1, 1)
    offenders = {"key", "value", "crash", "exit", "hang", "memory"}
    assert {row["case"] for row in figures["offenders"]} == offenders
