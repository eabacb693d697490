"""Estimators that separate a received frame into objects, bursts and noise.

Names of the frame on its way through a step: `received`, as given; `used`, with outliers replaced;
`residual`, without the estimate of the other source (r_alpha or r_beta); `noise_residual`, without
both (r_lambda); `used_residual`, that of the unmasked samples; `row` and `rows`, one or some ramps
of a residual; `row_residuals`, rows without all bursts; `parts`, a residual's real and imaginary
parts; `target`, a residual with the filter's correction added back; `transforms` and `spectra`,
Fourier transforms.
"""
