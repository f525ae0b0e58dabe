"""Solvers of ours for diffrax: projection after every step, and semi-implicit Euler."""

from collections.abc import Callable
from functools import partial
from typing import ClassVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, PyTree

#: A projection that moves a coordinate further than this [rad or m] has left its branch.
_FAR = 0.3


class Projected(diffrax.AbstractWrappedSolver, diffrax.AbstractAdaptiveSolver):
    """A solver whose every step ends with `project(t, y, args) -> (y, moved)`.

    The next step starts as after a jump, since a first-same-as-last stage is stale once y has moved.  With `watched`,
    for motions that the constraints alone determine, `moved` of the coordinates counts as error of the step (and it
    is all of it): a step that would end on another branch of the mechanism is made again, shorter; where steps are
    fixed it ends the motion.
    """

    solver: diffrax.AbstractSolver
    project: Callable = eqx.field(static=True)
    watched: bool = eqx.field(static=True, default=False)

    @property
    def term_structure(self):
        return self.solver.term_structure

    @property
    def interpolation_cls(self):
        return partial(Landing.of, self.solver.interpolation_cls)

    @property
    def term_compatible_contr_kwargs(self):
        return self.solver.term_compatible_contr_kwargs

    @property
    def root_finder(self):
        return self.solver.root_finder

    @property
    def scan_kind(self):
        return getattr(self.solver, "scan_kind", "lax")

    def order(self, terms):
        return self.solver.order(terms)

    def error_order(self, terms):
        return self.solver.error_order(terms)

    def init(self, terms, t0, t1, y0, args):
        return self.solver.init(terms, t0, t1, y0, args)

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        del made_jump
        y1, error, dense, state, result = self.solver.step(terms, t0, t1, y0, args, solver_state, True)
        y1, moved = self.project(t1, y1, args)
        if self.watched:
            if error is not None:
                error = (jnp.maximum(jnp.abs(error[0]), moved), *error[1:])
            near = jnp.max(moved) < _FAR  # false for NaN
            lost = diffrax.RESULTS.where(near, diffrax.RESULTS.successful, diffrax.RESULTS.nonlinear_divergence)
            result = diffrax.RESULTS.where(diffrax.is_okay(result), lost, result)
        return y1, error, {"landed": y1, **dense}, state, result

    def func(self, terms, t0, y0, args):
        return self.solver.func(terms, t0, y0, args)


class Landing(diffrax.AbstractLocalInterpolation):
    """The solver's own interpolation, and at the end of the step the state that was projected there."""

    t0: Float[Array, ""]
    t1: Float[Array, ""]
    landed: PyTree
    inner: diffrax.AbstractLocalInterpolation

    @classmethod
    def of(cls, kind, t0, t1, landed, **dense):
        return cls(t0, t1, landed, kind(t0=t0, t1=t1, **dense))

    def evaluate(self, t0, t1=None, left=True):
        if t1 is not None:
            return jax.tree.map(jnp.subtract, self.evaluate(t1), self.evaluate(t0))
        smooth, fixed = self.inner.evaluate(t0), self.inner.evaluate(lax.stop_gradient(t0))

        def land(landed, smooth, fixed):
            # the rate in t0 stays the inner one: the search for an event starts at t1
            return smooth + jnp.where(t0 == self.t1, landed - fixed, 0.0)

        return jax.tree.map(land, self.landed, smooth, fixed)


class SemiImplicitEuler(diffrax.AbstractSolver):
    """First order in (coordinates, velocities): new velocities first, coordinates with them.

    The fixed-step scheme of several engines, for comparison with them; not symplectic once the mass matrix
    depends on the coordinates.  Needs `dt=`.
    """

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar = diffrax.LocalLinearInterpolation

    def order(self, terms):
        return 1

    def init(self, terms, t0, t1, y0, args):
        return None

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        del solver_state, made_jump
        h = terms.contr(t0, t1)
        q, u, work = y0
        _, a, power = terms.vf(t0, y0, args)
        u1 = u + h * a
        rate = terms.vf(t0, (q, u1, work), args)[0]
        y1 = (q + h * rate, u1, jax.tree.map(lambda w, p: w + h * p, work, power))
        return y1, None, {"y0": y0, "y1": y1}, None, diffrax.RESULTS.successful

    def func(self, terms, t0, y0, args):
        return terms.vf(t0, y0, args)
