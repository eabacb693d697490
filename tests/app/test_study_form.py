import asyncio

import pytest
from vsep_app.pages.studies.form import StudyForm

from vsep import InputError
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.study import TrialSettings


async def refuse(name, content):
    pytest.fail(f"{name} was not chosen, {len(content)} bytes")


@pytest.fixture
def form():
    """The side bar as it opens."""
    return StudyForm(refuse, own_folder=True)


def test_the_form_makes_the_study_that_is_asked_for(form, tmp_path):
    form.study_name.value = "fig-5"
    form.panels.value = ["5d-f", "5-edges"]
    form.methods.value = ["no-interference", "factorised"]
    form.realizations.value, form.seed.value = 7, 3
    study = form.study()
    assert (study.name, study.realizations, study.settings.seed) == ("fig-5", 7, 3)
    assert study.methods == ("factorised", "no-interference")
    assert {study.points[index].panel for index in study.point_indices} == {"5d-f", "5-edges"}
    assert study.points == CATALOGUE["fig-5"].points
    assert form.path(tmp_path) == tmp_path / "fig-5-seed-3-robust.jsonl"
    form.threshold.value = "12.5"
    assert {point.object_threshold_db for point in form.study().points} == {12.5}
    assert form.path(tmp_path).name == "fig-5-seed-3-robust-threshold-12.5.jsonl"


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_study_can_be_chosen_and_examples_are_few(form, name):
    form.study_name.value = name
    study = form.study()
    assert study.name == name
    assert study.methods == make_study(name).methods
    if CATALOGUE[name].example:
        assert study.realizations == 1
        form.realizations.value = 50
        with pytest.raises(InputError, match="between 1 and 4"):
            form.study()


def test_a_study_that_is_taken_is_the_one_that_is_made(form):
    settings = TrialSettings(seed=9, schedule="paper", gospa_cutoff=2.0, gospa_order=2.0)
    study = make_study(
        "separability",
        realizations=31,
        methods=("joint", "no-interference"),
        selection="simulation-2",
        settings=settings,
        object_threshold_db=9.123456789,
    )
    form.take(study)
    assert form.study() == study
    form.take(make_study("fig-2"))
    assert form.study().points == CATALOGUE["fig-2"].points


def test_what_is_missing_or_out_of_range_is_one_sentence(form, tmp_path):
    form.folder.value = str(tmp_path / "gone")
    with pytest.raises(InputError, match="gone is not there"):
        form.path(tmp_path)
    form.threshold.value = "high"
    with pytest.raises(InputError, match="'high'; it must be a number or empty"):
        form.study()
    form.threshold.value = ""
    form.workers.value = 5000
    with pytest.raises(InputError, match="Processes is 5000"):
        form.study()
    form.workers.value = None
    with pytest.raises(InputError, match="Processes is empty"):
        form.study()
    form.workers.value, form.methods.value = 1, []
    with pytest.raises(InputError, match="at least one"):
        form.study()
    form.panels.value = []
    with pytest.raises(InputError, match="No panel"):
        form.study()


def test_a_small_machine_starts_with_one_process(monkeypatch):
    for cores, workers in ((None, 1), (1, 1), (2, 1), (8, 7)):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        assert StudyForm(refuse, own_folder=True).workers.value == workers


def test_a_visitor_from_outside_chooses_no_folder(tmp_path):
    form = StudyForm(refuse, own_folder=False)
    form.folder.value = str(tmp_path / "other")
    assert form.path(tmp_path).parent == tmp_path
    assert not form.folder.visible


def test_the_same_file_can_be_opened_twice():
    opened = []

    async def load(name, content):
        opened.append((name, content))

    async def choose():
        form = StudyForm(load, own_folder=True)
        for _ in range(2):
            form.upload.param.update(filename="rows.jsonl", value=b"text")
            await asyncio.sleep(0.05)

    asyncio.run(choose())
    assert opened == [("rows.jsonl", b"text")] * 2


def test_every_choice_has_a_name_and_words(form):
    for widget in (form.study_name, form.panels, form.methods, form.realizations, form.seed):
        assert widget.label
        assert widget.description
    for widget in (form.schedule, form.threshold, form.workers, form.folder, form.upload):
        assert widget.label
        assert widget.description
