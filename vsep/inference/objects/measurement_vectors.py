"""Active set of multiple measurement vectors (MMV): one place and prior, a weight per antenna.

The columns and their prior precisions are the same at every antenna, so that the weights of all
have one covariance; antennas multiply what is learnt of places and precisions. Nothing is assumed
of how the weights of one object belong together: neither where the antennas are nor how they are
calibrated. Sparse Bayesian learning of Sec. III-C with several snapshots, as D. Wipf and B. Rao
(IEEE Trans. Signal Processing 55(7), 2007) have it.
"""

import numpy as np

from vsep.inference.objects.sbl import ActiveSet


class MultipleVectorActiveSet(ActiveSet):
    """Weight posterior of columns that A antennas share; ``projections`` is (K, A).

    ``covariance`` (K, K) is that of the weights at one antenna, ``amplitudes`` (K, A) has all.
    """

    @property
    def num_antennas(self) -> int:
        """Number of antennas A."""
        return int(self.projections.shape[1])

    def refresh(self) -> None:
        """Recompute covariance and means, (58)-(59)."""
        super().refresh()
        if len(self) == 0:
            self.amplitudes = np.zeros(self.projections.shape, dtype=np.complex128)

    def cost(self) -> float:
        """Log evidence of the non-linear parameters, (67) summed over the antennas."""
        # A log|C| + lambda sum_a h_a^H mu_a
        return self.num_antennas * self.log_determinant + self.explained()

    def trace(self) -> float:
        """tr(A C A^H) of all antennas."""
        return self.num_antennas * super().trace()
