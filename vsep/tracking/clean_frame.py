"""Frame without interference, its objects from where they are predicted.

Nothing is modelled but the objects. They are next to their predicted places, so that one expansion
of the frame around these has all of them; what they leave says whether there is interference, and
whether there is an object more.
"""

import time
from dataclasses import replace

from vsep._typing import ComplexArray
from vsep.inference.core.environment import with_environment
from vsep.inference.core.estimator import is_quiet
from vsep.inference.core.progress import Solution, Termination
from vsep.inference.core.run import run
from vsep.inference.core.schedule import ROBUST
from vsep.inference.core.state import SeparationState
from vsep.inference.core.stopwatch import OBJECTS, part, stopwatch, summed, with_rest
from vsep.inference.objects.nearby import nearby_workspace
from vsep.inference.objects.object_only import (
    ObjectOnlySeparator,
    conclude_objects,
    expected_error,
)
from vsep.tracking.interfered_samples import examined, raised_rows

LOUDER = 1.5  # times the last frame's noise: something may cover most of the samples


def separate_clean(
    separator: ObjectOnlySeparator, received: ComplexArray, predicted: SeparationState
) -> Solution | None:
    """Estimate the objects of a frame that holds no interference.

    Parameters
    ----------
    separator : ObjectOnlySeparator
        Settings, of a model without range migration, with all samples received.
    received : (A P, N) complex
        The frame.
    predicted : SeparationState
        See `vsep.tracking.prediction.predicted_state`.

    Returns
    -------
    Solution or None
        None where something speaks for interference, or the objects are not where they should be.
    """
    began = time.perf_counter()
    threshold = separator.object_threshold(predicted.relative_noise)
    with stopwatch() as parts, part(OBJECTS):
        work = nearby_workspace(
            predicted, received, separator.model, threshold, estimates_noise=True
        )
    if work is None:
        return None
    noise_precision = work.active.noise_precision
    left = received - work.signal
    noise, louder, power = examined(left)
    quiet = noise * predicted.noise_precision < LOUDER
    if not quiet or louder is not None or raised_rows(power, noise).any():
        return None
    with stopwatch() as search, part(OBJECTS):
        work.add_components(ROBUST.object_additions(predicted.iteration))
    if work.next_id != predicted.next_component_id:
        left = received - work.signal
    error = expected_error(left, work.active.trace())
    state = replace(predicted, noise_precision=noise_precision)
    new_state, info = conclude_objects(state, work, work.signal, error, received.size)
    new_state, info = with_environment(predicted, new_state, info, left, separator.model)
    seconds = time.perf_counter() - began
    known = new_state.noise_spectrum is predicted.noise_spectrum
    if known and is_quiet(info):
        parts = with_rest(summed([parts, search]), seconds)
        return Solution(
            state=new_state,
            termination=Termination.CONVERGED,
            infos=(info,),
            seconds=seconds,
            seconds_by_part=parts,
        )
    rest = run(separator, received, new_state)
    return replace(rest, infos=(info, *rest.infos), seconds=rest.seconds + seconds)
