"""Switches of the tricks: whatever the library does for the compiler's sake can be switched off.

Off is correct and slower.  Where a release computes wrong numbers or stops without one, it is needed: no switch takes
it.  The environment variable `JAXMBS_TRICKS` is read once, at the import: "none" switches all
off, "-small_call,-remat" those two, "small_call,remat" all but those two.  `without_tricks` does the same for the
programs traced inside of it.  `_registry` says which of them work on the JAX at hand, `benchmarks/compiler_tricks.py`
measures what each gains.
"""

import contextlib
import os
from collections.abc import Callable, Iterator

import jax
import jaxlib

#: Name of each trick and what it gains.
TRICKS = {
    "fusion_emitters": "JAX before 0.12: older code for fused loops, which compiles faster and fits into kernels",
    "ynn_fusion": "sums stay in the program in place of calls of XLA's library of kernels",
    "codegen_split": "programs are compiled in 8 parts, not 32",
    "optimization_level": "level 1 compiles sooner than XLA's 3, level 0 in quick programs",
    "small_call": "JAX 0.10: loops of motions and gradients are compiled as one kernel",
    "small_products": "batches: small matrix products are sums inside of fused loops",
    "small_matmul": "products of small matrices in a batch are sums of outer products",
    "spatial_components": "spatial algebra by components, which XLA fuses, in place of small matrix products",
    "static_gathers": "rows at constant places by slices and constant matrices, whose transpose is no loop",
    "tree_sums": "sums over small trees are one product in place of a loop",
    "whole_saddle": "the inverse of a small saddle system is formed: fewer products to compile",
    "gauss_jordan": "small matrices are inverted by elimination, without a call of LAPACK for each",
    "sequential_lapack": "batches of matrices go to LAPACK one by one",
    "chunked_maps": "functions of many saved states run on a few at a time, within the cache",
    "remat": "gradients of states compute again what is cheap, and save solutions and small factors",
    "fusion_barriers": "what two results share is computed once, not in the loop of each",
    "library_calls": "loops over products of large matrices keep XLA's calls for these, and are not one kernel",
    "tape": "programs run at once on a machine of the library's, without a compiler",
    "paused_gc": "Python's garbage collector rests while a program is traced",
}


#: Tricks without which a release, given as jaxlib's version in whole numbers, is faulty, and what it does then.
NEEDED: dict[str, tuple[Callable[[tuple[int, ...]], bool], str]] = {
    "ynn_fusion": (lambda version: version == (0, 10, 2), "computes wrong numbers"),
    "sequential_lapack": (lambda version: version < (0, 11, 2), "can deadlock"),
}


def needed_tricks(version: str = jaxlib.__version__) -> dict[str, str]:
    """The tricks that no switch takes on a release of jaxlib, by name, and what it does without them."""
    numbers = tuple(int(part) for part in version.split(".")[:3])
    return {name: f"jaxlib {version} {fault} without it" for name, (is_so, fault) in NEEDED.items() if is_so(numbers)}


def read_tricks(setting: str) -> frozenset[str]:
    """Names of the tricks that a value of `JAXMBS_TRICKS` switches off, those that are needed left out.

    Raises: ValueError for an unknown name.
    """
    return _named(setting).difference(needed_tricks())


def _named(setting):
    words = [word.strip() for word in setting.split(",") if word.strip()]
    names = [word.removeprefix("-") for word in words]
    if words == ["none"]:
        return frozenset(TRICKS)
    unknown = sorted(set(names) - TRICKS.keys())
    if unknown or len({word.startswith("-") for word in words}) > 1:
        what = f"does not know {', '.join(unknown)}" if unknown else "takes names with a minus or without, not both"
        raise ValueError(f"JAXMBS_TRICKS={setting!r} {what}; the tricks are {', '.join(TRICKS)}, or none")
    is_list_of_off = not words or words[0].startswith("-")
    return frozenset(names) if is_list_of_off else frozenset(TRICKS.keys() - set(names))


#: Names of the tricks that are off for what is traced now; part of the key of JAX's caches.
OFF = jax.make_user_context(read_tricks(os.environ.get("JAXMBS_TRICKS", "")))


def is_on(trick: str) -> bool:
    """True if a trick is not switched off.  Raises: KeyError for an unknown one."""
    TRICKS[trick]
    return trick not in OFF.value


@contextlib.contextmanager
def without_tricks(*names: str) -> Iterator[None]:
    """Switch tricks off for programs traced inside of the context; without names, all of them.

    Raises: ValueError for an unknown name.
    """
    off = read_tricks(",".join(f"-{name}" for name in names) if names else "none")
    with OFF(OFF.value | off):
        yield
