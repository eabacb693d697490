"""Stage of the live page: what an experiment, an address or a lecturer makes of it."""

from collections.abc import Mapping
from typing import Any

import panel as pn

from vsep.inference.core.progress import Step
from vsep_app.jobs.frame_store import FRAME_KEY
from vsep_app.jobs.tasks import Prepared
from vsep_app.model.picture import Picture
from vsep_app.model.pinned import PinnedRun
from vsep_app.model.settings import LOADED_FRAME, Plan, Settings
from vsep_app.model.trial_link import TRIAL_KEY
from vsep_app.pages.base import PageContext
from vsep_app.pages.live_address import with_start
from vsep_app.pages.live_views import LiveViews, glance_of
from vsep_app.pages.run_page import ScenePage
from vsep_app.server.lesson import Glance
from vsep_app.teaching.experiment import LIVE, Experiment, open_experiment
from vsep_app.teaching.stage_words import with_words, words_of
from vsep_app.teaching.staging import Staging
from vsep_app.widgets.headline import Headline
from vsep_app.widgets.location import set_query


class StagedPage(ScenePage[Plan, Prepared, Step, Picture]):
    """A live page whose parts can be locked, hidden, zoomed, and led."""

    views: LiveViews
    headline: Headline

    def __init__(self, context: PageContext, settings: Settings) -> None:
        super().__init__(context, settings)
        self._pinned: PinnedRun | None = None
        self._words = words_of(context.query)
        self._errors += with_words(Staging(), self._words)[1]
        #: The row above the views, once there is one.
        self.toolbar: Any = None

    def take_view(self, query: Mapping[str, str]) -> bool:
        """Show in place what an address of this page names, unless it names a frame of its own."""
        if {TRIAL_KEY, FRAME_KEY} & query.keys() or self.settings.preset == LOADED_FRAME:
            return False
        query, experiment, _ = open_experiment(with_start(query), self._context.experiments, LIVE)
        self._words = words_of(query)
        self.guide.open(experiment)
        self.stage(experiment)
        self._take_settings(query)
        return True

    def glance(self) -> Glance | None:
        """Return the map after cancellation."""
        return None if self.picture is None else glance_of(self.picture)

    def stage(self, experiment: Experiment | None) -> None:
        """Show the page as an experiment and the address want it; without them as usual."""
        staging = experiment.staging if experiment is not None else Staging()
        staging = with_words(staging, self._words)[0]
        self.controls.lock(staging.lock, staging.hide)
        if self.toolbar is not None:
            self.toolbar.visible = "toolbar" not in staging.hide
        self.views.stage(staging)

    def pin(self, *, wanted: bool) -> None:
        """Keep what is shown as a ghost in the views of other runs, or let it go."""
        picture, prepared_run = self.picture, self.session.prepared_run
        if picture is None or prepared_run is None:
            return
        self._pinned = PinnedRun(plan=prepared_run.plan, picture=picture) if wanted else None
        with pn.io.hold():
            self.views.pinned.pin(picture if wanted else None, picture)
            self.tell_pinned(picture)

    def tell_pinned(self, picture: Picture) -> None:
        """Say what is pinned; else offer it once there is something to pin."""
        sentence = "" if picture.iteration else None
        prepared_run = self.session.prepared_run
        if self._pinned is not None and prepared_run is not None:
            sentence = self._pinned.told_beside(prepared_run.plan)
        self.headline.tell_pinned(sentence)

    def _write_words(self) -> None:
        """Keep what locks and hides in the address, which says all that is seen."""
        for key, words in self._words.items():
            set_query(self._context.location, key, words)
