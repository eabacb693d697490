"""Make the frame file from the recording that PreSenseRadar/OpenRadar publishes.

Usage: python assets/frames/make_openradar_frame.py RECORDING.npz

The recording holds ``x`` (virtual antennas, chirps, samples) and ``meta``, a JSON text. The frame
keeps the first antenna as it is, in the sensor's sign.
"""

import json
import sys
from pathlib import Path

import numpy as np

OUT = Path(__file__).with_name("openradar_doppler_example_1.npz")
# The sensor samples both halves of the spectrum but uses beat frequencies from 0 to the sample
# rate: ranges above half of the unambiguous one lie in the negative half.
MIN_BEAT = 0.0


def main(recording: str) -> None:
    """Write the frame file beside this script."""
    with np.load(recording, allow_pickle=False) as archive:
        meta = json.loads(str(archive["meta"]))
        np.savez_compressed(
            OUT,
            received=archive["x"][0],
            beat_sign=1,
            lowest_beat=MIN_BEAT,
            sample_rate_hz=meta["fs_hz"],
            slope_hz_per_s=meta["slope_hz_per_s"],
            start_frequency_hz=meta["fc_hz"],
            ramp_period_s=meta["chirp_interval_per_tx_s"],
            source=f"{meta['source_repo']} {meta['source_path']}, first virtual antenna",
            licence="Apache-2.0, see LICENSE-APACHE and NOTICE",
        )


if __name__ == "__main__":
    main(sys.argv[1])
