"""Form of a study: its name, extent, methods, workers and the folder of its rows."""

import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep._validation import require_range
from vsep.analysis.gospa import DEFAULT_CUTOFF, DEFAULT_ORDER
from vsep.errors import InputError
from vsep.parameters import PARAMETERS
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.study import Study, TrialSettings
from vsep_app.widgets.fields import field, file_field, number_field, pair
from vsep_app.widgets.layout import heading, number_or_nothing, small_text

_FIRST_REALIZATIONS = 50
_MAX_REALIZATIONS = 1_000_000
# Of an example every realisation is a picture.
_MAX_EXAMPLES = 4
# The largest integer that a browser keeps exactly.
_MAX_SEED = 2**53 - 1


class StudyForm:
    """The side bar of the study page.

    `load` takes name and content of a file of rows that the user chose; with `own_folder` the user
    may choose the folder of the rows.
    """

    def __init__(self, load: Callable[[str, bytes], Awaitable[None]], *, own_folder: bool) -> None:
        self._load = load
        # What is not shown can still be set by who speaks for a browser.
        self.owns_folders = own_folder
        self.study_name = field(
            pmu.Select,
            "Study",
            "Figures 1, 2, 4, 6 and 7 are pictures of single trials; all others have statistics.",
            options=list(CATALOGUE),
            value="fig-3",
        )
        self.title = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 16, 4, 17))
        self.panels = _choice("Panels", "Parts of the figure to run.")
        self.methods = _choice("Methods", "Each sees the same scenes and noise.")
        self._make_trials()
        self._make_work()
        text = "Look at what `vsep study run` or this page wrote, and go on with it."
        self.upload = file_field("Open rows (.jsonl)", text, ".jsonl")
        self.upload.param.watch(self._uploaded, "value")
        self.study_name.param.watch(self._study_chosen, "value")
        self._study_chosen()

    def _make_trials(self) -> None:
        schedule, threshold = PARAMETERS["schedule"], PARAMETERS["object_threshold_db"]
        self.realizations = number_field(
            "Realizations per point",
            "Scenes drawn at every point; a larger number later goes on from the rows there are.",
            _FIRST_REALIZATIONS,
            *(1, _MAX_REALIZATIONS),
        )
        self.seed = number_field(
            "Seed", "Draws all scenes and noise of the study.", 1, *(0, _MAX_SEED)
        )
        self.schedule = field(
            pmu.Select,
            schedule.form_label,
            schedule.help,
            options={label: name for name, label in (schedule.choices or {}).items()},
            value=schedule.default,
        )
        self.threshold = field(
            pmu.TextInput,
            threshold.form_label,
            "In the place of the study's own thresholds; empty leaves those.",
            placeholder="the study's own",
        )
        self.cutoff = number_field(
            "GOSPA cutoff [cells]",
            "Distance in resolution cells beyond which an object is missed.",
            DEFAULT_CUTOFF,
            *(1e-6, 1e6),
        )
        self.order = number_field(
            "GOSPA order", "Weight of large distances; 1 is plain.", DEFAULT_ORDER, *(1.0, 100.0)
        )

    def _make_work(self) -> None:
        cores = os.cpu_count() or 1
        self.workers = number_field(
            "Processes", "More are faster, and slow the live view.", max(1, cores - 1), *(1, cores)
        )
        self.folder = field(
            pmu.TextInput,
            "Results folder",
            "Where the rows go and are looked for. A temporary folder is removed when this page is "
            "closed; download the rows to keep them.",
            placeholder="a temporary one",
            visible=self.owns_folders,
        )

    def layout(self) -> list[Any]:
        """Return the side bar from top to bottom."""
        return [
            heading("Study"),
            self.study_name,
            self.title,
            self.panels,
            self.methods,
            heading("Trials"),
            self.realizations,
            pair(self.seed, self.schedule),
            self.threshold,
            pair(self.cutoff, self.order),
            heading("Work"),
            self.workers,
            self.folder,
            self.upload,
        ]

    def lock(self, locked: bool) -> None:
        """Hold the choices while a study runs."""
        for widget in (
            *(self.study_name, self.panels, self.methods, self.realizations, self.seed),
            *(self.schedule, self.threshold, self.cutoff, self.order),
            *(self.workers, self.folder, self.upload),
        ):
            widget.disabled = locked

    def study(self) -> Study:
        """Return the study that is asked for.

        Raises `InputError` if nothing is chosen or a number is missing.
        """
        if not self.panels.value:
            raise InputError("No panel is chosen; choose at least one.")
        for widget in (self.realizations, self.seed, self.cutoff, self.order, self.workers):
            if widget.value is None:
                raise InputError(f"{widget.label} is empty; it must be a number.")
            require_range(widget.label, widget.value, widget.start, widget.end)
        try:
            threshold_db = number_or_nothing(self.threshold.value)
        except ValueError as error:
            raise InputError(
                f"{self.threshold.label} is {self.threshold.value!r}; it must be a number or empty."
            ) from error
        return make_study(
            self.study_name.value,
            realizations=self.realizations.value,
            methods=tuple(name for name in self.methods.options if name in self.methods.value),
            selection=",".join(self.panels.value),
            settings=TrialSettings(
                seed=self.seed.value,
                schedule=self.schedule.value,
                gospa_cutoff=self.cutoff.value,
                gospa_order=self.order.value,
            ),
            object_threshold_db=threshold_db,
        )

    def take(self, study: Study) -> None:
        """Show the choices that make a study, with whole panels of it."""
        self.study_name.value = study.name
        chosen = {study.points[index].panel for index in study.point_indices}
        self.panels.value = [panel for panel in self.panels.options if panel in chosen]
        self.methods.param.update(
            options=list(dict.fromkeys([*self.methods.options, *study.methods])),
            value=list(study.methods),
        )
        settings = study.settings
        self.realizations.end = max(self.realizations.end, study.realizations)
        self.realizations.value = study.realizations
        self.seed.value, self.schedule.value = settings.seed, settings.schedule
        self.cutoff.value, self.order.value = settings.gospa_cutoff, settings.gospa_order
        own = study.points == CATALOGUE[study.name].points
        self.threshold.value = "" if own else repr(study.points[0].object_threshold_db)
        # Its rows lie where this page keeps them.
        self.folder.value = ""

    def path(self, temporary: Path) -> Path:
        """Return the file of the rows, one for each study and its settings.

        Raises `InputError` if the chosen folder is not there.
        """
        chosen = self.folder.value.strip() if self.owns_folders else ""
        folder = Path(chosen).expanduser() if chosen else temporary
        if not folder.is_dir():
            raise InputError(f"The results folder {chosen} is not there; make it or name another.")
        words = [self.study_name.value, f"seed-{self.seed.value}", self.schedule.value]
        for value, name, usual in (
            (self.threshold.value.strip(), "threshold", ""),
            (self.cutoff.value, "cutoff", DEFAULT_CUTOFF),
            (self.order.value, "order", DEFAULT_ORDER),
        ):
            if value != usual:
                words.append(f"{name}-{value}")
        return folder / f"{'-'.join(words)}.jsonl"

    def _study_chosen(self, *_: Any) -> None:
        entry = CATALOGUE[self.study_name.value]
        panels = list(dict.fromkeys(point.panel for point in entry.points))
        methods = list(make_study(entry.name).methods)
        self.title.object = small_text(entry.title)
        self.panels.param.update(options=panels, value=panels[:1])
        self.methods.param.update(options=methods, value=methods)
        most = _MAX_EXAMPLES if entry.example else _MAX_REALIZATIONS
        first = entry.realizations if entry.example else _FIRST_REALIZATIONS
        self.realizations.param.update(end=most, value=first)

    async def _uploaded(self, event: Any) -> None:
        if event.new:
            name = self.upload.filename or "rows.jsonl"
            # Forgotten at once, so that the same file can be opened again.
            self.upload.clear()
            await self._load(name, event.new)


def _choice(label: str, text: str) -> Any:
    """Return boxes of which any number may be ticked.

    Not a group of toggle buttons: those are reached by the arrow keys only, and these do not work
    inside the shadow roots in which widgets live.
    """
    return field(
        pmu.CheckBoxGroup, label, text, options=[], value=[], inline=True, margin=(4, 16, 4, 16)
    )
