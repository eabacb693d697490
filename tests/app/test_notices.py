import numpy as np
from vsep_app.widgets.notifications import antenna_notice

from vsep.files.frame import Frame
from vsep.signal.radar import ChirpSequence


def test_a_frame_of_several_antennas_says_which_is_shown(small_radar: ChirpSequence) -> None:
    received = np.ones(small_radar.shape, dtype=complex)
    alone = Frame(received=received, radar=small_radar, name="night.npz")
    assert antenna_notice(alone) is None
    several = Frame(
        received=received, radar=small_radar, name="night.npz", antennas=np.stack([received] * 4)
    )
    notice = antenna_notice(several)
    assert notice is not None
    assert notice.startswith("night.npz holds 4 antennas; antenna 0 alone is shown")
