"""OpenMDAO: a function of a design as an explicit component with exact derivatives both ways."""

import functools
import re
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..checks import no_such, repeated
from ..errors import ModelError, UnknownNameError
from ..runtime import jit, tuning
from ..status import Status, succeeded
from ._question import Part, Question, trace_question

_FORBIDDEN = str.maketrans({".": ":", **dict.fromkeys("*?![]", "_")})


def component(
    function: Callable[[PyTree], Any],
    example: PyTree,
    bounds: PyTree | None = None,
    units: Mapping[str, str] | None = None,
    partials: str = "matrix-free",
    gradient: str | None = None,
    compile: str = "auto",
) -> Any:
    """An OpenMDAO `ExplicitComponent` of a function of a design, with exact derivatives.

    Inputs and outputs are the leaves of the design and of the results, by their paths as `minimise` names them, with
    colons for dots: `"rod:length"`.  A name that ends with a unit in brackets, `"camber [deg]"`, gives the variable
    `camber` in that unit.

    Args:
        function: of a pytree like `example` to a pytree of real arrays; or to a real scalar and a dict of answers, as
            `minimise` takes it, whose scalar is the output `objective`.  Motions and states among the results are no
            outputs, but their status is judged.
        example: first values, numbers and arrays.
        bounds: as of `minimise`; inputs that have bounds are design variables of the component, scaled to the width
            between both.
        units: units of OpenMDAO by names of inputs and outputs; else those of the names.
        partials: "matrix-free" derivative products by `compute_jacvec_product`; those at one point share a
            linearisation, or a Jacobian where there are few directions. Or "dense", declared partials, for groups
            whose linear solver assembles a matrix.
        gradient: "forward" or "reverse" mode of the dense Jacobian; by default that of fewer passes.
        compile: as of `mbs.jit`.

    Returns: a component for `add_subsystem`.  It raises OpenMDAO's `AnalysisError`, on which drivers shorten their
    step, where a status is no success, or outputs or derivatives are not finite.

    Raises:
        ImportError: without OpenMDAO (`pip install 'jaxmbs[openmdao]'`).
        TypeError: for a leaf that is not a number, or results that are not real.
        ValueError: for bounds, options, units or names at fault, all that are found in one report.
        UnknownNameError: for units of what is neither input nor output.
    """
    _check_options(partials, gradient)
    kind = _component_class()
    question = trace_question(function, example, bounds, compile)
    question = _with_units(question, dict(units or {}))
    name = getattr(function, "__name__", type(function).__name__)
    return kind(_Evaluator(question, name, gradient, compile), partials == "matrix-free")


