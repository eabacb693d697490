"""Range-Doppler before and after, and beside them that of a clean recording."""

from bokeh.models import ColumnDataSource, Span

from vsep_app.model.static_picture import ByteArray, StaticPicture
from vsep_app.views.range_doppler import RangeDopplerView, empty_image, image_box
from vsep_app.views.style import Axis


class RecordingMaps:
    """Three maps with the same axes, levels and marks.

    Parameters
    ----------
    x_axis : Axis
        Range axis, shared with the delay view.
    crosshair : Span
        Line at the pointer, shared with the delay view.
    """

    def __init__(self, x_axis: Axis, crosshair: Span) -> None:
        self.view = RangeDopplerView(x_axis, crosshair)
        self._image: ColumnDataSource = empty_image()
        self.reference = self.view.companion(
            self._image, name="reference", title="Range-Doppler, clean reference"
        )
        self._drawn: ByteArray | None = None

    def show_reference(self, static_picture: StaticPicture, reference: ByteArray | None) -> None:
        """Draw the map of the clean recording; it is sent once."""
        if reference is not None and reference is not self._drawn:
            box = image_box(static_picture.map_ranges_m, static_picture.map_velocities_mps)
            self._image.data = {"image": [reference], **box}
        self._drawn = reference
