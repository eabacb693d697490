"""What the layers of a map say, in plain words."""

EXPLANATIONS = {
    "whole_db": "Condition (27) over all objects: the norm of &Phi;<sup>H</sup>&Phi;&alpha; over "
    "that of &Phi;<sup>H</sup>U&Psi;&beta;. Above 0 dB (blue) the objects dominate what the object "
    "atoms see, below (red) the bursts do. The strongest object decides.",
    "weakest_db": "Condition (27) object by object, |&alpha;<sub>l</sub>| over "
    "|&phi;<sub>l</sub><sup>H</sup>U&Psi;&beta;|: the smallest of these ratios. Where it is below "
    "0 dB the weakest object is buried.",
    "coherence": "Cosine of the smallest principal angle between the span of the objects' atoms "
    "and that of the bursts. 0: nothing in common; 1: some object signal looks exactly like some "
    "burst. Levels play no part.",
    "bound_loss_db": "How much larger the Cramér-Rao bound on the variance of the objects' "
    "frequencies is because chirp parameters and paths of the bursts are unknown. Levels play no "
    "part.",
    "detection": "Share of the true objects that the estimator found within a resolution cell. "
    "Trials fill the map from coarse to fine.",
    "rmse_over_crlb": "Root mean squared error of the objects that were found over the root of the "
    "bound. About 1: as good as it gets.",
    "false_alarms": "Objects found where there is none, a frame.",
}
CONTOURS = (
    "Lines: condition (27) at equality, over all objects (solid) and for the weakest (dashed)."
)
