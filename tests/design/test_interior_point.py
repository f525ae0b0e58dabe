"""The interior-point method: published optima, derivatives of optima, many side by side, and what has no solution."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import ModelError
from jaxmbs.design import interior_point


def product(x):
    """Objective of problem 71 of Hock and Schittkowski."""
    return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]


START = np.array([1.0, 5.0, 5.0, 1.0])
HS71 = {"equalities": lambda x: x @ x - 40.0, "inequalities": lambda x: 25.0 - jnp.prod(x), "bounds": (1.0, 5.0)}


@pytest.mark.slow
@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_a_published_optimum(hessian):
    """Hock and Schittkowski 1981, problem 71; IPOPT 3.14 takes 9 evaluations to 1e-8."""
    found = interior_point(product, START, **HS71, hessian=hessian)
    assert found.ok and int(found.evaluations) <= 20
    np.testing.assert_allclose(found.value, 17.0140173, rtol=1e-8)
    np.testing.assert_allclose(found.design, [1.0, 4.742994, 3.8211503, 1.3794082], rtol=1e-5)
    assert bool(found.active[0])
    gradient = jax.grad(product)(found.design) + found.equalities[0] * 2.0 * found.design
    gradient = gradient - found.inequalities[0] * 25.0 / found.design - found.lower + found.upper
    np.testing.assert_allclose(gradient, 0.0, atol=1e-6)


def shifted(radius, slope, low):
    """Nearest point of a disc to a line's normal, where a lower bound may hold: closed over traced numbers."""
    return interior_point(
        lambda x: slope * x["a"] + x["b"] + 0.1 * x["a"] ** 2,
        {"a": 0.3, "b": 0.2},
        bounds={"a": (low, None), "b": None},
        inequalities=lambda x: x["a"] ** 2 + x["b"] ** 2 - radius**2,
        tolerance=1e-10,
        compile="tape",
    )


@pytest.mark.slow
@pytest.mark.parametrize("low", [-5.0, 0.4])
def test_derivatives_of_an_optimum(low):
    """Forward and reverse, by a number in the objective, in a limit and in a bound, that is active or not."""

    def design(x):
        found = shifted(*x)
        return jnp.stack([found.design["a"], found.design["b"], found.value, found.inequalities[0]])

    x, h = jnp.array([1.5, 0.8, low]), 1e-5
    evaluate = mbs.jit(design, compile="tape")
    columns = [(evaluate(x.at[k].add(h)) - evaluate(x.at[k].add(-h))) / (2.0 * h) for k in range(3)]
    wanted = np.stack(columns, axis=1)
    np.testing.assert_allclose(mbs.jit(jax.jacfwd(design), compile="tape")(x), wanted, rtol=1e-5, atol=2e-6)
    np.testing.assert_allclose(mbs.jit(jax.jacrev(design), compile="tape")(x), wanted, rtol=1e-5, atol=2e-6)


@pytest.mark.slow
def test_a_variable_between_equal_bounds_goes_with_them():
    """Its value is a number of the problem like others; the derivatives were zero."""

    def optimum(value):
        low, high = (jnp.stack([end, value, end]) for end in (-5.0, 3.0))
        found = mbs.design.interior_point(
            lambda x: (x[0] - 1.0) ** 2 + x[0] * x[1] + x[2] ** 2 * x[1],
            jnp.ones(3),
            (low, high),
            equalities=lambda x: x[2] - x[1] * x[0],
            inequalities=lambda x: 0.5 * x[1] + 0.3 - x[0] * x[1],
            tolerance=1e-10,
            compile="tape",
        )
        return jnp.concatenate([found.design, found.value[None], found.inequalities, found.equalities])

    h = 1e-5
    evaluate, slope = (mbs.jit(f, compile="tape") for f in (optimum, jax.jacfwd(optimum)))
    wanted = (evaluate(0.7 + h) - evaluate(0.7 - h)) / (2.0 * h)
    assert wanted[1] == pytest.approx(1.0)
    np.testing.assert_allclose(slope(0.7), wanted, rtol=1e-6)


