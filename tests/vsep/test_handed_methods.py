"""Methods that are not registered, handed to a study as objects, with worker processes."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from vsep import (
    EstimatorEntry,
    FactorisedSeparator,
    InputError,
    MitigationEntry,
    NoFilter,
    ObjectOnlySeparator,
    SignalModel,
    make_mitigation,
    make_study,
    record_study,
    run_trial,
)
from vsep.mitigation.blanking import zeroed
from vsep.mitigation.direct import DirectMitigation
from vsep.studies.methods import read_methods
from vsep.studies.rows import read_rows, study_of_rows

OWN = DirectMitigation("own", zeroed)
BROAD = EstimatorEntry(name="broad", factory=partial(ObjectOnlySeparator, false_alarm_rate=1.0))


class Mine(ObjectOnlySeparator):
    """My estimator."""


def study(*methods, realizations=1):
    return make_study("fig-3", realizations=realizations, methods=methods, selection="15")


def results(row):
    own = ("method", "seconds")
    return repr({key: value for key, value in row.items() if key not in own})


@pytest.mark.parametrize("scale", [1, 2])
def test_a_method_of_ones_own_gives_the_rows_that_a_registered_one_gives(tmp_path, scale):
    both = study("zeroing", OWN, Mine, "object-only", realizations=scale)
    assert both.methods == ("zeroing", "own", "Mine", "object-only")
    path = tmp_path / "rows.jsonl"
    list(record_study(both, path, workers=2))
    rows = read_rows(path)
    assert {row["status"] for row in rows} == {"done"}
    for realization in range(scale):
        here = {row["method"]: row for row in rows if row["realization"] == realization}
        assert results(here["own"]) == results(here["zeroing"])
        assert results(here["Mine"]) == results(here["object-only"])


def test_rows_of_a_method_that_is_not_at_hand_can_still_be_drawn(tmp_path):
    path = tmp_path / "rows.jsonl"
    list(record_study(study(OWN), path))
    assert study_of_rows(read_rows(path), path).methods == ("own",)


def test_settings_that_an_entry_fixes_stay():
    entry = EstimatorEntry(name="paper", factory=partial(FactorisedSeparator, schedule="paper"))
    assert "schedule" not in entry.settings
    (own, *_), (registered, *_) = (
        run_trial(study(method).trial(15, 0)) for method in (entry, "factorised")
    )
    assert own["schedule"] == registered["schedule"] == "robust"
    assert results(own) != results(registered)


def test_the_threshold_of_a_point_reaches_a_class_and_not_what_is_fixed():
    trial = study(Mine, BROAD).trial(15, 0)
    assert trial.point.object_threshold_db == 9.0
    assert "false_alarm_rate" not in BROAD.settings
    assert {row["status"] for row in run_trial(trial)} == {"done"}


@pytest.mark.parametrize(
    ("method", "message"),
    [
        (make_mitigation("zeroing"), "named zeroing, as one of vsep; rename it"),
        (
            Mine(
                model=SignalModel(
                    num_ramps=1, num_samples=8, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
                )
            ),
            "Mine is handed over for one frame size; give its class",
        ),
        (42, "42 is no method"),
        ("magic", "method is 'magic'"),
    ],
)
def test_what_is_no_method_is_refused(method, message):
    with pytest.raises(InputError, match=message):
        read_methods([method])


def test_one_name_for_two_methods_is_refused():
    with pytest.raises(InputError, match="each must be named once"):
        read_methods([OWN, MitigationEntry(name="own", factory=make_mitigation)])


_CELLS = """
import dataclasses, vsep

@dataclasses.dataclass(frozen=True)
class Notebook:
    name: str = "notebook"

    def init(self, received, mask):
        return vsep.MitigationState(iteration=0, cleaned=received)

    def step(self, received, mask, state):
        return vsep.MitigationState(iteration=1, cleaned=received * ~mask)

    def terminate(self, state):
        return vsep.Termination.CONVERGED if state.iteration else vsep.Termination.RUNNING
"""
_RUN = """
study = vsep.make_study(
    "fig-3", realizations=2, methods=(Notebook(), "zeroing"), selection="15"
)
try:
    rows = [row for rows in vsep.record_study(study, "rows.jsonl", workers=2) for row in rows]
    print(sorted((row["method"], row["status"]) for row in rows))
    same = {repr((row["realization"], row["errors"], row["sinr_db"])) for row in rows}
    print(len(same))
except vsep.InputError as error:
    print(error)
"""


def python(tmp_path: Path, *arguments: str) -> str:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    ).stdout


_DONE = f"{sorted([('notebook', 'done'), ('zeroing', 'done')] * 2)}\n2\n"


def test_a_class_of_a_notebook_reaches_the_workers(tmp_path):
    pytest.importorskip("cloudpickle")
    assert python(tmp_path, "-c", _CELLS + _RUN) == _DONE


def test_without_cloudpickle_a_class_of_a_notebook_is_named_with_what_to_do(tmp_path):
    hidden = "import sys; sys.modules['cloudpickle'] = None\n"
    said = python(tmp_path, "-c", hidden + _CELLS + _RUN)
    assert said == (
        "Notebook stands in no module that worker processes can import: put it into one; "
        "sending it along needs cloudpickle: pip install 'vsep[cluster]'.\n"
    )


def test_a_class_of_a_script_needs_nothing(tmp_path):
    body = "\n".join(f"    {line}" for line in _RUN.splitlines())
    script = f"{_CELLS}\nif __name__ == '__main__':\n    import sys\n"
    script += f"    sys.modules['cloudpickle'] = None\n{body}\n"
    (tmp_path / "script.py").write_text(script)
    assert python(tmp_path, "script.py") == _DONE


def test_a_function_inside_of_a_function_reaches_the_workers(tmp_path):
    pytest.importorskip("cloudpickle")

    def repair(received, mask):
        return zeroed(received, mask)

    path = tmp_path / "rows.jsonl"
    list(record_study(study(DirectMitigation("inner", repair)), path))
    assert [row["status"] for row in read_rows(path)] == ["done"]
