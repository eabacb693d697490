"""Estimator with the joint posterior q(alpha, beta) of all weights (footnote 4).

Objects and interference share ``q(alpha, beta)``, so that their posterior correlation is kept. The
updates are those of the factorised algorithm, on the received signal itself: the other source is
not subtracted but stands among the columns. The price is a covariance of all components at once.
"""

from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import ComplexArray
from vsep.inference.core.elbo import noise_bound, weights_bound
from vsep.inference.core.estimator import EstimatorEntry, require_one_antenna, require_stationary
from vsep.inference.core.progress import IterationInfo
from vsep.inference.core.state import SeparationState
from vsep.inference.core.stopwatch import BURSTS, OBJECTS, part
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.joint_columns import JointColumns
from vsep.inference.objects.workspace import ObjectThreshold, ObjectWorkspace
from vsep.units import from_db


@dataclass(frozen=True, kw_only=True, slots=True)
class JointSeparator(FactorisedSeparator):
    """Algorithm 1 with the joint posterior q(alpha, beta); settings as `FactorisedSeparator`.

    It takes one antenna.
    """

    def __post_init__(self) -> None:
        """Check the settings."""
        FactorisedSeparator.__post_init__(self)
        require_one_antenna(self.model, "joint")
        require_stationary(self.model, "joint")

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One main iteration: interference, lambda, objects, lambda, all on one posterior."""
        received = state.corrected(received)
        interference, searched, weights = self.prepare(received, state)
        used, num_used = received, received.size
        if weights is not None:  # one posterior has no step of its own for the objects: all or none
            explained = state.object_signal + state.interference_signal
            used = np.where(weights.counted, received, explained)
            num_used = weights.num_counted
        with part(BURSTS):
            # One posterior of alpha and beta: C and mean of [Phi, U Psi]
            columns = JointColumns(used, state.objects, interference, state.noise_precision)
            columns.update()  # Algorithm 2, the objects among the columns

        # lambda from (65), one trace for both sources
        noise_precision = num_used / columns.expected_error()
        # Algorithm 3 on r itself: the channel columns are not subtracted but stand beside the
        # objects.
        objects = ObjectWorkspace(
            state.objects,
            used,
            noise_precision,
            threshold=ObjectThreshold(float(from_db(self.threshold_db)), state.relative_noise),
            next_id=state.next_component_id,
            background=columns.background(),
        )
        with part(OBJECTS):
            objects.add_components(interference.schedule.object_additions(state.iteration))
            objects.update_components(jointly=interference.schedule.joint_object_step)
        # The posterior once more, with the objects where they are now and the next lambda
        columns = JointColumns(used, objects.components(), interference, noise_precision)
        columns.noise_precision = num_used / columns.expected_error()
        columns.rebuild()
        columns.take_over()  # each ramp's block of beta and C_beta
        objects.placed = replace(objects.placed, active=columns.active)

        active, noise_precision = columns.active, columns.noise_precision
        # (19) with one factor q(alpha, beta)
        bound = weights_bound(
            active.amplitudes,
            np.diagonal(active.covariance).real,
            active.precisions,
            active.log_determinant,
        )
        bound += noise_bound(num_used, noise_precision, columns.expected_error())
        share = num_used / received.size
        end = self.conclude(
            state, objects, interference, noise_precision, bound, searched, used, share
        )
        return self.confirmed(received, *end)


ENTRIES = (
    EstimatorEntry(
        name="joint",
        label="Joint",
        help="Algorithm 1 with one joint posterior of objects and interference.",
        factory=JointSeparator,
        position=20,
    ),
)
