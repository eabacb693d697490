"""Filmstrip of a report for print: three views of some iterations, side by side."""

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from vsep_app.figures.figure_page import (
    add_words,
    draw_delay,
    draw_fast_time,
    draw_map,
    empty_figure_page,
)
from vsep_app.model.picture import Picture


def draw_filmstrip(pictures: Sequence[Picture], settings: Mapping[str, str]) -> Figure:
    """Draw fast time, delay and map of each picture below one another.

    Parameters
    ----------
    pictures : sequence of Picture
        One for every column.
    settings : mapping of str to str
        Listed at the foot.
    """
    page = empty_figure_page()
    several = pictures[0].static_picture.radar.num_ramps > 1
    grid = page.add_gridspec(
        3 if several else 2,
        len(pictures),
        left=0.055,
        right=0.985,
        top=0.885,
        bottom=0.115,
        hspace=0.42,
        wspace=0.24,
    )
    for column, picture in enumerate(pictures):
        top, *lower = (page.add_subplot(grid[row, column]) for row in range(grid.nrows))
        draw_fast_time(top, picture, legend=False)
        draw_delay(lower[0], picture, legend=False)
        if several:
            draw_map(lower[1], picture, before=False)
        for axes in (top, *lower) if column else ():
            axes.set_ylabel("")
        count = len(picture.objects.ranges_m)
        top.set_title(
            f"Iteration {picture.iteration}: {count} {'object' if count == 1 else 'objects'}\n"
            f"Fast time, ramp {picture.ramp}",
            loc="left",
            fontsize=9,
        )
    add_words(page, pictures[-1], settings)
    return page
