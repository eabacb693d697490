"""Run, pause, step, step back, reset, speed and the slider over all iterations so far."""

from collections.abc import Callable
from typing import Any

import panel as pn
import panel_material_ui as pmu
import param

from vsep.inference.core.progress import Termination
from vsep_app.jobs.run_session import Phase, RunSession
from vsep_app.model.picture import Picture
from vsep_app.model.settings import SETTINGS, Settings
from vsep_app.model.text import counted
from vsep_app.widgets.fields import tool_button, tool_field
from vsep_app.widgets.layout import toolbar
from vsep_app.widgets.setting_widgets import setting_widget

_BUTTONS = (
    ("run", "Run", "play_arrow", "contained", "Run: go on with the iterations."),
    ("pause", "Pause", "pause", "outlined", "Pause after the iteration under way."),
    ("step_back", "Back", "skip_previous", "outlined", "Back: show the iteration before."),
    ("step", "Step", "skip_next", "outlined", "Step: compute or show one iteration."),
    ("reset", "Reset", "replay", "outlined", "Reset to iteration 0 of the same scene."),
)
_STATE_WORDS = {
    Termination.CONVERGED: "converged",
    Termination.MAX_ITERATIONS: "stopped at the limit",
    Termination.NONFINITE: "stopped, no finite value",
}
_NOTHING_COMMITTED = -1
OPENING_ITERATIONS = 5


class RunTransport:
    """The buttons, the slider over all iterations and the speed of any run.

    Parameters
    ----------
    settings : Settings
        Holds the speed.
    session : RunSession
        What the buttons command.
    wake : callable
        Called after every command.
    """

    def __init__(
        self, settings: Settings, session: RunSession[Any, Any, Any], wake: Callable[[], None]
    ) -> None:
        self._settings, self._session, self._wake = settings, session, wake
        self._is_placing = False
        self._opened_run = -1
        self.status = pn.pane.HTML("", margin=(0, 12), styles={"color": "white"})
        self.buttons = {name: self._button(name, *rest) for name, *rest in _BUTTONS}
        self.scrub = pmu.IntSlider(
            label="Iteration",
            start=0,
            end=1,
            value=0,
            size="small",
            description="Look at any iteration so far; this pauses the run.",
            sizing_mode="stretch_width",
            min_width=140,
            css_classes=["scrub"],
            margin=(0, 18),
        )
        self._forget_the_committed()
        # Not "value": a slow browser sends back values that the run has moved on from, and one of
        # them would hold the run. Since Panel 1.10 (pull request 8712) "value_throttled" follows
        # what the server sets, too: that is no command of the user.
        self.scrub.param.watch(self._scrubbed, "value_throttled")
        self.speed = setting_widget(settings, SETTINGS["speed"])
        self.speed.param.update(width=170, margin=(0, 14), sizing_mode=None)
        settings.param.watch(lambda *_: wake(), "speed")

    @property
    def is_opening(self) -> bool:
        """Whether the run is in the first iterations after it was begun from iteration 0."""
        session = self._session
        return self._opened_run == session.run_number and session.cursor < OPENING_ITERATIONS

    def show_place(self, iteration: int, num_iterations: int) -> None:
        """Show which iteration is drawn, of how many."""
        self._is_placing = True
        self.scrub.param.update(end=max(num_iterations, 1), value=min(iteration, num_iterations))
        self._is_placing = False
        self._forget_the_committed()

    def refresh_buttons(self) -> None:
        """Offer what the session can do."""
        session, phase = self._session, self._session.phase
        ready = session.prepared_run is not None
        over = phase is Phase.FINISHED
        self.buttons["run"].disabled = not ready or over or phase is Phase.RUNNING
        self.buttons["pause"].disabled = phase is not Phase.RUNNING
        self.buttons["step"].disabled = not ready or over or phase is Phase.RUNNING
        self.buttons["step_back"].disabled = not ready or session.cursor == 0
        self.buttons["reset"].disabled = not ready

    def _button(self, name: str, label: str, icon: str, variant: str, text: str) -> Any:
        button = tool_button(label, icon, text, variant=variant)
        button.on_click(lambda _: self._command(name))
        return button

    def command(self, name: str) -> None:
        """Do what a button does, unless it is disabled."""
        if not self.buttons[name].disabled:
            self._command(name)

    def _command(self, name: str) -> None:
        if name == "run" and self._session.cursor == 0:
            self._opened_run = self._session.run_number
        getattr(self._session, name)()
        self._wake()

    def _scrubbed(self, event: Any) -> None:
        if self._is_placing or event.new == _NOTHING_COMMITTED:
            return
        self._forget_the_committed()
        if event.new != self._session.cursor:
            self._session.scrub(int(event.new))
            self._wake()

    def _forget_the_committed(self) -> None:
        """Let the browser commit any iteration: it reports changes only."""
        if self.scrub.value_throttled != _NOTHING_COMMITTED:
            with param.edit_constant(self.scrub):
                self.scrub.value_throttled = _NOTHING_COMMITTED


