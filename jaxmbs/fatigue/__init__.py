"""Fatigue: rainflow cycles, damage of histories and of spectra, all with derivatives."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._cycles import Cycles, rainflow
    from ._damage import damage, equivalent_load
    from ._psd import PsdTable, psd_table
    from ._sn import SN
    from ._spectral_damage import spectral_damage
    from ._spectral_moments import SpectralMoments

__all__ = [
    "SN",
    "Cycles",
    "PsdTable",
    "SpectralMoments",
    "damage",
    "equivalent_load",
    "psd_table",
    "rainflow",
    "spectral_damage",
]

import_when_asked(__name__, explain_arguments)
