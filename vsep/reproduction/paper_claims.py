"""All claims, source by source."""

from typing import Final

from vsep.reproduction.separation_claims import CLAIMS as SEPARATION
from vsep.reproduction.sparse_claims import CLAIMS as SPARSE

CLAIMS: Final = (*SEPARATION, *SPARSE)
"""In the order of the sources."""
