"""Interface of blocks: states and outputs of signals, for controllers, filters and delays beside a mechanism.

A block is a frozen pytree whose numbers are array leaves.  Its states are internal states of the motion.
"""

import abc
from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from ..forces._fields import value_faults
from ..forces._internal_state import InternalState, States
from ..forces._validity import Margin
from ..tables import fields_repr
from ..typing import ScalarLike


class AbstractBlock(eqx.Module):
    """States s and outputs y of inputs u: `ds/dt = rate(u, s, t)`, `y = output(u, s, t)`.

    u is one number () where the block reads one scalar signal, else (n,), the signals that it reads in their order.
    `inputs` names the fields that are functions of time and may be driven by another block, such as a target;
    `unbounded` those that may be infinite.
    """

    inputs: ClassVar[tuple[str, ...]] = ()
    unbounded: ClassVar[tuple[str, ...]] = ()
    __repr__ = fields_repr

    @property
    def is_feedthrough(self) -> bool:
        """True if the output depends on the inputs of the same instant; other blocks may close loops of blocks."""
        return True

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """Declaration of the states by name; shapes may follow from those of the parameters."""
        return {}

    @property
    def holds(self) -> tuple[str, ...]:
        """Names of the states that may rest at any value; by default none."""
        return ()

    def start(self, u: Float[Array, "..."], t: ScalarLike) -> States:
        """Initial values by name; those that are left out are zero."""
        return {}

    def rate(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> States:
        """Rates `ds/dt` by name."""
        return {}

    @abc.abstractmethod
    def output(self, u: Float[Array, "..."], s: States, t: ScalarLike) -> Float[Array, "..."]:
        """The output, one number () or several (m,)."""

    def sample(
        self, u: Float[Array, "..."], s: States, t: ScalarLike, period: ScalarLike
    ) -> tuple[Float[Array, "..."], States]:
        """(output, next states) at a sample of a block that is built with `every=`: the output is held for a period
        [s], the next states are those of the next sample.

        A block with states that is to be sampled has a discrete form of its own.
        """
        return self.output(u, s, t), {}

    def sampled(self, period: float) -> "AbstractBlock":
        """The block that takes its place where it is built with `every=` a known period [s]: itself, by its `sample`,
        or one that holds samples."""
        return self

    def sampling_faults(self, period: ScalarLike) -> list[str]:
        """Faults of the block where it is built with `every=` this positive period [s], one message each."""
        return []

    @property
    def has_sampled_form(self) -> bool:
        """True if the block may be built with `every=`."""
        kind = type(self)
        own = kind.sample is not AbstractBlock.sample or kind.sampled is not AbstractBlock.sampled
        return not self.internal_states or own

    def validity(self, s: States, t: ScalarLike) -> dict[str, Margin]:
        """Margins of the states to the ends of the model by name; none by default."""
        return {}

    @property
    def has_ends(self) -> bool:
        """True if `validity` has margins."""
        return type(self).validity is not AbstractBlock.validity

    def faults(self) -> list[str]:
        """Faults of the values, one message each; traced values are not checked."""
        return value_faults(self)