@pytest.mark.slow
def test_many_side_by_side_each_with_its_verdict():
    """Nearest points of a circle, of which the last radius is none: it harms no other."""
    radii = np.array([0.5, 1.0, 2.0, -1.0])

    def nearest(radius):
        return interior_point(
            lambda x: (x[0] - 3.0) ** 2 + x[1] ** 2, jnp.array([0.1, 0.2]),
            inequalities=lambda x: x @ x - radius * jnp.abs(radius), steps=60,
        )  # fmt: skip

    found = mbs.jit(jax.vmap(nearest), compile="tape")(radii)
    np.testing.assert_array_equal(found.ok, [True, True, True, False])
    np.testing.assert_allclose(found.design[:3, 0], radii[:3], rtol=1e-7)
    assert "no design near" in found.reasons[int(found.reason[3])]
    assert "1 of 4" in repr(found)


@pytest.mark.slow
def test_as_an_optimiser_of_minimise():
    """With prices as those of SLSQP: the largest rectangle under a diagonal."""
    limit = mbs.Limit("diagonal", lambda d: d["a"] ** 2 + d["b"] ** 2, upper=2.0)
    found = [
        mbs.minimise(lambda d: -d["a"] * d["b"], {"a": 0.3, "b": 0.6}, None, name, limits=limit, progress=False)
        for name in ("interior point", "SLSQP")
    ]
    for one in found:
        assert one.ok and one.value == pytest.approx(-1.0, abs=1e-7)
        assert one.limit("diagonal").price == pytest.approx(-0.5, rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_a_warm_start_takes_fewer_steps(hessian):
    """Of a BFGS matrix the curvature goes on as well; a first design that is known is one in a program too."""
    first = interior_point(product, START, **HS71, hessian=hessian)
    other = {**HS71, "equalities": lambda x: x @ x - 40.2, "hessian": hessian}
    cold = interior_point(product, START, **other)
    solve = lambda _: interior_point(product, first.design, **other, warm=first)
    warm = mbs.jit(solve, compile="tape")(jnp.zeros(()))
    np.testing.assert_allclose(warm.value, cold.value, rtol=1e-7)
    assert warm.ok and int(warm.steps) <= int(cold.steps) // 2 + 1


@pytest.mark.slow
@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_a_search_in_rounds_is_that_of_one_call(hessian):
    """To the last bit, with its steps, evaluations and history."""
    options = {**HS71, "hessian": hessian, "compile": "tape", "history": True}
    whole, part = interior_point(product, START, **options), interior_point(product, START, **options, steps=3)
    steps, evaluations, history = int(part.steps), int(part.evaluations), [np.asarray(part.history.values)]
    assert not part.ok and steps == 3
    while not part.ok:
        part = interior_point(product, part.design, **options, steps=3, warm=part)
        steps, evaluations = steps + int(part.steps), evaluations + int(part.evaluations)
        history.append(np.asarray(part.history.values)[1:])
    assert steps == int(whole.steps) and evaluations == int(whole.evaluations)
    np.testing.assert_array_equal(part.design, whole.design)
    np.testing.assert_array_equal(np.concatenate(history)[: steps + 1], whole.history.values[: steps + 1])


@pytest.mark.slow
def test_curved_limits_of_small_multipliers_are_followed():
    """The spring of `benchmarks/machine_problems.py` (Arora 1989); IPOPT takes 26 evaluations."""
    from benchmarks.machine_problems import MACHINES

    spring = MACHINES["spring"]
    bounds = np.array(spring.lower), np.array(spring.upper)
    found = interior_point(spring.f, np.array(spring.start), bounds, inequalities=spring.c, compile="tape")
    assert found.ok and int(found.evaluations) <= 26
    np.testing.assert_allclose(found.value, spring.value, rtol=1e-6)


def test_what_is_no_question_is_refused():
    for options, text in (
        ({"hessian": "none"}, "hessian must be"),
        ({"gradient": "up"}, "gradient must be"),
        ({"tolerance": 0.0}, "tolerance must be"),
        ({"steps": 0}, "steps must be"),
    ):
        with pytest.raises(ModelError, match=text):
            interior_point(product, START, **options)
    with pytest.raises(ValueError, match="bounds cross"):
        interior_point(product, START, bounds=(2.0, 1.0))
    with pytest.raises(ValueError, match="objective must be one number"):
        interior_point(lambda x: x, START)


@pytest.mark.long
def test_published_optima():
    """The problems of `benchmarks/hock_schittkowski.py`, but for three that no descent is sure to solve."""
    from benchmarks.hock_schittkowski import PROBLEMS

    lost = []
    for name, problem in PROBLEMS.items():
        bounds = tuple(
            np.broadcast_to(np.array(x, float), len(problem.start)) for x in (problem.lower, problem.upper)
        )
        start, limits = np.array(problem.start), {"equalities": problem.e, "inequalities": problem.c}
        found = interior_point(problem.f, start, bounds, **limits, compile="tape")
        if isinstance(problem.value, str):
            words = {"infeasible": "no design near", "unbounded": "unbounded"}[problem.value]
            good = words in found.reasons[int(found.reason)]
        else:
            good = abs(found.value - problem.value) < 1e-6 * max(1.0, abs(problem.value)) and found.violation < 1e-6
        lost += [] if good else [name]
    assert set(lost) <= LOCAL, lost


#: HS2 has a local minimum that is nearer; HS13 and the limits that touch have no multipliers at their optimum.
LOCAL = {"HS2", "HS13", "kissing limits"}


@pytest.mark.slow
def test_the_steps_are_a_table_and_a_search_goes_on():
    """One that ended at its limit of steps goes on from there."""
    whole = interior_point(product, START, **HS71, history=True)
    assert np.sum(np.isfinite(whole.history.values)) == int(whole.steps) + 1
    last = int(whole.steps)
    np.testing.assert_allclose(whole.history.values[last], whole.value, rtol=1e-9)
    assert whole.history.gradient_norms[last] <= 1e-8 and int(whole.history.evaluations[last]) == int(
        whole.evaluations
    )
    assert "objective" in repr(whole.history) and interior_point(product, START, **HS71).history is None
    part = interior_point(product, START, **HS71, steps=4)
    assert part.reasons[int(part.reason)] == "step limit"
    rest = interior_point(product, part.design, **HS71, warm=part)
    assert rest.ok
    np.testing.assert_allclose(rest.value, whole.value, rtol=1e-7)


@pytest.mark.slow
def test_a_front_is_one_batch():
    """Nearest points to one corner under a bound on the distance from another: a straight front in closed form."""
    first, second = (lambda x: jnp.sum(x**2)), (lambda x: jnp.sum((x - 1.0) ** 2))
    levels = np.linspace(0.1, 1.9, 50)

    def point(level):
        found = interior_point(first, jnp.array([0.4, 0.7]), inequalities=lambda x: second(x) - level)
        return {"value": found.value, "exchange": found.inequalities[0], "converged": found.ok}

    found = mbs.batch(point, levels, progress=False).values
    assert np.all(found["converged"])
    share = 1.0 - np.sqrt(levels / 2.0)
    np.testing.assert_allclose(found["value"], 2.0 * share**2, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(found["exchange"], share / (1.0 - share), rtol=1e-5)


@pytest.mark.long
def test_thousands_of_inequalities():
    """The largest inscribed disc of a polygon with 4000 sides that nearly are a circle's."""
    angles = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    normals = jnp.stack([jnp.cos(angles), jnp.sin(angles)], axis=1)
    offsets = 1.0 + 0.2 * jnp.cos(3.0 * angles)
    found = interior_point(
        lambda x: -x[2], jnp.array([0.1, 0.05, 0.1]), inequalities=lambda x: normals @ x[:2] + x[2] - offsets
    )
    assert found.ok and int(found.steps) < 60
    np.testing.assert_allclose(found.value, -0.8, rtol=1e-6)
    assert 1 <= int(jnp.sum(found.active)) < 50


def test_functions_stand_twice_in_the_program():
    """Once for trials and once for slopes: they are most of what is compiled."""
    plain = lambda x: jax.lax.digamma(x[0]) ** 2
    search = lambda x: (
        interior_point(plain, x, inequalities=lambda x: 1.0 - x, hessian="bfgs", gradient="forward").value
    )
    assert str(jax.make_jaxpr(search)(START)).count("= digamma") == 2
