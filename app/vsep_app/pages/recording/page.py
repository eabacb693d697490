"""The page of recorded data: what a dropped file is, its frame at once, and its separation."""

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import panel as pn
import param

from vsep.errors import InputError
from vsep.inference.core.progress import Step
from vsep.presets import real_frame
from vsep.recordings.settings import RecordingSettings, parse_settings
from vsep.recordings.settings_text import settings_text
from vsep_app.assets import path
from vsep_app.jobs.frame_store import FRAME_KEY
from vsep_app.jobs.run_loop import RunCallbacks
from vsep_app.jobs.tasks import compact, strip
from vsep_app.model.picture import Picture
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, VIEW_NAMES, Settings
from vsep_app.pages.base import PageContext, PageParts
from vsep_app.pages.recording import tasks
from vsep_app.pages.recording.dropped import completed, is_settings, text_of
from vsep_app.pages.recording.files import DroppedFiles
from vsep_app.pages.recording.folder import FolderPanel
from vsep_app.pages.recording.form import RecordingForm
from vsep_app.pages.recording.stored_file import StoredFile
from vsep_app.pages.recording.tasks import FileFacts, PreparedRecording, RecordingPlan
from vsep_app.pages.recording.view import RecordingView
from vsep_app.pages.run_page import RunPage
from vsep_app.report.spec import KeptFrame
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.download import Download, Link
from vsep_app.widgets.share import MAX_FILE
from vsep_app.widgets.transport import Transport

EXAMPLE = "example (without interference).npz"


