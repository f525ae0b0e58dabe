"""What the check of a linear system found, as a table."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Check:
    """What `check` found; `str` of it is a table.

    Attributes:
        asymmetry: largest `|A - A^T|` over the largest entry, by matrix.
        rigid_energy: (6,) strain energy of unit rigid motions over what the diagonal stores in the same motion; None
            without positions.
        grounded: "free", "held" (some rigid motion is strained), or None without positions.
        mass: total mass [kg] (mean of the three directions), or None.
        centre: (3,) of mass [m]; inertia: (3, 3) about the point asked; central_inertia: about the centre; all three
            None where the mass differs by direction.
        free_motions: number of independent motions without strain.
        massless: labels without mass; slack: labels without stiffness.
        faults: what must be put right; warnings: what the user should know.
    """

    size: int
    asymmetry: dict[str, float]
    rigid_energy: np.ndarray | None
    grounded: str | None
    mass: float | None
    about: np.ndarray
    centre: np.ndarray | None
    inertia: np.ndarray | None
    central_inertia: np.ndarray | None
    free_motions: int
    massless: tuple[str, ...]
    slack: tuple[str, ...]
    faults: tuple[str, ...]
    warnings: tuple[str, ...]

    def __str__(self):
        rows = [("coordinates", f"{self.size}")]
        rows += [(f"asymmetry of the {name}", f"{value:.2e}") for name, value in self.asymmetry.items()]
        rows += [("motions without strain", f"{self.free_motions}")]
        if self.rigid_energy is not None:
            rows += [
                ("held or free", self.grounded),
                ("strain energy of rigid motions", numbers(self.rigid_energy, 1)),
            ]
        if self.mass is not None:
            rows += [("mass [kg]", f"{self.mass:.6g}")]
        if self.centre is not None:
            rows += [("centre of mass [m]", numbers(self.centre))]
            rows += [(f"inertia about {numbers(self.about, 3)} [kg m^2]", numbers(np.diag(self.inertia)))]
            rows += [("inertia about the centre [kg m^2]", numbers(np.diag(self.central_inertia)))]
            off = self.central_inertia[[0, 1, 0], [1, 2, 2]]
            rows += [
                ("  xy, yz, xz", numbers(np.where(np.abs(off) < 1e-12 * np.abs(self.central_inertia).max(), 0, off)))
            ]
        rows += [
            ("massless coordinates", names(self.massless)),
            ("coordinates without stiffness", names(self.slack)),
        ]
        width = max(len(name) for name, _ in rows)
        lines = [f"{name:<{width}}  {value}" for name, value in rows]
        lines += [f"fault: {fault}" for fault in self.faults] + [f"warning: {text}" for text in self.warnings]
        return "\n".join(lines)


def numbers(values, digits=5) -> str:
    """Numbers in a row."""
    return " ".join(f"{v:.{digits}g}" for v in np.ravel(values))


def names(labels, most=6) -> str:
    """Labels in a row, the first few."""
    if not labels:
        return "none"
    return ", ".join(labels[:most]) + (f" and {len(labels) - most} more" if len(labels) > most else "")
