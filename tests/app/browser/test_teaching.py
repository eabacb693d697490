"""Teaching in a headless browser: the flow of an experiment, help, and tables as files."""

import json
import re

import pytest

from tests.app.browser.tab import PATIENCE_MS

pytestmark = pytest.mark.ui


def test_an_experiment_from_choice_to_answer(dashboard):
    dashboard.show("?speed=30").until_status("converged")
    page = dashboard.page
    dashboard.choose("Experiment", "Two cars with the same slope", exact=False)
    outcome = page.get_by_role("button", name="One object: the other radar is taken off")
    outcome.wait_for(timeout=PATIENCE_MS)
    dashboard.until_status("paused")
    assert page.get_by_text("Which one is the car in front of you").count() == 0
    outcome.click()
    page.get_by_text("Not so: 1 of 1 found, 1 false.").wait_for(timeout=PATIENCE_MS)
    page.get_by_text("Which one is the car in front of you").wait_for(timeout=PATIENCE_MS)
    for part in ("experiment=same-slope", "slope=10", "model=convolution"):
        dashboard.until(lambda part=part: part in page.url, f"the address has {part}")
    dashboard.until(
        lambda: page.locator("table.components tbody tr").count() == 2, "two objects are found"
    )
    dashboard.until_status("converged")
    answer = page.get_by_text("No method can tell from this frame")
    assert answer.count() == 0
    # By the keyboard.
    dashboard.button("Show the answer").focus()
    page.keyboard.press("Enter")
    answer.wait_for(timeout=PATIENCE_MS)
    # The control of the question stands in the experiment, above that of the side bar.
    page.get_by_role("slider", name=re.compile("^Interferer slope")).first.focus()
    page.keyboard.press("ArrowLeft")
    dashboard.until(lambda: "slope=9.99" in page.url, "the slider is taken")
    dashboard.button("Start again").click()
    dashboard.until(lambda: "slope=10" in page.url, "the slope is set again")
    outcome.wait_for(timeout=PATIENCE_MS)
    page.reload()
    dashboard.loaded().until_status("paused")
    outcome.wait_for(timeout=PATIENCE_MS)
    assert answer.count() == 0


def test_an_experiment_of_the_compare_page_is_opened_there(dashboard):
    dashboard.show("?speed=30").until_status("converged")
    dashboard.choose("Experiment", "Why zeroing leaves ghosts", exact=False)
    dashboard.page.get_by_role("link", name="Open this experiment on its own page").click()
    dashboard.page.wait_for_selector("table.methods", timeout=PATIENCE_MS)
    dashboard.page.get_by_role("button", name="Zeroing finds dozens").click()
    dashboard.page.get_by_text("Where do dozens of false objects").wait_for(timeout=PATIENCE_MS)
    dashboard.until(
        lambda: "methods=zeroing%2Cmasked%2Cfactorised" in dashboard.page.url, "it is set"
    )


def test_help_opens_and_closes_by_the_keyboard(at_rest):
    page = at_rest.page
    page.get_by_role("button", name=re.compile("^Help")).focus()
    page.keyboard.press("Enter")
    page.get_by_text("What came in during one ramp").wait_for(timeout=PATIENCE_MS)
    for tab, words in (("Glossary", "no unbiased estimator"), ("Controls", "Less: stronger")):
        page.get_by_role("tab", name=tab).click()
        page.get_by_text(words).first.wait_for(timeout=PATIENCE_MS)
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="hidden", timeout=PATIENCE_MS)


def test_table_and_events_are_downloaded(at_rest):
    page = at_rest.page
    for name, place in (("CSV", 0), ("JSON", 1), ("CSV", 0)):
        with page.expect_download(timeout=PATIENCE_MS) as waiting:
            page.get_by_role("button", name=name).nth(place).click()
        text = waiting.value.path().read_text(encoding="utf-8")
        if name == "CSV":
            assert text.splitlines()[0].startswith("component_id,range_m,range_std_m")
            assert len(text.splitlines()) == 2
        else:
            assert waiting.value.suggested_filename == "vsep-events.json"
            assert any(
                "object added at 12.0 m" in one["text"] for one in json.loads(text)["events"]
            )
