"""The frame through the loudspeaker, before and after cancellation."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import Any, Final

import numpy as np
from bokeh.models import ColumnDataSource, CustomJS

from vsep._typing import FloatArray
from vsep.inference.core.progress import Step
from vsep_app.assets import path
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.run_session import Snapshot
from vsep_app.jobs.tasks import Prepared, frame_sound
from vsep_app.model.sound import RATE_HZ

RECEIVED, CLEANED = "hear received", "hear cleaned"
NAMES: Final = (RECEIVED, CLEANED)


class Loudspeaker:
    """Plays the frame that is shown when it is asked to.

    Parameters
    ----------
    shown : callable
        Returns the run as it is shown, None while there is none.
    antenna : callable
        Returns the antenna that is shown.
    source : ColumnDataSource
        Part of the page; the sound becomes part of it, too.
    pool, post, background
        Where the sound is made, and what brings it back to the document.
    """

    def __init__(
        self,
        shown: Callable[[], Snapshot[Prepared, Step] | None],
        antenna: Callable[[], int],
        source: ColumnDataSource,
        *,
        pool: Executor,
        post: Callable[[Callable[[], None]], Any],
        background: BackgroundTasks,
    ) -> None:
        self._shown, self._antenna = shown, antenna
        self._pool, self._post, self._background = pool, post, background
        self._number = 0
        self.source = ColumnDataSource({"number": [], "samples": []}, name="sound", syncable=False)
        code = path("page/sound.js").read_text(encoding="utf-8")
        play = CustomJS(args={"sound": self.source, "rate_hz": RATE_HZ}, code=code)
        self.source.js_on_change("data", play)
        source.js_on_change("data", CustomJS(args={"sound": self.source}, code=""))

    def play(self, name: str) -> None:
        """Play what a button is called by, one of `NAMES`."""
        shown = self._shown()
        if shown is not None:
            make = partial(frame_sound, shown, self._antenna(), cleaned=name == CLEANED)
            self._background.begin(self._deliver(make))

    async def _deliver(self, make: Callable[[], FloatArray]) -> None:
        made = await asyncio.get_running_loop().run_in_executor(self._pool, make)
        self._post(partial(self._send, made))

    def _send(self, made: FloatArray) -> None:
        # Without the number the same sound again would be no change.
        self._number += 1
        self.source.data = {"number": [self._number], "samples": [made.astype(np.float32)]}