class Transport(RunTransport):
    """The row above the views, and the status in the header."""

    def __init__(
        self,
        settings: Settings,
        session: RunSession[Any, Any, Any],
        wake: Callable[[], None],
        *,
        with_chirps: bool = False,
    ) -> None:
        super().__init__(settings, session, wake)
        self._with_chirps = with_chirps
        self.mode = setting_widget(settings, SETTINGS["fast_time"])
        self.mode.param.update(
            label="Fast time shows", width=130, margin=(7, 4, 0, 4), sizing_mode=None
        )
        self.chirps = setting_widget(settings, SETTINGS["crossing"])
        self.chirps.param.update(width=130, margin=(7, 4, 0, 4), sizing_mode=None)
        self.antenna = _field(pmu.Select, "antenna", width=100, options={"0": 0}, value=0)
        self._antennas = pn.Row(margin=0, visible=False)
        self.antenna.param.watch(self._antenna_set, "value")
        settings.param.watch(self._show_settings, "antenna")
        self._drawn: Picture | None = None

    def layout(self) -> Any:
        """Return the row."""
        chirps = [self.chirps] if self._with_chirps else []
        choices = self.speed, self.scrub, self._antennas, *chirps, self.mode
        return toolbar(*self.buttons.values(), *choices)

    def show(self, picture: Picture, rate: float) -> None:
        """Show where the run is; called with the document locked."""
        self.show_place(picture.iteration, picture.num_iterations)
        prepared_run = self._session.prepared_run
        if prepared_run is not None:
            self._offer_antennas(prepared_run.num_antennas)
        self.refresh(rate, picture)

    def show_preview(self) -> None:
        """Say that what is drawn is no iteration of a run."""
        self.status.object = run_status_html("preview", "", Phase.PAUSED, 0.0)

    def refresh(self, rate: float, picture: Picture | None = None) -> None:
        """Show the state of the session, with what is drawn: this picture, or the one before it."""
        self.refresh_buttons()
        if picture is not None:
            self._drawn = picture
        drawn = self._drawn
        if drawn is not None and drawn.run_number != self._session.run_number:
            drawn = None
        phase, counts = self._session.phase, ""
        words = phase.value
        if drawn is not None:
            words = _STATE_WORDS.get(drawn.termination, words)
            found = (
                counted(len(drawn.objects.ranges_m), "object")
                if drawn.score is None
                else drawn.score.text
            )
            counts = f"iteration {drawn.iteration} of {drawn.num_iterations} · {found}"
            if drawn.iteration:
                noise_db = round(float(drawn.progress.noise_db[-1])) + 0
                counts += f'<span class="noise"> · noise {noise_db} dB</span>'
        self.status.object = run_status_html(words, counts, phase, rate)

    def _offer_antennas(self, number: int) -> None:
        if number != len(self.antenna.options):
            self.antenna.param.update(
                options={str(place): place for place in range(number)},
                value=min(self._settings.antenna, number - 1),
            )
            self._antennas[:] = [self.antenna] if number > 1 else []
            self._antennas.visible = number > 1

    def _antenna_set(self, event: Any) -> None:
        if event.new is not None:
            self._settings.antenna = event.new

    def _show_settings(self, *_: Any) -> None:
        self.antenna.value = min(self._settings.antenna, len(self.antenna.options) - 1)


def _field(kind: Any, name: str, **options: Any) -> Any:
    """Return a field of the toolbar for a setting that the frame bounds."""
    record = SETTINGS[name]
    return tool_field(kind, record.form_label, record.help, **options)


def run_status_html(words: str, counts: str, phase: Phase, rate: float) -> str:
    """Return the state of a run, how far it is and, while it goes on, how fast."""
    if counts and phase is Phase.RUNNING and rate > 0.0:
        counts += f" · {rate:.1f} iterations/s"
    return (
        f'<span><strong role="status">{words}</strong>'
        f'<span class="counts">&nbsp; {counts}</span></span>'
    )
