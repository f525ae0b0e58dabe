"""Releases of JAX that are known to be faulty, and the way out of each.

`pyproject.toml` excludes them; an environment may have one all the same, by an upgrade of JAX alone.
"""

import sys
import warnings
from typing import NamedTuple

import jax


class Fault(NamedTuple):
    """A fault of a release of JAX: what it does, and whether its numbers are wrong (or it is merely slow)."""

    text: str
    is_wrong: bool


FAULTY_RELEASES = {
    "0.10.2": Fault("computes wrong numbers on CPU: sums of small products beyond 16 384 lanes", True),
    "0.11.0": Fault("is reported to compute wrong numbers on GPU, and to crash on arrays of seven axes", True),
    "0.11.1": Fault("makes scans with stacked outputs quadratic on CPU", False),
}


def release_advice(version: str) -> list[str]:
    """A line on the fault of a release of JAX with the way out; none for a release without a known one."""
    fault = FAULTY_RELEASES.get(version)
    # JAX 0.11 and later need Python 3.12
    way_out = "pip install 'jax==0.10.1'" if sys.version_info < (3, 12) else "pip install --upgrade jax"
    return [f"jax {version} {fault.text}. Take another: {way_out}"] if fault else []


def warn_of_wrong_release() -> None:
    """Warn if this release of JAX is known to compute wrong numbers."""
    fault = FAULTY_RELEASES.get(jax.__version__)
    if fault and fault.is_wrong:
        warnings.warn(release_advice(jax.__version__)[0], RuntimeWarning, stacklevel=3)
