"""The side bar of the page: the files, what the recording is, what is mended, and the estimator."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep.recordings.guess import Guess
from vsep.recordings.readers import READERS
from vsep.recordings.settings import RAW_FORMATS, RecordingSettings
from vsep.recordings.settings_text import values_of, with_value
from vsep_app.pages.recording.files import MAX_FILE, DropZone
from vsep_app.pages.recording.guesses import GuessPictures
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.fields import MARGIN, field, pair
from vsep_app.widgets.layout import heading

_FORMATS = {
    **{reader.label: name for name, reader in READERS.items()},
    "DCA1000, xWR12xx/14xx": "dca1000-xwr14xx",
    "DCA1000, xWR16xx/18xx/68xx": "dca1000-xwr16xx",
    "TDA2, cascaded sensors": "tda2",
    "TSW1400, xWR12xx/14xx": "tsw1400",
    "TSW1400, xWR16xx/18xx/68xx": "tsw1400-xwr16xx",
}
_CHOICES: dict[str, tuple[str, dict[str, str], str]] = {
    "format": (
        "Format",
        _FORMATS,
        "Kind of file. Of raw captures it says in which order the lanes hold the samples.",
    ),
    "sign": (
        "Sign",
        {"Positive": "positive", "Negative": "negative"},
        "Sign of a target's beat frequency in the file. The wrong one puts everything at negative "
        "ranges: the samples are conjugated.",
    ),
    "samples": (
        "Samples",
        {
            "Complex": "complex",
            "Complex 1x": "complex-1x",
            "Complex 2x": "complex-2x",
            "Real": "real",
        },
        "What the converter recorded. Complex 1x has beat frequencies from zero to the sample "
        "rate, 2x both signs; Complex alone lets the echoes tell. Real samples become complex ones "
        "of half the rate.",
    ),
    "offset": (
        "Offset",
        {"If unsigned": "automatic", "Remove": "remove", "Keep": "keep"},
        "Constant offset of the converter, an object at zero range or at the far end: removed "
        "where no value is negative, always or never.",
    ),
    "range_migration": (
        "Range migration",
        {"If visible": "automatic", "Modelled": "modelled", "Neglected": "neglected"},
        "Objects that move through range cells within the frame: one object each, or one cell and "
        "satellites beside it. If visible: where an object of this frame has satellites.",
    ),
}
_NUMBERS: dict[str, tuple[str, str]] = {
    "frame": ("Frame", "Which frame of the file, from 0."),
    "crop_start_samples": (
        "Crop [samples]",
        "Samples left out at the start of every ramp: the receiver's settling transient.",
    ),
    "num_antennas": ("Antennas", "Receive antennas of a raw capture."),
    "num_transmitters": (
        "Transmitters",
        "Transmitters that take turns, ramp by ramp; each makes virtual antennas of its own.",
    ),
}
_LOWEST_BEAT = (
    "Lowest beat",
    "Lower edge of the beat frequencies in cycles per sample: -0.5 for both signs, 0 for one side "
    "of the band. Empty: it follows from the samples.",
)
_RECEIVERS = (
    "Receivers",
    "Receivers to keep, from 0 with commas between, for example 0,2. Empty: all that are not dead.",
)
_DEFAULTS = {each.name: each.default for each in fields(RecordingSettings)}
MAX_TEXT = 4_000  # characters; they are read in a fraction of a second
_TEXT_DOC = (
    "What the file does not say, one name: value a line, as for `vsep convert`. Needed: format, "
    "start_frequency_hz, slope_hz_per_s, sample_rate_hz, ramp_period_s; of raw captures also "
    "num_samples. The controls below write into it."
)


class RecordingForm:
    """The controls; the settings are the text, and the page is told when they change.

    Parameters
    ----------
    controls : Controls
        Those of the estimator.
    changed : callable
        Called when what is to be shown has changed.
    notify_error : callable
        Tells the user what cannot be done.
    drop : mapping of str to callable
        Take names and contents of dropped files: ``recording``, ``response``, ``reference``.
    """

    def __init__(
        self,
        controls: Controls,
        *,
        changed: Callable[[], None],
        notify_error: Callable[[str], None],
        drop: Mapping[str, Callable[[list[tuple[str, bytes]]], None]],
    ) -> None:
        self._controls, self._changed, self._complain = controls, changed, notify_error
        self._showing = False
        self.zones = {
            name: DropZone(take=drop[name], notify_error=notify_error, margin=MARGIN, **look)
            for name, look in _ZONES.items()
        }
        self.text = pmu.TextAreaInput(
            label="Settings",
            description=_TEXT_DOC,
            rows=9,
            max_length=MAX_TEXT,
            margin=MARGIN,
            sizing_mode="stretch_width",
            sx={"& textarea": {"fontFamily": "monospace", "fontSize": "11.5px"}},
        )
        self.text.param.watch(lambda _: self._edited(), "value")
        self.quick = {name: self._choice(name) for name in _CHOICES}
        self.quick |= {name: self._number(name) for name in _NUMBERS}
        lowest = field(pmu.FloatInput, *_LOWEST_BEAT, start=-1.0, end=0.0, step=0.25, value=None)
        receivers = field(pmu.TextInput, *_RECEIVERS, value="", max_length=200)
        for name, widget in (("lowest_beat", lowest), ("antennas", receivers)):
            widget.param.watch(partial(self._take_open, name), "value")
            self.quick[name] = widget
        self.guesses = GuessPictures(self._take_layout)
        self.clutter = field(
            pmu.Switch,
            "No clutter",
            "Leave out what stands still: the median over all ramps, settling transient and "
            "leakage included. Needs 8 ramps.",
            value=False,
        )
        self.clutter.param.watch(self._mended, "value")
        own = controls.widgets["assume_true_filter"]
        own.param.update(
            label="Filter of the file",
            description="The measured response if there is one, else the frame file's filter, else "
            "a raised cosine of a quarter of the sample rate. Off: set the filter by hand.",
        )
        self.save = _button("Save as frame", "save", "Save as frame file (.npz), all antennas.")
        self.live = _button("Open in live view", "open_in_new", "Open in live view, as shown here.")

    def layout(self) -> list[Any]:
        """Return the side bar from top to bottom."""
        pick, quick = self._controls.widgets, self.quick
        return [
            heading("1 · Recording"),
            self.zones["recording"],
            heading("2 · Format"),
            self.guesses.panel,
            self.text,
            quick["format"],
            pair(quick["num_antennas"], quick["num_transmitters"]),
            heading("3 · Corrections"),
            pair(quick["sign"], quick["samples"]),
            pair(quick["lowest_beat"], quick["offset"]),
            pair(quick["crop_start_samples"], quick["frame"]),
            pair(quick["antennas"], quick["range_migration"]),
            self.clutter,
            pn.Row(self.live, self.save, margin=(0, 12), sizing_mode="stretch_width"),
            heading("4 · Separation"),
            self.zones["response"],
            *(pick[name] for name in _FILTER),
            pn.Row(pick["estimator"], pick["schedule"], sizing_mode="stretch_width"),
            *self._controls.thresholds(),
            heading("5 · Comparison"),
            self.zones["reference"],
        ]

    def values(self) -> dict[Any, Any]:
        """Return what the text says.

        Raises `InputError` if it cannot be read.
        """
        text = self.text.value or ""
        if len(text) > MAX_TEXT:
            raise InputError(
                f"The settings have {len(text)} characters; at most {MAX_TEXT} are read."
            )
        return values_of(text)

    def show_text(self, text: str) -> None:
        """Show other settings; the page is not told."""
        self._showing = True
        self.text.value = text
        self._showing = False
        self._show_quick()

    def show_fault(self, sentence: str) -> None:
        """Show at the text that it cannot be used, nothing if it can."""
        self.text.error_state = bool(sentence)

    def show_refused(self, zone: str) -> None:
        """Show that the file of a zone is not used."""
        self.zones[zone].refuse()

    def show_ready(self, ready: bool) -> None:
        """Offer the buttons that need a frame."""
        self.save.disabled = self.live.disabled = not ready

    def _edited(self) -> None:
        if not self._showing:
            self._show_quick()
            self._changed()

    def _mended(self, event: Any) -> None:
        if not self._showing and event.new is not None:
            self._changed()

    def _take(self, name: str, value: Any) -> None:
        """Write the value of a control into the text."""
        if self._showing or value is None:
            return
        try:
            self.text.value = with_value(self.text.value or "", name, value)
        except InputError as error:
            self._complain(str(error))

    def _take_layout(self, guess: Guess) -> None:
        """Write a guessed layout into the text."""
        text = self.text.value or ""
        try:
            for name, value in guess.settings.items():
                text = with_value(text, name, value)
            self.text.value = text
        except InputError as error:
            self._complain(str(error))

    def _take_open(self, name: str, event: Any) -> None:
        """Write the value of a control that may be empty into the text."""
        if self._showing:
            return
        value = None if event.new in ("", None) else event.new
        try:
            if value is not None or name in self.values():
                self.text.value = with_value(self.text.value or "", name, value)
        except InputError as error:
            self._complain(str(error))

    def _show_quick(self) -> None:
        """Show on the controls what the text says, as far as it makes sense."""
        try:
            values = self.values()
        except InputError:
            return
        self._showing = True
        for name, widget in self.quick.items():
            value = values.get(name)
            value = _DEFAULTS[name] if value is None else value
            if name in _OPEN:
                widget.value = _OPEN[name](value)
            elif _suits(name, value):
                widget.value = value
        raw = values.get("format") in RAW_FORMATS
        self.quick["num_antennas"].disabled = not raw
        self._showing = False

    def _choice(self, name: str) -> Any:
        label, options, text = _CHOICES[name]
        select = field(pmu.Select, label, text, options=options)
        select.param.watch(lambda event: self._take(name, event.new), "value")
        return select

    def _number(self, name: str) -> Any:
        label, text = _NUMBERS[name]
        default = _DEFAULTS[name]
        number = field(pmu.IntInput, label, text, start=0, value=default)
        number.param.watch(lambda event: self._take(name, event.new), "value")
        return number


_FILTER = (
    "assume_true_filter",
    "assumed_kind",
    "assumed_cutoff",
    "assumed_rolloff",
    "assumed_order",
)
_ZONES = {
    "recording": {
        "label": "Drop or choose files",
        "description": "Drop or choose files: a recording (.npz, .npy, .mat or a raw capture) and, "
        "with it or later, its settings (.yaml, .json). At most "
        f"{MAX_FILE // 2**20} MB each.",
    },
    "response": {
        "label": "Receiver's response (.npz)",
        "description": "Receiver's response (.npz), as measured by `vsep calibrate`.",
        "accept": ".npz",
    },
    "reference": {
        "label": "Clean recording",
        "description": "Clean recording without interference, of the same kind: its map is shown "
        "beside.",
    },
}


def _beat(value: Any) -> float | None:
    """Return a number as the field of the lowest beat shows it."""
    usual = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if usual and -1.0 <= value <= 0.0 else None


def _receivers(value: Any) -> str:
    """Return a list of receivers as its field shows it."""
    listed = value if isinstance(value, list) else [value]
    return "" if value is None else ",".join(str(each)[:8] for each in listed[:32])


_OPEN: dict[str, Callable[[Any], Any]] = {"lowest_beat": _beat, "antennas": _receivers}


def _suits(name: str, value: Any) -> bool:
    if name in _CHOICES:
        return value in _CHOICES[name][1].values()
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _button(label: str, icon: str, text: str) -> Any:
    return pmu.Button(
        label=label, icon=icon, description=text, variant="outlined", margin=(4, 4), size="small"
    )
