"""The compare page in a headless browser: choose, run to the end, step, and drive a sequence."""

import re

import numpy as np
import pytest
from vsep_app.views.tables import MISSING

from tests.app.browser.tab import PATIENCE_MS, Dashboard

pytestmark = pytest.mark.ui
# The largest value of each map by the name of its figure: 0 as long as nothing is drawn.
PEAKS = """() => Object.fromEntries([...Bokeh.documents[0].all_models]
    .filter((m) => m.type === "Figure" && m.name.startsWith("range-doppler-"))
    .map((m) => [m.name, m.renderers.find((r) => r.glyph.type === "Image")])
    .map(([name, r]) => [name, r.data_source.data.image[0].reduce((a, b) => Math.max(a, b), 0)]))"""
# Short runs: what is shown matters here, not what it is worth.
QUICK = "max_iterations=4&speed=30&preset=simulation-2-a"


class Compare(Dashboard):
    """What the tests do with the page."""

    ROUTE = "compare"

    def loaded(self):
        # The first page of a server takes several times as long as the others.
        self.page.wait_for_selector("table.methods", timeout=PATIENCE_MS)
        self.until(lambda: "methods=" in self.page.url, "the address is complete")
        return self

    def show(self, query, *methods):
        super().show(f"?{query}")
        wanted = [*methods, *["none"] * (4 - len(methods))]
        if self.methods() != wanted:
            # No method can be chosen twice, on the way neither.
            spare = next(m for m in ("linear", "iht", "ist") if m not in {*wanted, *self.methods()})
            first, second, *others = enumerate(wanted, 1)
            for number, method in ((4, "none"), (3, "none"), (1, spare), second, first, *others):
                self.choose_method(number, method)
        return self

    def methods(self):
        chosen = [self.page.get_by_role("combobox", name=f"Method {n}") for n in range(1, 5)]
        return [each.inner_text().strip() for each in chosen]

    def choose_method(self, number, method):
        if self.methods()[number - 1] != method:
            self.choose(f"Method {number}", method)
            self.until(lambda: self.methods()[number - 1] == method, f"{method} is chosen")

    def click(self, name):
        self.button(name).click()

    def until(self, condition, what, patience_ms=PATIENCE_MS):
        super().until(condition, what, patience_ms)

    def until_finished(self, *, frame=0):
        self.until(
            lambda: "finished" in self.header and f"frame {frame} of" in self.header,
            f"frame {frame} is finished",
        )

    def rows(self):
        rows = self.page.locator("table.methods tbody tr").all()
        return {
            cells[0]: cells
            for cells in ([*map(str.strip, row.locator("td").all_inner_texts())] for row in rows)
        }


@pytest.fixture
def compare(tab, app_server):
    """The page, with whatever the test before it has left there."""
    return Compare(tab, app_server)


def test_three_chosen_methods_run_to_the_end_side_by_side(compare):
    compare.show(QUICK, "zeroing", "masked")
    compare.choose("Method 1", "mca-2d")
    compare.choose("Method 3", "object-only")
    compare.until(
        lambda: set(compare.rows()) == {"as received", "mca-2d", "masked", "object-only"},
        "the three are in the table",
    )
    compare.until_finished()
    compare.until(lambda: compare.rows()["mca-2d"][1] != "repairs", "the table is the last one")
    rows = compare.rows()
    assert "methods=mca-2d%2Cmasked%2Cobject-only" in compare.page.url
    # A repair of 100 iterations, then the detection; the frame is better than it was by far.
    assert re.fullmatch(r"100 \+ [1-4]", rows["mca-2d"][2])
    assert re.fullmatch("[1-4]", rows["object-only"][2])
    assert all(re.fullmatch(r"\d+", rows[name][4]) for name in ("mca-2d", "masked"))
    assert float(rows["mca-2d"][6]) < float(rows["as received"][6]) - 20.0
    compare.assert_figures_are_on_the_screen(number=5, least_size=100)
    # What one frame has of the curve over frames the table says.
    shown = {f"range-doppler-compare-{name}" for name in ("received", "truth", "0", "1", "2")}
    assert set(compare.figures()) == shown
    peaks = compare.page.evaluate(PEAKS)
    assert all(peaks[name] > 128 for name in shown)


