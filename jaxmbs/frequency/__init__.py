"""Response over frequency."""

from .direct import direct_response
from .gains import (
    accelerance,
    acceleration_gain,
    gain_from_mobility,
    generalised_stiffness,
    mobility,
    mobility_from_gain,
    superpose,
)
from .modal import modal_receptance, receptance, transmissibility, viscous_receptance
