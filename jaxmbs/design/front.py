"""Trade-offs: how small one aim can be for every value of another."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from jaxmbs.design.constrained import run_limited, slsqp
from jaxmbs.design.limit import Limit
from jaxmbs.design.limited import KEPT, LimitedSearch
from jaxmbs.design.optimise import minimise
from jaxmbs.design.optimum import Optimum
from jaxmbs.design.program import program
from jaxmbs.design.variables import Variables, read_variables
from jaxmbs.math.jit import jit


class Front(eqx.Module):
    """Designs of which none is better in both aims.

    Attributes:
        first, second: the aims (points,), the first rising, the second falling.
        designs: a pytree like one design, with a leading axis (points,).
        exchange: (points,) what one unit less of the second aim costs of the first; nan at the ends.
        ok: (points,) whether each search converged.
    """

    first: np.ndarray
    second: np.ndarray
    designs: PyTree
    exchange: np.ndarray
    ok: np.ndarray

    def table(self) -> str:
        """The aims, their exchange and how each search ended, as text."""
        lines = [f"{'first':>14}{'second':>14}{'exchange':>14}"]
        for a, b, rate, ok in zip(self.first, self.second, self.exchange, self.ok, strict=True):
            lines.append(f"{a:14.6g}{b:14.6g}{rate:14.4g}" + ("" if ok else "  not converged"))
        return "\n".join(lines)


def pareto(
    first: Callable[[PyTree], Any],
    second: Callable[[PyTree], Any],
    design0: PyTree,
    bounds: PyTree | None = None,
    points: int = 9,
    steps: int = 200,
    tolerance: float = 1e-8,
    gradient: str = "reverse",
    progress: bool = True,
    compile: str = "full",
) -> Front:
    """The front of two aims, both to be small: the best of each alone, and between them the first aim under limits
    on the second in equal steps, each search from where its neighbour ended; parts of it that bend inwards are found
    too.

    Args: points: how many, three at least; the others as of `minimise`.  All of them run one compiled program.

    Raises: ValueError as `minimise`, or for fewer than three points.
    """
    if points < 3:
        raise ValueError(f"a front has three points at least, not {points}")
    compiled, options = jit(compile=compile), {"gradient": gradient, "progress": False, "compile": compile}
    ends = [minimise(aim, design0, bounds, None, steps, tolerance, **options) for aim in (first, second)]
    values = compiled(lambda design: jnp.stack([first(design), second(design)]))
    (_, high), (_, low) = (np.asarray(values(_floats(end.design)), float) for end in ends)
    variables = read_variables((design0, np.zeros(())), None if bounds is None else (bounds, None))
    span = max(high - low, 1e-12 * (1.0 + abs(high)))
    limit = Limit("second aim", lambda both: second(both[0]) - both[1], upper=0.0, scale=span)
    asked = program(lambda both: first(both[0]), variables, gradient, [limit])
    run, found, start = compiled(asked.run), [], ends[0].design
    with tqdm(total=steps * (points - 2), disable=not progress, desc="pareto") as bar:
        for level in np.linspace(high, low, points)[1:-1]:
            for begin in (start, ends[1].design):  # where the limit has no slope there, from the other end
                search = LimitedSearch(asked, run, _at_level(variables, begin, level), tolerance, None, bar)
                run_limited(search, steps, slsqp)
                if search.best.violation <= KEPT:
                    break
            found.append(search.optimum())
            start = found[-1].design[0]
    return _front(ends, found, values)


def _at_level(variables: Variables, design: PyTree, level: float) -> Variables:
    """The variables of a search with the level of the second aim, which is last, held."""
    x = np.concatenate([*(np.ravel(leaf) for leaf in jax.tree.leaves(design)), [level]])
    lower, upper = variables.lower.copy(), variables.upper.copy()
    lower[-1] = upper[-1] = level
    scale = variables.scale.copy()
    scale[-1] = 1.0
    return variables._replace(start=np.clip(x, lower, upper), lower=lower, upper=upper, scale=scale)


def _front(ends: list[Optimum], found: list[Optimum], values: Callable) -> Front:
    designs = [ends[0].design, *(optimum.design[0] for optimum in found), ends[1].design]
    aims = np.array([np.asarray(values(_floats(design)), float) for design in designs])
    exchange = [np.nan, *(-optimum.limits[0].price for optimum in found), np.nan]
    return Front(
        aims[:, 0],
        aims[:, 1],
        jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *designs),
        np.array(exchange),
        np.array([optimum.ok for optimum in (ends[0], *found, ends[1])]),
    )


def _floats(design):
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, float), design)
