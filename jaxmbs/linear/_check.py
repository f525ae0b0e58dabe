"""Check of a linear system: symmetry, rigid motions, mass properties, grounding, mechanisms, massless coordinates."""

import dataclasses

import numpy as np

from ..checks import as_flag
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..quantities import XYZ, Quantity, entries
from ..reports import Report, Reported, faults_in_short
from ..runtime import as_array
from ..typing import ArrayLike
from ._rigid_motions import rigid_rows
from ._system import LinearSystem


@dataclasses.dataclass(frozen=True, repr=False)
class Check(Reported):
    """Result of `check`; `str` of it is a table.

    Attributes:
        asymmetry: largest `|A - A^T|` over the largest entry, by matrix.
        rigid_energy: (6,) strain energy of unit rigid motions over what the diagonal stores in the same motion; None
            without positions.
        grounded: "free", "held", "held in part" (some rigid motion is strained, and some motion is not), "unstable"
            (some rigid motion gives energy back: negative stiffness), or None without positions.
        mass: total mass [kg] (mean of the three directions), or None.
        centre: (3,) centre of mass [m]; inertia: (3, 3) [kg m^2] about the given point; central_inertia: about the
            centre of mass; all three None where the mass differs by direction.
        free_motions: number of independent motions without strain.
        massless: labels without mass; slack: labels without stiffness.
        faults: errors of the model; warnings: properties that may be unintended.
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

    def report(self) -> Report:
        found = [Quantity("coordinates", self.size), Quantity("motions without strain", self.free_motions)]
        found += [Quantity(f"asymmetry of the {name}", value) for name, value in self.asymmetry.items()]
        if self.rigid_energy is not None:
            found.append(entries("strain energy of rigid motion", self.rigid_energy))
        if self.mass is not None:
            found.append(Quantity("mass", self.mass, "kg"))
        if self.centre is not None:
            found += [
                Quantity("centre of mass", self.centre, "m", (XYZ,)),
                entries("inertia", self.inertia, "kg m^2"),
            ]
        return Report(found, "; ".join(self.warnings[:1]), faults_in_short(self.faults))

    def __str__(self):
        rows = [("coordinates", f"{self.size}")]
        rows += [(f"asymmetry of the {name}", f"{value:.2e}") for name, value in self.asymmetry.items()]
        rows += [("motions without strain", f"{self.free_motions}")]
        if self.rigid_energy is not None:
            rows += [
                ("held or free", self.grounded),
                ("strain energy of rigid motions", format_numbers(self.rigid_energy, 1)),
            ]
        if self.mass is not None:
            rows += [("mass [kg]", f"{self.mass:.6g}")]
        if self.centre is not None:
            rows += [("centre of mass [m]", format_numbers(self.centre))]
            rows += [
                (f"inertia about {format_numbers(self.about, 3)} [kg m^2]", format_numbers(np.diag(self.inertia)))
            ]
            rows += [("inertia about the centre [kg m^2]", format_numbers(np.diag(self.central_inertia)))]
            off = self.central_inertia[[0, 1, 0], [1, 2, 2]]
            rows += [
                (
                    "  xy, yz, xz",
                    format_numbers(np.where(np.abs(off) < 1e-12 * np.abs(self.central_inertia).max(), 0, off)),
                )
            ]
        rows += [
            ("massless coordinates", format_labels(self.massless)),
            ("coordinates without stiffness", format_labels(self.slack)),
        ]
        width = max(len(name) for name, _ in rows)
        lines = [f"{name:<{width}}  {value}" for name, value in rows]
        lines += [f"fault: {fault}" for fault in self.faults] + [f"warning: {text}" for text in self.warnings]
        return "\n".join(lines)


def check(
    system: LinearSystem, about: ArrayLike = (0.0, 0.0, 0.0), tolerance: float = 1e-6, throw: bool = False
) -> Check:
    """Check a linear system with concrete numbers, on the host.

    Args:
        about: point (3,) [m] to which the moments of inertia refer.
        tolerance: relative size above which an asymmetry counts; a thousandth of it for the energy of rigid motions.
        throw: raise the faults as an error.

    Raises: ModelError where `throw` is set and a fault is found; it names the coordinates.
    Source: the checks of `cbcheck` of pyYeti; S1 (3).
    """
    throw = as_flag("throw", throw)
    sub, about = system.to_dense(), np.asarray(as_array(about), float)
    if about.shape != (3,) or not np.all(np.isfinite(about)):
        raise ValueError(f"about must be a point of three finite numbers, got {about}")
    matrices = {"mass": sub.mass, "stiffness": sub.stiffness, "damping": sub.damping}
    matrices = {name: np.asarray(value) for name, value in matrices.items() if value is not None}
    faults, warnings = [], []
    asymmetry = {name: _measure_asymmetry(sub, name, A, tolerance, faults) for name, A in matrices.items()}
    M, K = _symmetric_part(matrices["mass"]), _symmetric_part(matrices["stiffness"])
    massless, slack = _zero_rows(sub, M), _zero_rows(sub, K)
    free_motions, shapes = _strain_free_motions(sub, K, faults)
    _check_definite(sub, "mass", M, faults)
    motions = None if sub.positions is None else np.asarray(rigid_rows(sub, about), float)
    energy = grounded = None
    properties = (None,) * 4
    if motions is not None:
        energy, grounded = _strain_energy(sub, K, motions, tolerance, warnings)
        properties = _mass_properties(M, motions, about, tolerance, warnings)
        _find_mechanisms(sub, K, shapes, motions, faults)
    idle = tuple(label for label in massless if label in slack)
    if idle:
        faults.append(f"coordinates with neither mass nor stiffness: {format_labels(idle)}")
    if set(massless) - set(idle):
        warnings.append(
            f"coordinates without mass: {format_labels(tuple(label for label in massless if label not in idle))}"
        )
    if set(slack) - set(idle):
        warnings.append(
            f"coordinates without stiffness: {format_labels(tuple(label for label in slack if label not in idle))}"
        )
    if grounded == "held" and free_motions:
        grounded = "held in part"
    report = Check(
        size=sub.num_rows,
        asymmetry=asymmetry,
        rigid_energy=energy,
        grounded=grounded,
        mass=properties[0],
        about=about,
        centre=properties[1],
        inertia=properties[2],
        central_inertia=properties[3],
        free_motions=free_motions,
        massless=massless,
        slack=slack,
        faults=tuple(faults),
        warnings=tuple(warnings),
    )
    if throw and faults:
        raise ModelError(faults)
    return report


def _measure_asymmetry(sub, name, A, tolerance, faults):
    difference, size = np.abs(A - A.T), np.abs(A).max() or 1.0
    worst = difference.max() / size
    if worst > tolerance:
        i, j = np.unravel_index(np.argmax(difference), A.shape)
        faults.append(f"{name} is unsymmetric by {worst:.1e}, most between {sub.label(i)} and {sub.label(j)}")
    return float(worst)


def _symmetric_part(A):
    return (A + A.T) / 2


def _zero_rows(sub, A):
    size = np.abs(A).max(axis=1)
    return tuple(sub.label(i) for i in np.nonzero(size <= 1e-14 * (size.max() or 1.0))[0])


def _scale_diagonal(A):
    """Matrix scaled to a unit diagonal, and the scale; rows with a zero diagonal are not scaled."""
    diagonal = np.abs(np.diag(A))
    scale = 1.0 / np.sqrt(np.where(diagonal > 1e-14 * (diagonal.max() or 1.0), diagonal, 1.0))
    return A * scale[:, None] * scale[None, :], scale


def _strain_free_motions(sub, K, faults):
    """Number of motions without strain and a basis of them; negative stiffness is a fault.

    A scaled eigenvalue counts as zero below 1e-9: some thousand roundings of an assembled double-precision matrix,
    more for large ones.
    """
    scaled, scale = _scale_diagonal(K)
    values, vectors = np.linalg.eigh(scaled)
    limit = 1e-9 * max(values[-1], 1e-300) * max(1.0, len(K) / 100)
    if values[0] < -limit:
        faults.append(
            f"stiffness is negative ({values[0]:.1e} scaled), most at {_largest_entries(sub, vectors[:, 0])}"
        )
    count = int(np.sum(np.abs(values) <= limit))
    return count, scale[:, None] * vectors[:, np.abs(values) <= limit]


def _check_definite(sub, name, M, faults):
    values, vectors = np.linalg.eigh(_scale_diagonal(M)[0])
    if values[0] < -1e-9 * max(values[-1], 1e-300):
        faults.append(f"{name} is negative ({values[0]:.1e} scaled), most at {_largest_entries(sub, vectors[:, 0])}")


def _largest_entries(sub, vector):
    order = np.argsort(-np.abs(vector))[:3]
    return ", ".join(sub.label(i) for i in order if np.abs(vector[i]) > 0.3 * np.abs(vector[order[0]]))


def _strain_energy(sub, K, motions, tolerance, warnings):
    energy = np.sum(motions * (K @ motions), axis=0)
    reference = np.sum(motions**2 * np.diag(K)[:, None], axis=0)
    size = np.abs(reference)
    relative = energy / np.where(size > 0, size, 1.0)
    if np.any(relative < -1e-3 * tolerance):
        return relative, "unstable"
    strained = np.nonzero(relative > 1e-3 * tolerance)[0]
    moving = np.any(motions != 0, axis=0)
    if len(strained) and np.any(moving & (relative <= 1e-3 * tolerance)):  # what is held in all of them is supported
        which = ", ".join(DIRECTIONS[k] for k in strained)
        forces = np.abs(K @ motions[:, strained]).max(axis=1)
        warnings.append(
            f"constrained in part: the rigid motions {which} are strained, most at {_largest_entries(sub, forces)}"
        )
    return relative, "held" if len(strained) else "free"


def _mass_properties(M, motions, about, tolerance, warnings):
    total = motions.T @ M @ motions
    mass = np.trace(total[:3, :3]) / 3
    if mass <= 0:
        return (None,) * 4
    if np.abs(total[:3, :3] - mass * np.eye(3)).max() > tolerance * mass:
        given = format_numbers(np.diag(total[:3, :3]))
        warnings.append(f"the mass differs by direction ({given}): some of it is constrained, or rows are missing")
        return mass, None, None, None
    first = total[:3, 3:]  # -m c~
    arm = np.array([first[1, 2] - first[2, 1], first[2, 0] - first[0, 2], first[0, 1] - first[1, 0]]) / (2 * mass)
    inertia = total[3:, 3:]
    return mass, about + arm, inertia, inertia - mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def _find_mechanisms(sub, K, shapes, motions, faults):
    """Append a fault for each motion without strain that is not a rigid motion of the whole."""
    if not shapes.shape[1]:
        return
    weight = 1.0 / _scale_diagonal(K)[1][:, None]
    own, rigid = weight * shapes, weight * motions
    basis, singular, _ = np.linalg.svd(rigid, full_matrices=False)
    basis = basis[:, singular > 1e-10 * max(singular[0], 1e-300)]
    rest = own - basis @ (basis.T @ own)
    left, size, _ = np.linalg.svd(rest, full_matrices=False)
    for k in np.nonzero(size > 1e-4)[0]:
        faults.append(
            "mechanism: a motion without strain that is not rigid, largest at "
            f"{_largest_entries(sub, left[:, k] / weight[:, 0])}"
        )


def format_numbers(values, digits=5) -> str:
    """Numbers as text, separated by spaces."""
    return " ".join(f"{v:.{digits}g}" for v in np.ravel(values))


def format_labels(labels, most=6) -> str:
    """The first few labels as text."""
    if not labels:
        return "none"
    return ", ".join(labels[:most]) + (f" and {len(labels) - most} more" if len(labels) > most else "")
