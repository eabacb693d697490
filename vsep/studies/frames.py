"""The frame of one trial as a frame file, to look at an outlier with everything else there is."""

from vsep.files.frame import Frame
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import DRAWN, Trial
from vsep.studies.trial_scenario import simulate_trial


def trial_frame(trial: Trial, method: str) -> Frame:
    """Return the frame that a method of a trial sees.

    Parameters
    ----------
    trial : Trial
        Which scene and noise.
    method : str
        "no-interference" sees the frame without bursts, all others the one with them.

    Returns
    -------
    Frame
        With the truth, and with the filter that the estimators *assume*.

    Examples
    --------
    >>> from vsep.studies.catalogue import make_study
    >>> frame = trial_frame(make_study("fig-3").trial(20, 17), "factorised")
    >>> frame.name, frame.received.shape
    ('fig-3, point 20, realization 17', (1, 256))
    """
    drawn = simulate_trial(trial)
    clean = method == NO_INTERFERENCE
    observation = drawn.clean if clean else drawn.interfered
    settings = {"preset": drawn.preset, "snr_db": repr(trial.point.snr_db)}
    if trial.point.scene in DRAWN:  # which no preset and no setting makes
        settings = {}
    elif not clean:
        settings["sir_db"] = repr(trial.point.sir_db)
    return Frame(
        received=observation.received,
        radar=drawn.scenario.radar,
        anti_aliasing_filter=drawn.model.anti_aliasing_filter,
        truth=observation.truth,
        name=f"{trial.study}, point {trial.point_index}, realization {trial.realization}",
        settings=settings,
    )
