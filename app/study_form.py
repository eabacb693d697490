"""What a user chooses of a study: which one, how much of it, with what, and where its rows go."""

import os
from pathlib import Path
from typing import Any

import panel as pn
import panel_material_ui as pmu

from app.layout import heading, small_text
from vsep._arrays import InputError
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.study import Study, TrialSettings

_TIGHT = {"sizing_mode": "stretch_width", "size": "small"}
_MARGIN = (6, 16, 6, 16)
_FIRST_REALIZATIONS = 50
# The largest whole number that a browser keeps exactly.
_HIGHEST_SEED = 2**53 - 1
_NAMES = {name: entry for name, entry in CATALOGUE.items() if not entry.example}


class StudyForm:
    """The side bar of the study page.

    Parameters
    ----------
    own_folder : bool
        Whether the user may choose the folder of the rows.
    """

    def __init__(self, *, own_folder: bool) -> None:
        self.study_name = pmu.Select(
            label="Study", options=list(_NAMES), value="fig-3", margin=_MARGIN, **_TIGHT
        )
        self.title = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 16, 4, 17))
        self.panels = self._choice("Panels")
        self.methods = self._choice("Methods")
        self.realizations = self._number(
            "Realizations a point",
            _FIRST_REALIZATIONS,
            (1, 1_000_000),
            "Scenes drawn at every point; a larger number later goes on from the rows there are.",
        )
        self.seed = self._number(
            "Seed", 1, (0, _HIGHEST_SEED), "Draws all scenes and noise of the study."
        )
        self.schedule = pmu.Select(
            label="Schedule",
            options={"Robust": "robust", "Paper": "paper"},
            value="robust",
            description="Robust: searches bursts anew in early iterations. Paper: literal order.",
            margin=_MARGIN,
            **_TIGHT,
        )
        cores = os.cpu_count() or 1
        self.workers = self._number(
            "Processes", max(1, cores - 1), (1, cores), "More are faster, and slow the live view."
        )
        self.folder = pmu.TextInput(
            label="Results folder",
            placeholder="a temporary one",
            description="Where the rows go and are looked for. A temporary folder is removed when "
            "this page is closed; download the rows to keep them.",
            margin=_MARGIN,
            visible=own_folder,
            **_TIGHT,
        )
        self.study_name.param.watch(self._study_chosen, "value")
        self._study_chosen()

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
            pn.Row(self.seed, self.schedule, sizing_mode="stretch_width"),
            heading("Work"),
            self.workers,
            self.folder,
        ]

    def lock(self, locked: bool) -> None:
        """Hold the choices while a study runs."""
        for widget in (
            self.study_name,
            self.panels,
            self.methods,
            self.realizations,
            self.seed,
            self.schedule,
            self.workers,
            self.folder,
        ):
            widget.disabled = locked

    def study(self) -> Study:
        """Return the study that is asked for.

        Raises
        ------
        InputError
            If nothing is chosen or a number is missing.
        """
        if not self.panels.value:
            raise InputError("No panel is chosen; choose at least one.")
        if self.realizations.value is None or self.seed.value is None:
            raise InputError("The number of realizations and the seed must be given.")
        return make_study(
            self.study_name.value,
            realizations=self.realizations.value,
            methods=tuple(name for name in self.methods.options if name in self.methods.value),
            selection=",".join(self.panels.value),
            settings=TrialSettings(seed=self.seed.value, schedule=self.schedule.value),
        )

    def path(self, temporary: Path) -> Path:
        """Return the file of the rows, one for each study, seed and schedule.

        Raises
        ------
        InputError
            If the chosen folder is not there.
        """
        chosen = self.folder.value.strip() if self.folder.visible else ""
        folder = Path(chosen).expanduser() if chosen else temporary
        if not folder.is_dir():
            raise InputError(f"The results folder {chosen} is not there; make it or name another.")
        name = f"{self.study_name.value}-seed-{self.seed.value}-{self.schedule.value}.jsonl"
        return folder / name

    def _study_chosen(self, *_: Any) -> None:
        entry = _NAMES[self.study_name.value]
        panels = list(dict.fromkeys(point.panel for point in entry.points()))
        methods = list(make_study(entry.name).methods)
        self.title.object = small_text(entry.title)
        self.panels.param.update(options=panels, value=panels[:1])
        self.methods.param.update(options=methods, value=methods)

    def _choice(self, label: str) -> Any:
        return pmu.CheckButtonGroup(
            label=label,
            options=[],
            value=[],
            orientation="vertical",
            sizing_mode="stretch_width",
            size="small",
            margin=(2, 16, 4, 16),
        )

    def _number(self, label: str, value: int, bounds: tuple[int, int], text: str) -> Any:
        return pmu.IntInput(
            label=label,
            value=value,
            start=bounds[0],
            end=bounds[1],
            description=text,
            margin=_MARGIN,
            **_TIGHT,
        )
