"""Claims of the source on compressive sensing with 2-D masked residual updates.

Its excerpt has no table of results: what it says of the algorithms is measured on sequences of ten
moving objects at 0 dB a sample with half of every ramp lost, Q = 3.
"""

from math import inf
from typing import Final

from vsep.reproduction.claims import Claim, Limits

_THREE_FRAMES: Final[dict[str, Limits | str]] = {
    "num_prior_frames": (3.0, 3.0),
    "share_lost": (0.5, 0.5),
    "prior": "own",
    "prior_source": "recovered",
}
_FRAME: Final[dict[str, Limits | str]] = {
    "num_ramps": (256.0, 256.0),
    "num_samples": (128.0, 128.0),
}

CLAIMS: Final = (
    Claim(
        figure="mru-prior",
        section="3.3.1",
        says="Iterations of soft thresholding without a prior, to half a dB of where it ends.",
        claimed=(6.0, 9.0),
        method="ist",
        metric="iterations_to_plain",
        where=_THREE_FRAMES,
        remark="To be compared with the next line.",
    ),
    Claim(
        figure="mru-prior",
        section="3.3.1",
        says="The prior helps to reduce the number of iterations: to the same accuracy.",
        claimed=(0.0, 5.0),
        method="pm-ist",
        metric="iterations_to_plain",
        where=_THREE_FRAMES,
    ),
    Claim(
        figure="mru-prior",
        section="3.3.1",
        says="Error in the gaps of soft thresholding without a prior.",
        claimed=(-16.0, -13.0),
        method="ist",
        metric="gap_error_db",
        where=_THREE_FRAMES,
        remark="To be compared with the next two lines.",
    ),
    Claim(
        figure="mru-prior",
        section="3.3.1",
        says="The prior reduces the reconstruction error.",
        claimed=(-inf, -16.5),
        method="pm-ist",
        metric="gap_error_db",
        where=_THREE_FRAMES,
        remark="A least-squares fit of the cells found gains as much without any history.",
    ),
    Claim(
        figure="mru-prior",
        section="3.3.2",
        says="The peaks may be those of the original spectra as well: error with these.",
        claimed=(-inf, -15.0),
        method="pm-ist",
        metric="gap_error_db",
        where={**_THREE_FRAMES, "prior_source": "original"},
    ),
    Claim(
        figure="mru-prior",
        section="3.3.2",
        says="Not said: a wrong prior, of other objects.",
        claimed=(-16.0, -13.0),
        method="pm-ist",
        metric="gap_error_db",
        where={**_THREE_FRAMES, "prior": "other"},
        remark="It costs next to nothing.",
    ),
    Claim(
        figure="mru-solver",
        section="3.3.1",
        says="The threshold control is typically 2 < beta < 4: false objects of soft thresholding.",
        claimed=(0.0, 3.0),
        method="ist",
        metric="false_alarms",
        where={"control": (2.1, 4.0), "threshold": "adaptive"},
    ),
    Claim(
        figure="mru-solver",
        section="3.3.1",
        says="Below that noise comes through: false objects at beta = 1.",
        claimed=(3.0, inf),
        method="ist",
        metric="false_alarms",
        where={"control": (1.0, 1.0), "threshold": "adaptive"},
    ),
    Claim(
        figure="mru-solver",
        section="3.3.1",
        says="The step width influences the speed of convergence: iterations at theta = 0.2.",
        claimed=(20.0, inf),
        method="ist",
        metric="iterations",
        where={"step_width": (0.2, 0.2)},
        remark="Eleven or twelve at theta = 1.",
    ),
    Claim(
        figure="mru-size",
        section="3.4.1",
        says="Of 128 x 256 samples with 10 % disturbed q = 29491 are undisturbed.",
        claimed=(29_400.0, 29_500.0),
        method="ist",
        metric="num_clean",
        where=_FRAME,
        remark="A block of whole samples in every ramp. The 1/6531 beside it is of base 10: "
        "log10(NM)/q; with base 2 it is 1/1966.",
    ),
    Claim(
        figure="mru-size",
        section="3.4.1",
        says="Explicit matrix: processor milliseconds of an iteration at 64 x 64.",
        claimed=(5.0, inf),
        method="ist",
        metric="iteration_ms",
        where={"num_ramps": (64.0, 64.0), "domain": "explicit-1d"},
        remark="To be compared with the next line; no figure is claimed.",
    ),
    Claim(
        figure="mru-size",
        section="3.4.1",
        says="Masked updates reduce this considerably: the same frames.",
        claimed=(0.0, 1.0),
        method="ist",
        metric="iteration_ms",
        where={"num_ramps": (64.0, 64.0), "domain": "masked-2d"},
    ),
    Claim(
        figure="mru-size",
        section="3.3.1",
        says="The cycle is around 50 ms: processor seconds for 128 x 256 samples.",
        claimed=(0.0, 0.05),
        method="ist",
        metric="seconds",
        where=_FRAME,
    ),
)
"""In the order of the source."""
