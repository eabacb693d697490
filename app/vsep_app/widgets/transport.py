"""Run, pause, step, step back, reset, speed and the slider over all iterations so far."""

from collections.abc import Callable
from typing import Any

import panel as pn
import panel_material_ui as pmu
import param

from vsep.inference.core.progress import Termination
from vsep_app.jobs.run_session import Phase, RunSession
from vsep_app.model.picture import Picture
from vsep_app.model.settings import Settings

_BUTTONS = (
    ("run", "Run", "play_arrow", "contained", "Run: go on with the iterations."),
    ("pause", "Pause", "pause", "outlined", "Pause after the iteration under way."),
    ("step_back", "Back", "skip_previous", "outlined", "Back: show the iteration before."),
    ("step", "Step", "skip_next", "outlined", "Step: compute or show one iteration."),
    ("reset", "Reset", "replay", "outlined", "Reset to iteration 0 of the same scene."),
)
_STATE_WORDS = {
    Termination.CONVERGED: "converged",
    Termination.MAX_ITERATIONS: "stopped at the largest number of iterations",
    Termination.NONFINITE: "stopped, no finite value",
}
_NOTHING_COMMITTED = -1


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
        self.speed = pmu.IntSlider(
            label=Settings.param.speed.label,
            start=Settings.param.speed.bounds[0],
            end=Settings.param.speed.bounds[1],
            value=settings.speed,
            size="small",
            description=Settings.param.speed.doc,
            width=170,
            margin=(0, 14),
        )
        self.speed.param.watch(self._speed_set, "value_throttled")
        settings.param.watch(self._show_speed, "speed")

    def show_place(self, iteration: int, num_iterations: int) -> None:
        """Show which iteration is drawn, of how many."""
        self._is_placing = True
        self.scrub.param.update(end=max(num_iterations, 1), value=min(iteration, num_iterations))
        self._is_placing = False
        self._forget_the_committed()

    def refresh_buttons(self) -> None:
        """Offer what the session can do."""
        session, phase = self._session, self._session.phase
        ready = session.opening is not None
        over = phase is Phase.FINISHED
        self.buttons["run"].disabled = not ready or over or phase is Phase.RUNNING
        self.buttons["pause"].disabled = phase is not Phase.RUNNING
        self.buttons["step"].disabled = not ready or over or phase is Phase.RUNNING
        self.buttons["step_back"].disabled = not ready or session.cursor == 0
        self.buttons["reset"].disabled = not ready

    def _button(self, name: str, label: str, icon: str, variant: str, text: str) -> Any:
        button = pmu.Button(
            label=label, icon=icon, variant=variant, size="small", description=text, margin=(9, 3)
        )
        button.on_click(lambda _: self._command(name))
        return button

    def _command(self, name: str) -> None:
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

    def _speed_set(self, event: Any) -> None:
        if event.new is not None:
            self._settings.speed = event.new
            self._wake()

    def _show_speed(self, *_: Any) -> None:
        self.speed.value = self._settings.speed


class Transport(RunTransport):
    """The row above the views, and the status in the header."""

    def __init__(
        self, settings: Settings, session: RunSession[Any, Any, Any], wake: Callable[[], None]
    ) -> None:
        super().__init__(settings, session, wake)
        self.mode = pmu.Select(
            label="Fast time shows",
            options={"Level": "level", "Real part": "real"},
            value=settings.fast_time,
            size="small",
            description=Settings.param.fast_time.doc,
            width=130,
            margin=(7, 4, 0, 4),
        )
        self.mode.param.watch(self._mode_set, "value")
        self.ramp = pmu.IntInput(
            label="Ramp",
            start=0,
            value=settings.ramp,
            size="small",
            description=Settings.param.ramp.doc,
            width=104,
            margin=(7, 4, 0, 4),
        )
        self.ramp.param.watch(self._ramp_set, "value")
        self.antenna = pmu.Select(
            label="Antenna",
            options={"0": 0},
            value=0,
            size="small",
            description=Settings.param.antenna.doc,
            width=100,
            margin=(7, 4, 0, 4),
            visible=False,
        )
        self.antenna.param.watch(self._antenna_set, "value")
        settings.param.watch(self._show_settings, ["fast_time", "ramp", "antenna"])
        self._drawn: Picture | None = None

    def layout(self, stylesheet: str) -> Any:
        """Return the row."""
        return pn.Row(
            *self.buttons.values(),
            self.speed,
            self.scrub,
            self.ramp,
            self.antenna,
            self.mode,
            sizing_mode="stretch_width",
            styles={"min-height": "52px"},
            margin=(2, 3, 0, 3),
            align="center",
            stylesheets=[stylesheet],
        )

    def show(self, picture: Picture, rate: float) -> None:
        """Show where the run is; called with the document locked."""
        self.show_place(picture.iteration, picture.num_iterations)
        last_ramp = picture.static_picture.radar.num_ramps - 1
        self.ramp.param.update(end=max(last_ramp, 1), visible=last_ramp > 0)
        opening = self._session.opening
        if opening is not None:
            self._offer_antennas(opening.num_antennas)
        self.refresh(rate, picture)

    def refresh(self, rate: float, picture: Picture | None = None) -> None:
        """Show the state of the session, with what is drawn: this picture, or the one before it."""
        self.refresh_buttons()
        if picture is not None:
            self._drawn = picture
        drawn = self._drawn
        if drawn is not None and drawn.run_number != self._session.run_number:
            drawn = None
        self.status.object = _status_html(self._session.phase, drawn, rate)

    def _offer_antennas(self, number: int) -> None:
        if number != len(self.antenna.options):
            self.antenna.param.update(
                options={str(place): place for place in range(number)},
                value=min(self._settings.antenna, number - 1),
                visible=number > 1,
            )

    def _antenna_set(self, event: Any) -> None:
        if event.new is not None:
            self._settings.antenna = event.new

    def _mode_set(self, event: Any) -> None:
        self._settings.fast_time = event.new

    def _ramp_set(self, event: Any) -> None:
        if event.new is not None:
            self._settings.ramp = min(max(event.new, 0), self.ramp.end or 0)

    def _show_settings(self, *_: Any) -> None:
        self.ramp.value = self._settings.ramp
        self.mode.value = self._settings.fast_time
        self.antenna.value = min(self._settings.antenna, len(self.antenna.options) - 1)


def _status_html(phase: Phase, picture: Picture | None, rate: float) -> str:
    words = phase.value
    counts = ""
    if picture is not None:
        words = _STATE_WORDS.get(picture.termination, words)
        found = len(picture.objects.ranges_m)
        noun = "object" if found == 1 else "objects"
        counts = f"iteration {picture.iteration} of {picture.num_iterations} · {found} {noun}"
        if phase is Phase.RUNNING and rate > 0.0:
            counts += f" · {rate:.1f} iterations/s"
    return (
        f'<span><strong role="status">{words}</strong>'
        f'<span class="counts">&nbsp; {counts}</span></span>'
    )