def test_pause_step_and_back_move_all_methods_together(compare):
    compare.show(f"{QUICK}&speed=3", "mca-2d", "iht")
    compare.until(lambda: compare.iteration >= 2, "two iterations are shown")
    compare.click("Pause")
    compare.until(lambda: "paused" in compare.header, "it is paused")
    iteration = compare.iteration
    compare.click("Step")
    compare.until(lambda: f"iteration {iteration + 1} of" in compare.header, "it has stepped")
    compare.until(lambda: compare.rows()["mca-2d"][2] == str(iteration + 1), "the table tells")
    compare.click("Back")
    compare.until(lambda: f"iteration {iteration} of" in compare.header, "it has gone back")
    compare.until(lambda: compare.rows()["mca-2d"][2] == str(iteration), "the table tells")


def test_the_next_frame_knows_what_the_last_one_held(compare):
    compare.show("preset=simulation-2-b&max_iterations=2&speed=30", "pm-ist", "ist")
    compare.until_finished()
    assert compare.rows()["pm-ist"][-1] == "0 peaks"
    compare.click("Next frame")
    compare.until_finished(frame=1)
    compare.until(lambda: compare.rows()["pm-ist"][-1] == "1 peak", "there is a prior")
    compare.until(lambda: "+" in compare.rows()["ist"][2], "the table is the last one")
    rows = compare.rows()
    assert rows["ist"][-1] == MISSING
    # The prior saves iterations of the same repair.
    with_prior, without = (int(rows[name][2].split(" ")[0]) for name in ("pm-ist", "ist"))
    assert with_prior < without
    compare.page.get_by_role("switch", name=re.compile("^Play")).click()
    compare.until(lambda: "frame 3 of" in compare.header, "frames follow by themselves")
    compare.page.get_by_role("switch", name=re.compile("^Play")).click()
    compare.click("First")
    compare.until_finished()
    compare.until(lambda: compare.rows()["pm-ist"][-1] == "0 peaks", "the prior is forgotten")


def test_a_single_ramp_is_compared_by_its_delay_spectrum(compare):
    compare.show("preset=simulation-1&max_iterations=4&speed=30", "linear", "factorised")
    compare.until_finished()
    spectra = {f"compare-profile-{name}" for name in ("received", "truth", "0", "1")}
    compare.until(lambda: set(compare.figures()) == spectra, "the spectra are shown")


def test_what_cannot_be_compared_is_told_and_the_page_goes_on(compare, tmp_path, frame_arrays):
    compare.open(f"?{QUICK}&methods=linear,magic&mask=guess")
    told = compare.page.get_by_text
    told("method is 'magic'; it must be one of").first.wait_for(timeout=PATIENCE_MS)
    told("mask is guess; it must be one of").first.wait_for(timeout=PATIENCE_MS)
    compare.choose("Method 1", "masked")
    told("masked is chosen twice").first.wait_for(timeout=PATIENCE_MS)
    compare.upload("broken.npz", b"no archive")
    told("broken.npz").first.wait_for(timeout=PATIENCE_MS)
    np.savez(tmp_path / "own.npz", **frame_arrays())
    compare.upload("own.npz", (tmp_path / "own.npz").read_bytes())
    told("own.npz holds no truth").first.wait_for(timeout=PATIENCE_MS)
    compare.until(lambda: compare.rows()["as received"][6] == MISSING, "there is no truth")
    compare.until(lambda: "finished" in compare.header, "it is finished")
    assert "frame" not in compare.header
    assert compare.button("Next frame").is_disabled()


def test_the_live_view_leads_here_with_its_scene_by_keyboard(compare, dashboard):
    page = compare.page
    dashboard.show("?preset=simulation-2-c&seed=11&max_iterations=3")
    dashboard.until(lambda: "iteration 3 of 3" in dashboard.header, "the live run has ended")
    page.get_by_role("link", name="Compare").focus()
    page.keyboard.press("Enter")
    compare.loaded()
    assert "/compare?" in page.url
    assert "preset=simulation-2-c" in page.url
    assert "seed=11" in page.url
    compare.until_finished()