class _Evaluator:
    """Compiled values and derivatives of a question on the host."""

    def __init__(self, question: Question, name: str, gradient: str | None, compile: str) -> None:
        self.question, self.name = question, name
        evaluate = question.evaluate
        size_in, size_out = (parts[-1].entries.stop for parts in (question.inputs, question.outputs))
        self._values: Callable = jit(evaluate, compile=compile)
        self._jacobians = {
            "fwd": jit(functools.partial(_forward_jacobian, evaluate), compile=compile),
            "rev": jit(functools.partial(_reverse_jacobian, evaluate), compile=compile),
        }
        chosen = {None: "fwd" if size_in <= size_out else "rev", "forward": "fwd", "reverse": "rev"}
        self._dense_mode = chosen[gradient]
        self._is_narrow = {
            "fwd": size_in <= tuning.JACOBIAN_DIRECTIONS,
            "rev": size_out <= tuning.JACOBIAN_DIRECTIONS,
        }
        self._linearise = jit(lambda x: jax.linearize(evaluate, x, has_aux=True)[1], compile=compile)
        self._pull_back = jit(lambda x: jax.vjp(evaluate, x, has_aux=True)[1], compile=compile)
        self._apply = jit(lambda linear, v: linear(v), compile=compile)
        self._points: dict[str, tuple] = {}

    def values(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) at x (n,)."""
        y, code = self._values(x)
        y, status = np.asarray(y), Status(int(code))
        bad = [part.name for part in self.question.outputs if not np.all(np.isfinite(y[part.entries]))]
        if bad and (succeeded(status) or status == Status.NOT_FINITE):
            self._fail(f"{', '.join(bad)} not finite")
        if not succeeded(status):
            self._fail(str(status))
        return y

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Jacobian (m, n) at x (n,)."""
        return self._finite(self._jacobians[self._dense_mode](x))

    def product(self, x: np.ndarray, direction: np.ndarray, mode: str) -> np.ndarray:
        """Jacobian at x (n,) times a direction (n,), mode "fwd"; or its transpose times one (m,), mode "rev".

        OpenMDAO asks for one direction after another: few of them are computed together, at the first.
        """
        at, linear = self._points.get(mode, (None, None))
        if at is None or not np.array_equal(at, x):
            if self._is_narrow[mode]:
                jacobian = self._finite(self._jacobians[mode](x))
                linear = jacobian if mode == "fwd" else jacobian.T
            else:
                linear = (self._linearise if mode == "fwd" else self._pull_back)(x)
            self._points[mode] = (np.array(x), linear)
        if self._is_narrow[mode]:
            return linear @ direction
        found = self._apply(linear, direction)
        return self._finite(found if mode == "fwd" else found[0])

    def forget(self) -> None:
        """Drop the linearisations of the last points."""
        self._points.clear()

    def _finite(self, found: Any) -> np.ndarray:
        found = np.asarray(found)
        if not np.all(np.isfinite(found)):
            self._fail("derivatives are not finite")
        return found

    def _fail(self, words: str) -> None:
        from openmdao.api import AnalysisError

        raise AnalysisError(f"{self.name}: {words}")


def _forward_jacobian(evaluate: Callable, x: Any) -> Any:
    """Jacobian (m, n), one tangent for each input."""
    return jax.jacfwd(lambda x: evaluate(x)[0])(x)


def _reverse_jacobian(evaluate: Callable, x: Any) -> Any:
    """Jacobian (m, n), one pullback for each output; of a single output without a batch axis."""
    y, pull, _ = jax.vjp(evaluate, x, has_aux=True)
    if y.size == 1:
        return pull(jnp.ones_like(y))[0][None]
    return jax.vmap(lambda seed: pull(seed)[0])(jnp.eye(y.size, dtype=y.dtype))


@functools.cache
def _component_class() -> Any:
    """The class, made where OpenMDAO is installed."""
    try:
        from openmdao.api import ExplicitComponent
    except ImportError as error:
        raise ImportError("OpenMDAO is not installed: pip install 'jaxmbs[openmdao]'") from error

    class QuestionComponent(ExplicitComponent):
        """A question of a model; see `jaxmbs.adapters.openmdao.component`."""

        def __init__(self, evaluator: _Evaluator, is_matrix_free: bool) -> None:
            super().__init__()
            self.evaluator, self.matrix_free = evaluator, is_matrix_free

        def setup(self) -> None:
            question = self.evaluator.question
            for part in question.inputs:
                self.add_input(part.name, val=_of(part, question.variables.start), units=part.unit)
            for part in question.outputs:
                self.add_output(part.name, shape=part.shape or (1,), units=part.unit)
            for part in question.inputs:
                _add_design_variable(self, part, question)

        def setup_partials(self) -> None:
            if not self.matrix_free:
                self.declare_partials("*", "*")

        def compute(self, inputs, outputs) -> None:
            outputs.set_val(self.evaluator.values(inputs.asarray(copy=True)))

        def compute_partials(self, inputs, partials) -> None:
            jacobian, question = self.evaluator.jacobian(inputs.asarray(copy=True)), self.evaluator.question
            for of in question.outputs:
                for wrt in question.inputs:
                    partials[of.name, wrt.name] = jacobian[of.entries, wrt.entries]

        def compute_jacvec_product(self, inputs, d_inputs, d_outputs, mode) -> None:
            question, x = self.evaluator.question, inputs.asarray(copy=True)
            ends = ((question.inputs, d_inputs), (question.outputs, d_outputs))
            (given, vector), (asked, result) = ends if mode == "fwd" else ends[::-1]
            _add(asked, result, self.evaluator.product(x, _direction(given, vector), mode))

    return QuestionComponent


