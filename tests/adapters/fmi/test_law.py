"""An FMU as a law: a spring and damper of another program beside `SpringDamper`."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks
from jaxmbs.adapters.fmi import Fmu, export_fmu

from .mechanisms import needs_compiler

STIFFNESS, DAMPING = 30.0, 0.8


@pytest.fixture(scope="module")
def strut(tmp_path_factory):
    """An FMU whose output is `-(k x + c v)`; the pendulum in it only gives it states."""
    needs_compiler()
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.5, 0.0, 0.0), inertia=0.01)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.measure("zero", lambda at: 0.0 * at.t)
    b.block("spring", blocks.PI(STIFFNESS, 0.0, target=0.0), reads="zero")
    b.block("damper", blocks.PI(DAMPING, 0.0, target=0.0), reads="zero")
    b.block("force", blocks.Function(lambda u, t: -(u[0] + u[1])), reads=["spring", "damper"])
    path = tmp_path_factory.mktemp("fmu") / "strut.fmu"
    inputs = ["spring.target", "damper.target"]
    return export_fmu(b.build(), inputs, ["force"], path, parameters=["spring.kp", "damper.kp"])


def law_of(path, **options):
    return Fmu(path, "force", "spring.target", "damper.target", **options)


def machine(law, mass=1.2, like=None):
    b = mbs.SystemBuilder()
    b.body("block", mass=mass, inertia=0.01)
    b.joint("rail", mbs.Prismatic("z"), "ground", "block")
    b.force("strut", law, joint="rail")
    return b.build(like=like)


def end(law, mass, like=None, solver=None):
    system = machine(law, mass, like)
    state = mbs.State.at(system, rail=0.1)
    motion = mbs.simulate(system, state, ts=np.array([0.0, 0.2]), rtol=1e-10, atol=1e-10, solver=solver)
    return motion.states.coordinates[-1, 0]


@pytest.mark.long
def test_a_spring_and_damper_is_that_of_the_library(strut):
    law, own = law_of(strut), mbs.SpringDamper(STIFFNESS, DAMPING)
    np.testing.assert_allclose(end(law, 1.2), end(own, 1.2), atol=1e-10)
    tuned = law_of(strut, parameters={"spring.kp": 50.0})
    np.testing.assert_allclose(end(tuned, 1.2), end(mbs.SpringDamper(50.0, DAMPING), 1.2), atol=1e-10)


@pytest.mark.long
def test_gradients_go_through_it(strut):
    law = law_of(strut)
    like = machine(law)
    slope = jax.grad(lambda m: end(law, m, like))(1.2)
    step = 1e-4
    difference = (end(law, 1.2 + step) - end(law, 1.2 - step)) / (2 * step)
    np.testing.assert_allclose(slope, difference, rtol=1e-6)
    own = machine(mbs.SpringDamper(STIFFNESS, DAMPING))
    exact = jax.grad(lambda m: end(mbs.SpringDamper(STIFFNESS, DAMPING), m, own))(1.2)
    np.testing.assert_allclose(slope, exact, rtol=1e-8)


@pytest.mark.long
def test_a_linearisation_has_its_slopes(strut):
    system = machine(law_of(strut))
    found = mbs.linearise(system, mbs.State.at(system))
    np.testing.assert_allclose(found.state_space.A[1, :2], [-STIFFNESS / 1.2, -DAMPING / 1.2], rtol=1e-10)


@pytest.mark.long
def test_batches_are_refused_by_name(strut):
    law = law_of(strut)
    like = machine(law)
    with pytest.raises(mbs.ModelError, match="strut.fmu is one running program"):
        jax.vmap(lambda m: end(law, m, like))(jnp.array([1.0, 1.2]))
    with pytest.raises(Exception, match="strut.fmu is one running program"):
        mbs.batch(lambda m: end(law, m, like), jnp.array([1.0, 1.2]))
    with pytest.raises(mbs.ModelError, match="first order alone"):
        jax.hessian(lambda x: law.effort(x, 0.0, law.start(x, 0.0, 0.0), 0.0))(0.1)


@pytest.mark.long
def test_model_files_refuse_it(strut, tmp_path):
    b = mbs.SystemBuilder()
    b.body("block", mass=1.0)
    b.joint("rail", mbs.Prismatic("z"), "ground", "block")
    b.force("strut", law_of(strut), joint="rail")
    with pytest.raises(mbs.ModelError, match="runs foreign code"):
        mbs.save_model(b, tmp_path / "model.json")
    with pytest.raises(TypeError, match="foreign code"):
        mbs.io.register("fmu", Fmu)


@pytest.mark.long
def test_wrong_names_and_kinds_are_told_together(strut, tmp_path):
    with pytest.raises(mbs.ModelError) as error:
        Fmu(strut, "forc", "spring.targe", parameters={"spring.k": 1.0})
    assert len(error.value.faults) == 3
    with pytest.raises(mbs.ModelError, match="no state of the FMU 'x'"):
        law_of(strut, start={"x": 1.0})
    (tmp_path / "no.fmu").write_text("no")
    with pytest.raises(mbs.ModelError, match="no FMU"):
        Fmu(tmp_path / "no.fmu", "force")
    with pytest.raises(OSError):
        Fmu(tmp_path / "missing.fmu", "force")
