"""The sparse reduction equals the dense one."""

import numpy as np
import pytest
import scipy.sparse

from jaxmbs.reductions import CraigBampton, Guyan, reduce
from tests.structural_matrices import beam, component

INTERFACE = (0, 1, 40, 41)


@pytest.mark.long
def test_sparse_equals_dense():
    K, M = (np.asarray(A) for A in beam(20))
    dense = reduce(component(*beam(20), INTERFACE, 0.01 * beam(20)[0]), CraigBampton(6))
    found = reduce(
        component(*map(scipy.sparse.csr_matrix, (K, M)), INTERFACE, scipy.sparse.csr_matrix(0.01 * K)),
        CraigBampton(6),
    )
    sign = np.sign(np.sum(np.asarray(dense.basis) * np.asarray(found.basis), axis=0))
    assert found.coordinates == dense.coordinates
    np.testing.assert_allclose(np.asarray(found.basis) * sign, dense.basis, atol=1e-7)
    for kind in ("mass", "stiffness", "damping"):
        a, b = (np.asarray(getattr(r, kind)) for r in (found, dense))
        np.testing.assert_allclose(a * np.outer(sign, sign), b, rtol=1e-6, atol=1e-7 * np.max(np.abs(b)))


def test_no_modes_are_guyan():
    K, M = (scipy.sparse.csr_matrix(np.asarray(A)) for A in beam(20))
    found, exact = (
        reduce(component(K, M, INTERFACE), CraigBampton(0)),
        reduce(component(*beam(20), INTERFACE), Guyan()),
    )
    np.testing.assert_allclose(found.mass, exact.mass, rtol=1e-9)


def test_a_mechanism_is_refused():
    K, M = (np.asarray(A).copy() for A in beam(20))
    K[4], K[:, 4] = 0.0, 0.0
    with pytest.raises(ValueError, match="mechanism"):
        reduce(component(scipy.sparse.csr_matrix(K), scipy.sparse.csr_matrix(M), INTERFACE), CraigBampton(6))
