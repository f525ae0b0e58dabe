"""Craig-Bampton reduction of large sparse matrices on the host by SciPy, without derivatives."""

import jax.numpy as jnp
import numpy as np
import scipy.sparse.linalg

from ..linear._condensation import partition
from ..linear._symmetric import ASYMMETRY_TOLERANCE
from ..linear._system import LinearSystem
from ._base import Reduced, check_num_modes, reduced_labels


def craig_bampton_scipy(system: LinearSystem, num_modes: int) -> Reduced:
    """Craig-Bampton reduction by one sparse factorisation, with shift-invert Lanczos for the modes.

    Each interface coordinate costs one solution and one dense column of the basis.

    Raises: ValueError for unsymmetric matrices, and where the interior is a mechanism or has negative stiffness with
    the interface fixed.  Source: S1 (4)-(8).
    """
    K, M = scipy.sparse.csc_matrix(system.stiffness), scipy.sparse.csc_matrix(system.mass)
    inner, outer = partition(K.shape[0], system.interface)
    _check_symmetric(stiffness=K, mass=M)
    check_num_modes(num_modes, len(inner) - 1)
    K_NN, M_NN = (A[inner][:, inner].tocsc() for A in (K, M))
    try:
        options = {"SymmetricMode": True}
        factor = scipy.sparse.linalg.splu(K_NN, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise ValueError("the stiffness is singular with the interface fixed: there is a mechanism inside") from error
    _check_definite(factor, K_NN)
    n, b = K.shape[0], len(outer)
    basis = np.zeros((n, b + num_modes), K.dtype)
    basis[outer, np.arange(b)] = 1.0
    basis[inner, :b] = -factor.solve(K[inner][:, outer].toarray())
    if num_modes:
        inverse = scipy.sparse.linalg.LinearOperator(K_NN.shape, matvec=factor.solve, dtype=K.dtype)
        start = np.ones(len(inner), K.dtype)  # the same modes in every run
        values, shapes = scipy.sparse.linalg.eigsh(K_NN, num_modes, M_NN, sigma=0.0, OPinv=inverse, v0=start)
        basis[inner, b:] = shapes[:, np.argsort(values)]
    M, K, C = (None if A is None else jnp.asarray(basis.T @ (A @ basis)) for A in (M, K, system.damping))
    labels = reduced_labels(system, normal=num_modes)
    return Reduced(system, jnp.asarray(basis), mass=M, stiffness=K, damping=C, coordinates=labels)


def _check_symmetric(**matrices):
    for name, A in matrices.items():
        part = abs(A - A.T).max() / max(abs(A).max(), 1e-300)
        if part > ASYMMETRY_TOLERANCE:
            raise ValueError(f"the {name} is unsymmetric by {part:.1g} of its largest entry")


def _check_definite(factor, K):
    """Refuse a stiffness with pivots that are negative or zero to rounding.  Raises: ValueError.

    The pivots stay on the diagonal: there are as many negative ones as negative eigenvalues (Sylvester's law).
    """
    pivots = factor.U.diagonal() / np.abs(K.diagonal())[np.argsort(factor.perm_c)]
    if np.min(pivots, initial=1.0) < 30 * np.finfo(K.dtype).eps:
        raise ValueError("with the interface fixed the stiffness is singular (a mechanism inside) or negative")
