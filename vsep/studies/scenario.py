"""Scenario that the methods of a trial are compared on, and its bounds."""

from dataclasses import dataclass, replace

from vsep.analysis.burst_model import model_bursts
from vsep.analysis.crlb import DispersionBound, dispersion_bound
from vsep.presets.scenes import Scenario
from vsep.signal.scene import GroundTruth, Observation
from vsep.signal.template import SignalModel


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrialScenario:
    """What the methods of a trial are compared on."""

    preset: str  #: which scene of Table I, or the noise scene's name
    scenario: Scenario  #: radar, scene and the *true* filter
    #: what the estimators assume: a raised cosine with the roll-off of the preset's, and the
    #: point's cut-off frequency give or take its mismatch
    model: SignalModel
    #: the frame with and without interference, on the same objects and noise
    interfered: Observation
    clean: Observation
    #: where every method stops at the latest, where a scene is no set of points; else as usual
    max_iterations: int | None = None

    @property
    def truth(self) -> GroundTruth:
        """What the interfered frame is made of."""
        truth = self.interfered.truth
        assert truth is not None  # simulated
        return truth

    def bounds(self) -> tuple[DispersionBound, DispersionBound]:
        """Cramer-Rao bounds with everything unknown, and with the interference known."""
        true_model = replace(self.model, anti_aliasing_filter=self.scenario.anti_aliasing_filter)
        bursts = model_bursts(
            self.scenario.radar,
            self.scenario.scene.interferers,
            true_model,
            self.truth.interference_signal,
        )
        known = dispersion_bound(self.truth, true_model)
        unknown = dispersion_bound(self.truth, true_model, bursts) if bursts else known
        return unknown, known
