"""First pictures of runs, kept for the next visitor of the same scene."""

import asyncio
from collections import OrderedDict
from concurrent.futures import Executor
from typing import NamedTuple

from vsep.errors import InputError
from vsep_app.jobs.tasks import preview
from vsep_app.model.crossing import ALL_RAMPS
from vsep_app.model.picture import Picture
from vsep_app.model.settings import LOADED_FRAME, Plan
from vsep_app.views.opening import opening_html

MOST_KEPT = 12


class FirstPicture(NamedTuple):
    """A picture before the first iteration, and the same as plain HTML."""

    picture: Picture
    html: str


class FirstPictures:
    """Pictures of the scenes that were opened lately; the first visitor of a scene has none."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Plan, FirstPicture] = OrderedDict()
        self._under_way: set[Plan] = set()

    def get(self, plan: Plan) -> FirstPicture | None:
        """Return the first picture of ramp 0 of a plan, if it is there."""
        found = self._kept.get(plan)
        if found is not None:
            self._kept.move_to_end(plan)
        return found

    async def make(self, plan: Plan, pool: Executor) -> None:
        """Have the picture of a plan made, unless it is there or under way."""
        if plan.preset == LOADED_FRAME or plan in self._kept or plan in self._under_way:
            return
        self._under_way.add(plan)
        try:
            loop = asyncio.get_running_loop()
            view = 0, "level", 0, ALL_RAMPS
            picture = await loop.run_in_executor(pool, preview, plan, None, 0, *view)
            self._kept[plan] = FirstPicture(picture, opening_html(picture))
            while len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)
        except InputError:
            return  # The page says it.
        finally:
            self._under_way.discard(plan)
