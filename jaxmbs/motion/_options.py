"""The option of `simulate` that only mechanisms have: the formulation.  The others are in `ode/_options.py`."""

from typing import Any

from ..ode._semi_implicit_euler import SemiImplicitEuler
from ._formulation import Formulation
from ._formulations import FORMULATIONS, Prescribed, Velocity


def choose_formulation(formulation: Any, solver: Any, dt: Any) -> type[Formulation]:
    """The formulation that was asked for, by default that of the solver.

    Raises: ValueError for an unknown one, and for a solver that needs another.
    """
    euler = isinstance(solver, SemiImplicitEuler)
    formulation = formulation or ("velocity" if euler else "canonical")
    if not (isinstance(formulation, type) and issubclass(formulation, Formulation)):
        if formulation not in FORMULATIONS:
            raise ValueError(f"formulation={formulation!r} must be one of {', '.join(FORMULATIONS)}")
        formulation = FORMULATIONS[formulation]
    if euler and formulation is Prescribed:
        formulation = Velocity
    if euler and (dt is None or formulation is not Velocity):
        raise ValueError("SemiImplicitEuler needs dt= and formulation='velocity'")
    return formulation
