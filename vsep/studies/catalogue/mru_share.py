"""Compressive sensing over the share that is lost, and over the levels of objects and chirps."""

from vsep.mitigation.entry import COMPRESSIVE_SENSING
from vsep.mitigation.registry import MITIGATIONS
from vsep.studies.catalogue._gaps import gap_panels, gaps
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import Study

_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)

STUDY = Study(
    name="mru-share",
    title="Compressive sensing of large frames over the share lost and over levels",
    realizations=20,
    points=(
        *[gaps("share-0-db", share_lost=share) for share in _SHARES],
        *[gaps("share-20-db", share_lost=share, snr_db=20.0) for share in _SHARES],
        *[gaps("objects", snr_db=snr_db) for snr_db in (-10.0, -5.0, 0.0, 5.0, 10.0, 20.0)],
        *[
            gaps("chirps", sir_db=sir_db, share_lost=0.2, mask="amplitude")
            for sir_db in (-30.0, -20.0, -10.0, 0.0)
        ],
    ),
    methods=(*MITIGATIONS.in_group(COMPRESSIVE_SENSING), NO_INTERFERENCE),
    panels=(
        *gap_panels("share-0-db", "share_lost", "Share lost, 0 dB a sample"),
        *gap_panels("share-20-db", "share_lost", "Share lost, 20 dB a sample"),
        *gap_panels("objects", "snr_db", "Level of the objects, half of every ramp lost"),
        *gap_panels("chirps", "sir_db", "Level of the chirps, which a detector looks for"),
    ),
)
