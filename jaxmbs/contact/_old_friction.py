"""Earlier names of contacts and of models of friction in them; they warn and go with the next release."""

from ..forces._old_friction import require_bristles, warn_of_old_name
from ..friction import AbstractFriction, BrownMcPhee, LuGre, SmoothCoulomb
from ..runtime import as_array
from ..typing import ArrayLike, WordedError
from ._contact import Contact
from ._hunt_crossley import HuntCrossley
from ._pair import AbstractPair


def DryFriction(
    mu: ArrayLike, static_ratio: ArrayLike = 1.0, transition_speed: ArrayLike = 1e-3, model: str = "coulomb"
) -> AbstractFriction:
    """Deprecated: `friction.SmoothCoulomb` or, as model "brown-mcphee", `friction.BrownMcPhee`.

    Args: mu: `dynamic`; static_ratio: `static` over it; transition_speed: as there.
    """
    if model not in ("coulomb", "brown-mcphee"):
        raise ValueError(f"model must be 'coulomb' or 'brown-mcphee', not {model!r}")
    warn_of_old_name(
        "contact.DryFriction(...)", "friction.SmoothCoulomb or BrownMcPhee(dynamic, static, transition_speed)"
    )
    kind = SmoothCoulomb if model == "coulomb" else BrownMcPhee
    return kind(mu, as_array(mu) * as_array(static_ratio), transition_speed)


def ContactLuGre(
    mu: ArrayLike,
    sigma0: ArrayLike,
    sigma1: ArrayLike = 0.0,
    sigma2: ArrayLike = 0.0,
    static_ratio: ArrayLike = 1.0,
    transition_speed: ArrayLike = 1e-3,
) -> LuGre:
    """Deprecated: `friction.LuGre(dynamic, sigma0, sigma1, sigma2, static, stribeck_speed)`.

    Args: mu: `dynamic`; sigma0, sigma1, sigma2: as there; static_ratio: `static` over mu; transition_speed:
        `stribeck_speed`.
    """
    warn_of_old_name("contact.ContactLuGre(...)", "friction.LuGre(dynamic, sigma0, sigma1, sigma2, static)")
    return LuGre(mu, sigma0, sigma1, sigma2, as_array(mu) * as_array(static_ratio), transition_speed)


def BristleContact(
    pair: WordedError[AbstractPair],
    force: WordedError[HuntCrossley],
    friction: WordedError[AbstractFriction],
    max_depth: ArrayLike | None = None,
    wear: ArrayLike = 0.0,
) -> Contact:
    """Deprecated: `contact.Contact(...)`, whose friction may have bristles; arguments as there."""
    warn_of_old_name("contact.BristleContact(...)", "contact.Contact(...)")
    return Contact(pair, force, require_bristles(friction), max_depth, wear)
