"""Help: no control without words, and the documents of the dialog."""

import re
from concurrent.futures import ThreadPoolExecutor

import panel as pn
import pytest
from vsep_app.assets import path
from vsep_app.model.settings import Settings
from vsep_app.pages.base import PageContext
from vsep_app.pages.compare.page import ComparePage
from vsep_app.pages.live import Dashboard
from vsep_app.pages.street.page import StreetPage
from vsep_app.pages.studies.page import StudyPage
from vsep_app.teaching.help import Help, controls_html, controls_of

# What is measured in something names its unit in label or text; these are numbers of things.
COUNTED = {"Antenna", "Iteration", "Seed", "Ramp", "Iteration limit"}
EQUATIONS = ("snr_db", "sir_db", "interferer_slope", "filter_cutoff", "filter_rolloff")
EQUATIONS += ("filter_order", "assumed_cutoff", "assumed_order", "false_alarm_rate")
EQUATIONS += ("object_threshold_db",)


@pytest.fixture(params=[Dashboard, StreetPage, ComparePage, StudyPage])
def page(request):
    with ThreadPoolExecutor(1) as pool:
        context = PageContext(pool=pool, query={}, post=lambda f: f(), watched=lambda: True)
        opened = request.param(context)
        yield opened.page()
        opened.close()


def test_every_control_has_a_label_and_a_tooltip(page):
    controls = list(controls_of([*page.sidebar, *page.main, *page.header]))
    assert len(controls) >= 15
    for widget in controls:
        assert widget.label, widget
        assert len(widget.description or "") > 15, widget.label


def test_the_list_of_controls_holds_each_of_them(page):
    listed = controls_html([*page.sidebar, page.main[0]])
    for widget in controls_of(page.sidebar):
        assert f"<dt>{widget.label}</dt>" in listed


def test_sliders_name_their_unit():
    dashboard_words = {
        parameter.label: f"{parameter.label} {parameter.doc}"
        for parameter in Settings.param.objects().values()
        if parameter.doc and hasattr(parameter, "bounds")
    }
    for label, words in dashboard_words.items():
        if label not in COUNTED:
            assert re.search(r"\[.+\]|MHz|dB|no unit|number of|Order|order", words), label


@pytest.mark.parametrize("name", EQUATIONS)
def test_the_words_of_a_quantity_hold_its_equation(name):
    assert re.search(r"log₁₀|[|/=√]|exp|roll-off\)", Settings.param[name].doc)


def test_the_dialog_opens_by_its_button():
    guidance = Help(lambda: [pn.Column()])
    assert not guidance.dialog.open
    guidance.button.clicks += 1
    assert guidance.dialog.open


def test_the_three_views_are_explained_with_equations():
    text = path("help/views.md").read_text(encoding="utf-8")
    for view in ("Fast time", "Delay spectrum", "Range-Doppler map"):
        section = text.split(f"## {view}")[1].split("## ")[0]
        assert len(section) > 400
        assert re.search(r"20 log|Σ|νλ", section)


def test_the_glossary_is_in_order_and_without_twins():
    terms = re.findall(r"^\*\*(.+?)\.\*\*", path("help/glossary.md").read_text(), re.MULTILINE)
    assert terms == sorted(set(terms), key=str.lower)
    assert {"SNR", "SIR", "Ramp", "Burst", "Doppler frequency", "Threshold", "CRLB"} <= set(terms)
