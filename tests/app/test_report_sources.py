import pytest
from vsep_app.model.settings import LOADED_FRAME
from vsep_app.model.trial_link import open_trial
from vsep_app.report.run import execute
from vsep_app.report.sources import changed, of_frame, of_link, of_preset, of_rows, of_trial
from vsep_app.report.spec import ReportSpec, default_plan

from vsep.errors import InputError
from vsep.files.frame import write_frame
from vsep.studies.rows import rows_text

LINK = "fig-3/6/0/object-only/1/robust"


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ("?snr=" + "9" * 4000, "snr is 9999"),
        ("?snr=" + "9" * 5000, "has 5005 characters; at most 4096"),
        ("?snr=" + "[" * 3000, "it must be a number between"),
        ("?iteration=1e19", "iteration is 1e19; it must be a whole number"),
        ("?iteration=" + "9" * 3000, "iteration is 9999"),
        ("?x=²&trial=²/²/²", "trial is '²/²/²'"),
        ("http://[::1/?snr=3", "cannot be read"),
    ],
)
def test_a_link_that_cannot_be_used_is_one_short_sentence(link, words):
    with pytest.raises(InputError) as caught:
        of_link(link)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_link_brings_scene_ramp_and_iteration():
    url = "http://127.0.0.1:5006/?preset=simulation-2-a&sir=-30&ramp=4&iteration=3&fast_time=real"
    spec = of_link(url)
    assert (spec.plan.preset, spec.plan.sir_db, spec.plan.snr_db) == ("simulation-2-a", -30.0, 60.0)
    assert (spec.ramp, spec.iteration, spec.fast_time) == (4, 3, "real")


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("snr=loud", "snr is loud"),
        ("iteration=-1", "iteration is -1"),
        ("preset=loaded-frame", "cannot carry a loaded frame"),
        ("trial=fig-3", "must read study/point"),
    ],
)
def test_what_a_link_says_wrongly_is_one_sentence(query, words):
    with pytest.raises(InputError, match=words):
        of_link(f"http://127.0.0.1:5006/?{query}")


def test_a_link_to_a_trial_is_that_trial():
    spec = of_link(f"http://127.0.0.1:5006/?preset=loaded-frame&trial={LINK}")
    assert spec == of_trial(LINK)
    assert spec.plan.preset == LOADED_FRAME
    assert execute(spec).frame.name == "fig-3, point 6, realization 0"


def test_a_row_of_a_study_becomes_the_same_run(study_rows, tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text(rows_text(study_rows))
    run = execute(of_rows(str(path), "6/0/object-only"))
    row = next(r for r in study_rows if (r["point_index"], r["realization"]) == (6, 0))
    assert len(run.steps) == row["iterations"]
    assert run.state.objects.num_components == row["num_objects"]
    for which, words in (("6/99", "has no row"), ("6", "must read POINT"), ("a/b", "must read")):
        with pytest.raises(InputError, match=words):
            of_rows(str(path), which)


def test_a_frame_file_is_kept_whole(tmp_path):
    path = tmp_path / "frame.npz"
    write_frame(path, open_trial(LINK).frame)
    spec = of_frame(str(path))
    assert spec.frame.content == path.read_bytes()
    assert execute(spec).frame.name == str(path)
    with pytest.raises(InputError, match="does not exist"):
        of_frame(str(tmp_path / "absent.npz"))


def test_an_unknown_preset_is_one_sentence():
    with pytest.raises(InputError, match="must be one of simulation-1"):
        of_preset("simulation-9")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"mask": "amplitude"}, "mask is 'amplitude'; factorised takes none; masked does."),
        (
            {"estimator": "object-only", "schedule": "paper"},
            "schedule is 'paper'; object-only takes none; factorised, joint and evidence do.",
        ),
    ],
)
def test_what_the_estimator_does_not_have_is_refused(given, sentence):
    with pytest.raises(InputError) as refusal:
        changed(ReportSpec(plan=default_plan()), given)
    assert str(refusal.value) == sentence


def test_what_is_given_replaces_what_the_source_has():
    base = changed(ReportSpec(plan=default_plan()), {"object_threshold_db": 9.0, "ramp": 2})
    assert (base.plan.object_threshold_db, base.ramp) == (9.0, 2)
    again = changed(base, {"estimator": "masked", "false_alarm_rate": 0.5, "mask": "amplitude"})
    assert (again.plan.object_threshold_db, again.plan.false_alarm_rate) == (None, 0.5)
    assert (again.mask, again.ramp) == ("amplitude", 2)
