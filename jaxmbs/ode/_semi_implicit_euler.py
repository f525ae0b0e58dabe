"""A solver for diffrax: semi-implicit Euler."""

from typing import Any, ClassVar

import diffrax
import jax
from jaxtyping import PyTree

from ..typing import ScalarLike


class SemiImplicitEuler(diffrax.AbstractSolver):
    """First order in (coordinates, velocities): new velocities first, coordinates with them.

    The fixed-step scheme of several engines, for comparison with them; not symplectic once the mass matrix
    depends on the coordinates.  Needs `dt=`.
    """

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar = diffrax.LocalLinearInterpolation

    def order(self, terms: PyTree) -> int:
        return 1

    def init(self, terms: PyTree, t0: ScalarLike, t1: ScalarLike, y0: PyTree, args: PyTree) -> None:
        return None

    def step(
        self,
        terms: PyTree,
        t0: ScalarLike,
        t1: ScalarLike,
        y0: PyTree,
        args: PyTree,
        solver_state: None,
        made_jump: Any,
    ) -> tuple:
        del solver_state, made_jump
        h = terms.contr(t0, t1)
        q, u, work = y0
        _, a, power = terms.vf(t0, y0, args)
        u1 = u + h * a
        rate = terms.vf(t0, (q, u1, work), args)[0]
        y1 = (q + h * rate, u1, jax.tree.map(lambda w, p: w + h * p, work, power))
        return y1, None, {"y0": y0, "y1": y1}, None, diffrax.RESULTS.successful

    def func(self, terms: PyTree, t0: ScalarLike, y0: PyTree, args: PyTree) -> PyTree:
        return terms.vf(t0, y0, args)