def _direction(parts: tuple[Part, ...], vector: Any) -> np.ndarray:
    """A vector of OpenMDAO, which may leave out parts that do not matter."""
    if sum(1 for _ in vector) == len(parts):
        return vector.asarray(copy=True)
    direction = np.zeros(parts[-1].entries.stop)
    for part in parts:
        if part.name in vector:
            direction[part.entries] = vector[part.name].ravel()
    return direction


def _add(parts: tuple[Part, ...], vector: Any, found: np.ndarray) -> None:
    """Add to a vector of OpenMDAO."""
    if sum(1 for _ in vector) == len(parts):
        vector.iadd(found)
        return
    for part in parts:
        if part.name in vector:
            vector[part.name] += found[part.entries].reshape(vector[part.name].shape)


def _of(part: Part, vector: np.ndarray) -> np.ndarray:
    """A part of a vector in its shape; OpenMDAO has arrays of one entry for scalars."""
    return vector[part.entries].reshape(part.shape or (1,))


def _add_design_variable(component: Any, part: Part, question: Question) -> None:
    """Declare an input with bounds as a design variable."""
    lower, upper = (_of(part, bound) for bound in (question.variables.lower, question.variables.upper))
    if not np.any(np.isfinite(lower) | np.isfinite(upper)):
        return
    options = {"lower": lower, "upper": upper}
    if np.all(np.isfinite(upper - lower)) and np.all(upper > lower):
        options |= {"ref0": lower, "ref": upper}
    component.add_design_var(part.name, **options)


def _check_options(partials: Any, gradient: Any) -> None:
    if partials not in ("matrix-free", "dense"):
        raise ValueError(f"partials must be 'matrix-free' or 'dense', not {partials!r}")
    if gradient not in (None, "forward", "reverse"):
        raise ValueError(f"gradient must be None, 'forward' or 'reverse', not {gradient!r}")
    if gradient and partials == "matrix-free":
        raise ValueError("OpenMDAO chooses the mode of matrix-free products: gradient= is for partials='dense'")


def openmdao_unit(unit: Any) -> str | None:
    """A unit as OpenMDAO writes it, "kg*m**2" for "kg m^2" and "kg m2"; None for what it has no unit for."""
    from openmdao.utils.units import valid_units

    if not isinstance(unit, str):
        return None
    text = unit.strip().replace("\u00b2", "^2").replace("\u00b3", "^3").replace("\u00b7", " ").replace("^", "**")
    text = re.sub(r"\s*(\*\*|[*/])\s*", r"\1", text)
    text = re.sub(r"\s+", "*", text)  # a blank is a product
    for spelt in (unit, text, re.sub(r"(?<=[A-Za-z])(-?\d+)", r"**\1", text)):
        try:
            if "^" not in spelt and valid_units(spelt):
                return spelt
        except Exception:  # whatever Python makes of the text
            continue
    return None


def _with_units(question: Question, units: dict[str, str]) -> Question:
    """The question with OpenMDAO's names, and units given or of the names."""
    faults: list[str] = []

    def renamed(part: Part) -> Part:
        name, unit = part.name.translate(_FORBIDDEN).strip(), part.unit
        unit = next((units[key] for key in (name, part.name) if key in units), unit)
        if unit is None:
            return part._replace(name=name)
        own = openmdao_unit(unit)
        if own is None:
            faults.append(f"{part.name}: OpenMDAO has no unit {unit!r}; write one of its own, as 'm' or 'N*m/rad'")
        return part._replace(name=name, unit=own)

    inputs, outputs = (tuple(map(renamed, parts)) for parts in (question.inputs, question.outputs))
    names = [part.name for part in (*inputs, *outputs)]
    old = [part.name for part in (*question.inputs, *question.outputs)]
    for name in units:
        if name not in {*names, *old}:
            raise UnknownNameError(no_such("input or output", name, names))
    faults += [f"{name}: inputs and outputs need names of their own" for name in repeated(names)]
    if faults:
        raise ModelError(faults, what="the component")
    return question._replace(inputs=inputs, outputs=outputs)
