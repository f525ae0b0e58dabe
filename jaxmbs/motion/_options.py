"""The option of `simulate` that only mechanisms have: the formulation.  The others are in `ode/_options.py`.

A formulation of the library is known by its name until a motion is traced: only then its equations are imported.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._formulation import Formulation

#: Names of the formulations of the library: the keys of `_formulations.FORMULATIONS`.
NAMES = ("canonical", "independent", "velocity", "prescribed")


def choose_formulation(formulation: Any, solver: Any, dt: Any) -> "str | type[Formulation]":
    """The formulation that was asked for, by default that of the solver: its name, or the class of another one.

    Raises: ValueError for an unknown one, and for a solver that needs another.
    """
    euler = False
    if solver is not None:
        from ..ode._named_solver import is_semi_implicit

        euler = is_semi_implicit(solver)
    formulation = _checked(formulation or ("velocity" if euler else "canonical"))
    if euler and formulation == "prescribed":
        formulation = "velocity"
    if euler and (dt is None or formulation != "velocity"):
        raise ValueError("SemiImplicitEuler needs dt= and formulation='velocity'")
    return formulation


def _checked(formulation):
    """The name of a formulation of the library, or another class."""
    if isinstance(formulation, type):
        from ._formulation import Formulation
        from ._formulations import FORMULATIONS

        if issubclass(formulation, Formulation):
            return next((name for name, kind in FORMULATIONS.items() if kind is formulation), formulation)
    if not isinstance(formulation, str) or formulation not in NAMES:
        raise ValueError(f"formulation={formulation!r} must be one of {', '.join(NAMES)}")
    return formulation


def follows_rows(formulation: "str | type[Formulation]") -> bool:
    """True if the constraint rows alone give the coordinates."""
    return formulation == "prescribed" or getattr(formulation, "follows_rows", False)


def class_of(formulation: "str | type[Formulation]") -> "type[Formulation]":
    """The class of a formulation."""
    from ._formulations import FORMULATIONS

    return FORMULATIONS[formulation] if isinstance(formulation, str) else formulation
