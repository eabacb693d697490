"""All claims, source by source."""

from typing import Final

from vsep.reproduction.separation_claims import CLAIMS as SEPARATION

CLAIMS: Final = (*SEPARATION,)
"""In the order of the sources."""