class RecordingPage(RunPage[RecordingPlan, PreparedRecording, Step, Picture]):
    """One user's recordings."""

    address = "recording"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, Settings())
        self.settings.choose_preset(LOADED_FRAME)
        self._files = DroppedFiles()
        self._file: StoredFile | None = None
        self._own: dict[str, Any] | None = None
        self._response: StoredFile | None = None
        self._reference: StoredFile | None = None
        self._rate_hz = 0.0
        self._offered_ramp = 0
        self._prepared_run: PreparedRecording | None = None
        self.controls = Controls(self.settings, lambda *_: None)
        self.form = RecordingForm(
            self.controls,
            changed=self._edited,
            notify_error=self.notify_error,
            drop={
                "recording": self.drop,
                "response": self.drop_response,
                "reference": self.drop_reference,
            },
        )
        self.folder = FolderPanel(
            context,
            plan_of=self._plan_of_capture,
            show=self._show_capture,
            notify_error=self.notify_error,
        )
        self.view = RecordingView(self._ramp_selected)
        self._acknowledge(self.view.fast_time.source)
        self._make_loop(
            RunCallbacks(
                prepare=tasks.PREPARE,
                advance=tasks.advance,
                compose=tasks.compose,
                view=self._view,
                compact=compact,
                strip=strip,
            )
        )
        self.transport = Transport(self.settings, self.session, self.loop.wake)
        self._download, self._link = Download(), Link(self.form.live)
        self._download.join(self.form.save)
        self.form.save.on_click(lambda _: self._deliver(self._save, as_shown=False))
        self.form.live.on_click(lambda _: self._deliver(self._open_live, as_shown=True))
        self.form.show_ready(False)
        self.settings.param.watch(lambda *_: self._restart(), list(PLAN_NAMES))
        self.settings.param.watch(lambda *_: self.loop.redraw(), list(VIEW_NAMES))
        self.settings.param.watch(lambda *_: self._antenna_chosen(), "antenna")

    def page(self) -> Any:
        """Return the whole page."""
        views = self.view.layout()
        self.fault.cover(*views)
        return PageParts(
            description="Recordings of real radars: read, checked, and separated.",
            status=self.transport.status,
            sidebar=[*self.form.layout(), *self.folder.layout()],
            main=[self.transport.layout(), self.fault.pane, *views],
        )

    def start(self) -> None:
        """Show the example; called when the page has been drawn."""
        self.loop.start()
        example = StoredFile(path=str(path(real_frame.PRESET.frame_file)), name=EXAMPLE)
        self._take(example, tasks.file_facts(example), None)
        self._restart()

    def close(self) -> None:
        """Stop for good and remove the files: the browser has left."""
        self.folder.close()
        super().close()
        self._files.close()

    def drop(self, files: list[tuple[str, bytes]]) -> None:
        """Take a recording, its settings, or both."""
        settings = [each for each in files if is_settings(each[0])]
        recordings = [each for each in files if not is_settings(each[0])]
        if max(len(settings), len(recordings)) > 1:
            self.notify_error(
                f"{len(files)} files were dropped; one recording and its settings, please."
            )
            return
        self._begin_reading("recording", self._read_recording(settings, recordings))

    def drop_response(self, files: list[tuple[str, bytes]]) -> None:
        """Take a measured response of the receiver."""

        async def read() -> None:
            file = await self._keep(files[0])
            await self._of_worker(file, tasks.REQUIRE_RESPONSE, file)
            self._context.post(partial(take, file))

        def take(file: StoredFile) -> None:
            self._files.discard(self._response)
            self._response = file
            self.settings.assume_true_filter = True
            self._restart()

        self._begin_reading("response", read())

    def drop_reference(self, files: list[tuple[str, bytes]]) -> None:
        """Take a clean recording to show beside; it is read with the recording itself."""

        async def read() -> None:
            file = await self._keep(files[0])
            self._context.post(partial(take, file))

        def take(file: StoredFile) -> None:
            self._files.discard(self._reference)
            self._reference = file
            self._restart()

        self._begin_reading("reference", read())

    async def _keep(self, file: tuple[str, bytes]) -> StoredFile:
        """Write a file to the disk, which may be slow."""
        return await asyncio.to_thread(self._files.keep, *file)

    def _begin_reading(self, zone: str, work: Coroutine[Any, Any, None]) -> None:
        """Read files in the background; a bad one is refused, and nothing else changes."""

        def refuse(sentence: str) -> None:
            self.notify_error(sentence)
            self.form.show_refused(zone)
            self.fault.tell(sentence, shown=self._shown(), stale=False)

        async def read() -> None:
            try:
                await work
            except InputError as error:
                self._context.post(partial(refuse, str(error)))

        self._context.background.begin(read())

    async def _read_recording(
        self, settings: list[tuple[str, bytes]], recordings: list[tuple[str, bytes]]
    ) -> None:
        said: dict[Any, Any] | None = None
        if settings:
            name, text = settings[0][0], text_of(*settings[0])
            said = await self._of_worker(None, tasks.SETTINGS_VALUES, name, text)
        if not recordings:
            self._context.post(partial(self._show_settings, said or {}))
            return
        file = await self._keep(recordings[0])
        facts = await self._of_worker(file, tasks.FILE_FACTS, file)
        self._context.post(partial(self._take_recording, file, facts, said))

    async def _of_worker(
        self, file: StoredFile | None, function: Callable[..., Any], *arguments: Any
    ) -> Any:
        """Have a file read by a worker; it is removed again if it cannot be used."""
        loop = asyncio.get_running_loop()
        try:
            return await loop.run_in_executor(self._context.pool, function, *arguments)
        except InputError:
            self._files.discard(file)
            raise

    def _take_recording(
        self, file: StoredFile, facts: FileFacts, said: Mapping[Any, Any] | None
    ) -> None:
        before = self._file
        self._take(file, facts, said)
        self._files.discard(before)
        fault = self._restart()
        # What a recording does not say of itself is no fault of the user.
        if fault and said is not None:
            self.notify_error(fault)

    def _plan_of_capture(self, file: StoredFile, facts: FileFacts) -> RecordingPlan:
        """Return the plan of a capture that came into the folder; the settings are those shown."""
        said = self.form.values()
        if self._own is not None and parse_settings(said) == parse_settings(self._own):
            raise InputError("Drop the configuration of the captures' sensor first.")
        return self._plan(file, parse_settings(completed(said, facts.suggested)))

    def _show_capture(self, file: StoredFile, facts: FileFacts, plan: RecordingPlan) -> None:
        """Show a capture that came into the folder."""
        said = {name: getattr(plan.settings, name) for name in self.form.values()}
        self._take_recording(file, facts, said)

    def _show_settings(self, said: Mapping[Any, Any]) -> None:
        self.form.show_text(settings_text(said))
        fault = self._restart()
        if fault:
            self.notify_error(fault)

    def show(self, picture: Picture) -> None:
        """Draw a picture; called with the document locked."""
        prepared_run = self.session.prepared_run
        if prepared_run is None:
            return
        self.session.most_kept = self._context.most_kept // len(
            prepared_run.prepared.static_pictures
        )
        with pn.io.hold():
            self.fault.clear(shown=(picture.run_number, picture.iteration))
            self.view.show(picture, prepared_run)
            self.controls.show_threshold(prepared_run.prepared.estimator.threshold_db)
            self.transport.show(picture, self.loop.rate)
            if prepared_run is not self._prepared_run:
                self._take_prepared_run(prepared_run)

    def _take(self, file: StoredFile, facts: FileFacts, said: Mapping[Any, Any] | None) -> None:
        """Begin with a recording and what is known of it."""
        if said is None:
            said = {} if facts.is_frame else self._said_before()
        self._file = file
        self._own = dict(facts.suggested) if facts.is_frame else None
        # Who says how many samples a ramp has knows the layout.
        guesses = facts.guesses if said.get("num_samples") is None else ()
        self.form.guesses.show(guesses)
        guessed = guesses[0].settings if guesses else {}
        self.form.show_text(settings_text(completed(said, {**facts.suggested, **guessed})))

    def _said_before(self) -> Mapping[Any, Any]:
        """Return the settings of the last recording: a sensor often records several files."""
        if self._file is None or self._file.name == EXAMPLE:
            return {}
        try:
            values = self.form.values()
        except InputError:
            return {}
        if self._own is not None:
            values.pop("key", None)
        return values

    def _edited(self) -> None:
        """Take settings that the user has changed."""
        sentence = self._restart()
        if sentence:
            self.notify_error(sentence)

    def _restart(self) -> str:
        """Show what is set now; return what stands in the way."""
        if self._file is None:
            return ""
        try:
            settings = parse_settings(self.form.values())
        except InputError as error:
            self._show_fault(str(error))
            return str(error)
        self._show_fault("")
        self._fit_filter(settings)
        self.session.restart(self._plan(self._file, settings))
        # A frame is shown at once; its separation begins when the user wants it.
        self.session.reset()
        self.loop.wake()
        return ""

    def _antenna_chosen(self) -> None:
        """Begin with another antenna, where one alone is separated."""
        prepared_run = self.session.prepared_run
        if (
            prepared_run is not None
            and len(prepared_run.prepared.static_pictures) < prepared_run.num_antennas
        ):
            self._restart()

    def _show_fault(self, sentence: str) -> None:
        """Say what is wrong with the settings; until it is mended, the last good ones are shown."""
        self.form.show_fault(sentence)
        self.view.show_facts(self._prepared_run, sentence)
        if sentence:
            self.fault.tell(sentence, shown=self._shown())

    def _plan(self, file: StoredFile, settings: RecordingSettings) -> RecordingPlan:
        return RecordingPlan(
            file=file,
            settings=settings,
            is_frame=self._own is not None and settings == parse_settings(self._own),
            antenna=self.settings.antenna
            if tasks.takes_one(self.settings.estimator, settings)
            else 0,
            removes_clutter=bool(self.form.clutter.value),
            response=self._response,
            reference=self._reference,
            scene=self.settings.plan(),
        )

    def _fit_filter(self, settings: RecordingSettings) -> None:
        """Suit the filter's controls to another sample rate."""
        rate_hz = settings.sample_rate_hz * (0.5 if settings.samples == "real" else 1.0)
        if rate_hz != self._rate_hz:
            self._rate_hz = rate_hz
            with param.parameterized.discard_events(self.settings):
                self.controls.fit_frame(rate_hz, measured=False)

    def _take_prepared_run(self, prepared_run: PreparedRecording) -> None:
        """Take note of what has been read."""
        self._prepared_run = prepared_run
        self.view.show_facts(prepared_run, "")
        self.form.show_ready(True)
        if prepared_run.reference_fault:
            self._files.discard(self._reference)
            self._reference = None
            self.notify_error(prepared_run.reference_fault)
        if self.settings.ramp == self._offered_ramp:
            self.settings.ramp = prepared_run.loudest_ramp
        self._offered_ramp = prepared_run.loudest_ramp

    def _failed(self, sentence: str) -> None:
        """Say what cannot be shown; called with the document locked."""
        self.notify_error(sentence)
        if self.session.prepared_run is None:
            self._prepared_run = None
            self.form.show_ready(False)
            self._show_fault(sentence)
        self.transport.refresh(self.loop.rate)

    def _deliver(self, use: Callable[[str, bytes], None], *, as_shown: bool) -> None:
        if self._prepared_run is None:
            return
        plan = self._prepared_run.plan

        async def make() -> None:
            loop = asyncio.get_running_loop()
            work = partial(loop.run_in_executor, self._context.pool, tasks.FRAME_CONTENT)
            name = f"{Path(plan.file.name).stem}-frame.npz"
            try:
                content = await work(plan, as_shown)
            except InputError as error:
                self._context.post(partial(self.notify_error, str(error)))
                return
            self._context.post(partial(use, name, content))

        self._context.background.begin(make())

    def _save(self, name: str, content: bytes) -> None:
        if len(content) > MAX_FILE:
            self.notify_error(f"{name} is too large for the browser; write it with `vsep convert`.")
            return
        self._download.send(name, "application/octet-stream", content)

    def _open_live(self, name: str, content: bytes) -> None:
        word = self._context.shared_resources.frames.keep(KeptFrame(name=name, content=content))
        self._link.open(f"./?{FRAME_KEY}={word}")
