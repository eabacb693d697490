"""A run that is pinned: what its picture showed, to be seen beside another run."""

from dataclasses import dataclass

from vsep_app.model.picture import Picture
from vsep_app.model.settings import PLAN_NAMES, SETTINGS, Plan
from vsep_app.model.text import counted

_MOST_NAMED = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class PinnedRun:
    """An iteration of a run that stays in sight."""

    plan: Plan  #: What made it.
    picture: Picture  #: What it showed.

    def told_beside(self, plan: Plan) -> str:
        """Return its score in one sentence, with the settings in which it differs from a plan."""
        picture = self.picture
        found = (
            counted(len(picture.objects.ranges_m), "object")
            if picture.score is None
            else picture.score.text
        )
        noise = f", noise {picture.progress.noise_db[-1]:.0f} dB" if picture.iteration else ""
        with_these = differences(self.plan, plan)
        made = f" with {with_these}" if with_these else ""
        return f"Pinned{made}, iteration {picture.iteration}: {found}{noise}."


def differences(plan: Plan, other: Plan) -> str:
    """Return the settings of a plan that are other ones in another plan, the first few by name.

    Examples
    --------
    >>> from vsep_app.model.settings import Settings
    >>> plan = Settings().plan()
    >>> differences(plan, Settings(sir_db=-5.0).plan())
    'SIR -20 dB'
    """
    told = [
        _told(name, getattr(plan, name))
        for name in PLAN_NAMES
        if getattr(plan, name) != getattr(other, name)
    ]
    more = len(told) - _MOST_NAMED
    return ", ".join(told[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _told(name: str, value: object) -> str:
    record = SETTINGS[name]
    if record.choices is not None:
        words = record.choices.get(str(value), str(value))
    elif isinstance(value, bool):
        words = "on" if value else "off"
    elif isinstance(value, int | float):
        words = f"{value:.6g} {record.unit}".strip()
    else:
        words = str(value) if value else "as usual"
    return f"{record.title} {words}"
