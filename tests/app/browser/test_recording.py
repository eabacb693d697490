"""The page of recorded data in a headless browser: drop files, mend, separate, hand over."""

import io
import re

import pytest
from vsep_app.cli.main import main

from tests.app.browser.tab import PATIENCE_MS, Dashboard
from vsep.files.frame import read_frame

pytestmark = pytest.mark.ui
RECORDING, RESPONSE, REFERENCE = range(3)
WIDE_ENOUGH = """(name) => [...Bokeh.documents[0].all_models]
  .filter((m) => m.name === name && m.type === "Figure")
  .map((m) => Bokeh.index.find_one_by_id(m.id))
  .some((view) => view && view.el.getBoundingClientRect().width > 40)"""

# What is drawn beyond the edge inside of a figure is cut off there: `bk-GlyphRenderer` boxes.
BEYOND_THE_EDGE = """() => {
  const beyond = []
  const look = (root) => {
    for (const each of root.querySelectorAll("*")) {
      const box = each.getBoundingClientRect()
      if (each.className !== "bk-GlyphRenderer" && box.width > 0 && box.right > innerWidth + 1)
        beyond.push(`${each.tagName} ends at ${box.right}`)
      if (each.shadowRoot) look(each.shadowRoot)
    }
  }
  look(document)
  return beyond
}"""


class Recording(Dashboard):
    """What the tests do with the page."""

    ROUTE = "recording"

    def drop(self, zone, *files):
        """Give the browser files of a name and a content."""
        chosen = [
            {"name": name, "mimeType": "application/octet-stream", "buffer": content}
            for name, content in files
        ]
        self.page.locator("input[type=file]").nth(zone).set_input_files(chosen)


@pytest.fixture
def recording(tab, app_url, app_server):
    """The page, with whatever the test before it has left there."""
    page = Recording(tab, app_server)
    if not tab.shows(f"{app_url}recording"):
        page.open().until_status("ready")
        page.until_told("example (without interference)")
    return page


def test_a_capture_is_mended_separated_saved_and_stored_over(recording, raw_capture):
    page = recording.page
    wrong = raw_capture.text(sign="positive")
    recording.drop(RECORDING, ("radar.yaml", wrong), ("adc.bin", raw_capture.content))
    recording.until_told("is perhaps the other one")
    page.get_by_role("combobox", name=re.compile("^Sign")).click()
    page.get_by_role("menuitem", name="Negative").click()
    recording.until_told("are consistent")
    assert (
        "sign: negative" in page.get_by_role("textbox", name=re.compile("^Settings")).input_value()
    )
    recording.drop(REFERENCE, ("clean.bin", raw_capture.content))
    page.wait_for_function(WIDE_ENOUGH, arg="range-doppler-reference", timeout=PATIENCE_MS)
    # By the keyboard.
    recording.button("Run").focus()
    page.keyboard.press("Enter")
    recording.until_status("converged")
    recording.until(
        lambda: page.locator("table.components tbody tr").count() >= 2, "objects are found"
    )
    assert page.locator("ol.log li.burst").count() >= 1
    for _ in range(2):
        with page.expect_download(timeout=PATIENCE_MS) as waiting:
            recording.button("Save as frame").click()
    assert waiting.value.suggested_filename == "adc-frame.npz"
    frame = read_frame(io.BytesIO(waiting.value.path().read_bytes()))
    assert frame.radar.shape == (16, 128)
    recording.button("Open in live view").click()
    page.wait_for_url(re.compile("frame="), timeout=PATIENCE_MS)
    page.locator("[role=status] >> visible=true", has_text="converged").wait_for(
        timeout=PATIENCE_MS
    )
    assert page.locator("table.components >> visible=true").locator("tbody tr").count() >= 2


def test_files_of_nonsense_are_told_in_a_sentence(recording, raw_capture):
    for zone, name, content, words in (
        (RECORDING, "bad.npz", b"no archive", "bad.npz is not a frame file"),
        (RECORDING, "bad.json", b"{", "bad.json is no JSON"),
        (RECORDING, "empty.bin", b"", "The file is empty"),
        (RESPONSE, "response.npz", b"no archive", "response.npz is not"),
    ):
        recording.drop(zone, (name, content))
        recording.until_told(words)
    settings = raw_capture.text(num_samples="100")
    recording.drop(RECORDING, ("adc.bin", raw_capture.content), ("radar.yaml", settings))
    recording.until_told("which is no whole number of ramps")
    handover = recording.button("Open in live view")
    recording.until(handover.is_disabled, "what cannot be read is not handed over")
    # Counted: pytest would spend minutes on the differences of two texts of megabytes.
    assert recording.page.content().count("Traceback") == 0


@pytest.mark.parametrize("width", [1280, 1024])
def test_nothing_is_wider_than_the_window(recording, width):
    page = recording.page
    recording.tab.resize({"width": width, "height": 800})
    # The row is laid out anew before the views are.
    page.wait_for_function("(width) => innerWidth === width", arg=width, timeout=PATIENCE_MS)
    recording.until(lambda: page.evaluate(BEYOND_THE_EDGE) == [], "all lies inside of the window")
    select = page.get_by_role("combobox", name=re.compile("^Fast time shows"))
    box = select.bounding_box()
    assert box["x"] + box["width"] <= width


def test_a_frame_of_antennas_is_separated_together_and_one_of_them_shown(recording, tmp_path):
    page = recording.page
    array = tmp_path / "array.npz"
    scene = ["--preset", "simulation-2-a", "--antennas", "3", "--snr-db", "50"]
    assert main(["simulate", *scene, "--out", str(array)]) == 0
    recording.drop(RECORDING, ("array.npz", array.read_bytes()))
    recording.until_told("3 antennas, separated together")
    recording.button("Step").click()
    page.get_by_text("angle [°]").first.wait_for(timeout=PATIENCE_MS)
    page.get_by_role("combobox", name=re.compile("^Antenna")).click()
    page.get_by_role("menuitem", name="2").click()
    select = page.get_by_role("combobox", name=re.compile("^Antenna"))
    recording.until(lambda: select.inner_text().strip() == "2", "antenna 2 is chosen")
    # Showing another antenna begins no other run.
    recording.until_status("paused")
