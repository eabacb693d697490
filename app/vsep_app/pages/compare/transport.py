"""Transport of a comparison: the run of all methods, and the frames of the sequence."""

from collections.abc import Callable
from typing import Any

import panel_material_ui as pmu

from vsep_app.jobs.run_session import Phase, RunSession
from vsep_app.model.compare_settings import LAST_FRAME
from vsep_app.model.settings import Settings
from vsep_app.pages.compare.picture import ComparePicture
from vsep_app.widgets.fields import tool_button
from vsep_app.widgets.layout import toolbar
from vsep_app.widgets.transport import RunTransport, run_status_html


class CompareTransport(RunTransport):
    """The row above the maps, and the status in the header.

    Beside those of any run, the buttons of the sequence call `next_frame` and `first_frame`.
    """

    def __init__(
        self,
        settings: Settings,
        session: RunSession[Any, Any, Any],
        wake: Callable[[], None],
        *,
        next_frame: Callable[[], None],
        first_frame: Callable[[], None],
    ) -> None:
        super().__init__(settings, session, wake)
        self._next_frame = next_frame
        self.next = tool_button(
            "Next frame",
            "fast_forward",
            "Next frame: objects have moved on for 50 ms. What pm-ist and pm-iht found "
            "in the last three frames lowers their thresholds. For simulated scenes, once all "
            "methods have finished.",
        )
        text = "First: back to frame 0 without any prior."
        self.first = tool_button("First", "first_page", text)
        self.play = pmu.Switch(
            label="Play frames",
            value=False,
            size="small",
            description="Play: go to the next frame by itself whenever all methods have finished.",
            margin=(12, 4, 0, 8),
        )
        self.next.on_click(lambda _: next_frame())
        self.first.on_click(lambda _: first_frame())
        self.play.param.watch(self._played, "value")
        self._may_go_on = False

    def layout(self) -> Any:
        """Return the row."""
        return toolbar(
            *self.buttons.values(), self.speed, self.scrub, self.next, self.first, self.play
        )

    def show(self, picture: ComparePicture, *, rate: float, has_next: bool) -> None:
        """Show where the run is; called with the document locked."""
        self.show_place(picture.iteration, picture.num_iterations)
        self._may_go_on = has_next
        self.first.disabled = picture.frame_number == 0
        if not has_next and self.play.value:
            self.play.value = False
        self.play.disabled = not has_next
        self.refresh(rate, picture)

    def refresh(self, rate: float, picture: ComparePicture | None = None) -> None:
        """Show the state of the session."""
        self.refresh_buttons()
        phase = self._session.phase
        self.next.disabled = not (self._may_go_on and phase is Phase.FINISHED)
        counts = ""
        if picture is not None:
            counts = f"iteration {picture.iteration} of {picture.num_iterations}"
            if self._may_go_on or picture.frame_number:
                counts += f" · frame {picture.frame_number} of {LAST_FRAME}"
        self.status.object = run_status_html(phase.value, counts, phase, rate)

    def _played(self, event: Any) -> None:
        if not event.new:
            return
        if self._session.phase is Phase.FINISHED:
            self._next_frame()
        else:
            self._command("run")
