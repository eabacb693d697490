"""Small pictures of the experiments' scenes: what a card shows beside its text."""

import asyncio
import base64
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor

import numpy as np

from vsep.errors import InputError
from vsep.signal.scene import Observation
from vsep_app.jobs.tasks import make_scene
from vsep_app.model.crossing import spectrogram_image
from vsep_app.model.settings import Plan, Settings
from vsep_app.model.static_picture import ByteArray, make_static_picture
from vsep_app.teaching.experiment import Experiment
from vsep_app.teaching.staging import Zoom
from vsep_app.views.opening import png, shown_map

_LARGEST = (20, 64)  # pixels


def card_picture(plan: Plan, zoom: Zoom | None) -> bytes:
    """Return a PNG file of the frame of a plan as received.

    That is the part of its map which the experiment shows, or the spectrogram of its only ramp.

    Raises `InputError` if the plan cannot be carried out.
    """
    frame = make_scene(plan, None).frame
    static_picture = make_static_picture(
        frame.radar, Observation(received=frame.received, truth=frame.truth), title=""
    )
    if frame.radar.num_ramps == 1:
        return png(_smaller(spectrogram_image(frame.received[0])[::-1]), colours=32)
    shown = zoom or Zoom()
    return png(_smaller(shown_map(static_picture, shown.range, shown.velocity)), colours=32)


def _smaller(pixels: ByteArray) -> ByteArray:
    """Keep the strongest pixel of each block, so that no line is lost."""
    for axis, largest in enumerate(_LARGEST):
        starts = np.arange(0, pixels.shape[axis], max(1, -(-pixels.shape[axis] // largest)))
        pixels = np.maximum.reduceat(pixels, starts, axis=axis)
    return pixels


class CardPictures:
    """Pictures of all experiments of a server, once they are made."""

    def __init__(self) -> None:
        self._addresses: dict[str, str] = {}

    @property
    def addresses(self) -> Mapping[str, str]:
        """Data addresses of the pictures by the names of their experiments."""
        return self._addresses

    async def make(self, experiments: Sequence[Experiment], pool: Executor) -> None:
        """Make those that are not there, one after the other."""
        loop = asyncio.get_running_loop()
        for each in experiments:
            if each.name in self._addresses:
                continue
            plan = Settings(**each.settings()).plan()
            try:
                content = await loop.run_in_executor(pool, card_picture, plan, each.staging.zoom)
            except InputError:
                continue  # The page says it when it is opened.
            encoded = base64.b64encode(content).decode()
            self._addresses[each.name] = f"data:image/png;base64,{encoded}"
