"""A thousand connecting rods, each the lightest that keeps its pin below a force and does not buckle: all of them in
one batch of `design.interior_point`, beside a loop of SciPy's SLSQP with compiled functions and gradients.

    python -m benchmarks.optima_side_by_side

The rod of a slider-crank has a length and a diameter; pin force and compression are limits at every fifth degree of
the crank, 144 of them.  The engines differ in the mass of their sliders and in their speeds.
"""

import time

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

jax.config.update("jax_enable_x64", True)
ENGINES, LOOPED = 1000, 40
FIRST, BOUNDS = np.array([0.3, 0.012]), (np.array([0.12, 0.004]), np.array([0.5, 0.02]))  # [m]
RADIUS, PULL, DENSITY, YOUNG = 0.05, 1500.0, 7850.0, 210e9
ANGLES = np.radians(np.arange(0.0, 360.0, 5.0))


def mass(x):
    """Of the rod [kg], of length and diameter [m]."""
    return DENSITY * jnp.pi * x[1] ** 2 / 4.0 * x[0]


def limits(x, engine):
    """Pin force over 8.5 kN and compression over the buckling load, less one, at the angles of the crank.

    The inertia of the rod is that of two halves of its mass at its ends.
    """
    slider, rate = engine
    length, diameter = x
    sine, cosine = RADIUS / length * jnp.sin(ANGLES), jnp.cos(ANGLES)
    lean = jnp.sqrt(1.0 - sine**2)
    ratio = RADIUS / length
    bent = (ratio * (cosine**2 - jnp.sin(ANGLES) ** 2) * lean**2 + ratio * sine**2 * cosine**2) / lean**3
    acceleration = -RADIUS * rate**2 * (cosine + bent)
    along = (slider + 0.5 * mass(x)) * acceleration - PULL
    force = along / lean
    buckling = jnp.pi**3 * YOUNG * diameter**4 / 64.0 / length**2
    return jnp.concatenate(
        [jnp.sqrt(along**2 + (along * sine / lean) ** 2) / 8500.0 - 1.0, 5.0 * force / buckling - 1.0]
    )


def lightest(engine):
    found = mbs.design.interior_point(mass, FIRST, BOUNDS, inequalities=lambda x: limits(x, engine))
    return {"x": found.design, "mass": found.value, "converged": found.ok}


def by_slsqp(engine, programs):
    from scipy.optimize import Bounds, minimize

    value, slope, margins, slopes = programs
    constraint = {
        "type": "ineq",
        "fun": lambda x: -np.asarray(margins(jnp.array(x), engine)),
        "jac": lambda x: -np.asarray(slopes(jnp.array(x), engine)),
    }
    number, gradient = lambda x: float(value(jnp.array(x))), lambda x: np.asarray(slope(jnp.array(x)))
    options = {"ftol": 1e-10, "maxiter": 200}
    return minimize(number, FIRST, jac=gradient, bounds=Bounds(*BOUNDS), constraints=constraint, options=options).fun


def main() -> None:
    """Print CPU seconds for a thousand engines by both ways, and how far the optima are apart."""
    rng = np.random.default_rng(0)
    engines = np.stack([rng.uniform(1.0, 1.2, ENGINES), rng.uniform(275.0, 300.0, ENGINES)], axis=1)
    mbs.batch(lightest, engines, progress=False, compile="full")
    begin = time.process_time()
    found = mbs.batch(lightest, engines, progress=False, compile="full")
    batch = time.process_time() - begin
    programs = [jax.jit(f) for f in (mass, jax.grad(mass), limits, jax.jacfwd(limits))]
    by_slsqp(jnp.asarray(engines[0]), programs)
    begin = time.process_time()
    others = np.array([by_slsqp(jnp.asarray(engine), programs) for engine in engines[:LOOPED]])
    loop = (time.process_time() - begin) * ENGINES / LOOPED
    good = np.asarray(found.values["converged"])
    apart = np.abs(np.asarray(found.values["mass"])[:LOOPED] / others - 1.0)[good[:LOOPED]]
    print(
        f"{np.sum(good)} of {ENGINES} converged; the first {LOOPED} optima are those of SLSQP to {np.max(apart):.2g}"
    )
    print(f"CPU s: batch {batch:.3g}, loop of SLSQP {loop:.3g} ({LOOPED} of them measured), ratio {batch / loop:.3g}")


if __name__ == "__main__":
    main()
