"""The compiler's room: all that the library needs to know of JAX and XLA beside their public functions."""

from . import _lapack as lapack
from ._cache import cache
from ._compile_log import report_compiles
from ._content import KnownFunction, content_of
from ._export import Program, export, load_program
from ._fingerprint import fingerprint
from ._gather import over_rows, product, summed, take
from ._jaxpr import equations
from ._jit import SMALL, collector_at_rest, jit, of_kind, options
from ._packing import Packing
from ._precision import follow_precision
from ._remat import again, factor
from ._reverse_only import FORWARD_MODE, reverse_only
from ._small_call import SMALL_LOOPS, one_kernel, sets_marks
from ._small_products import as_sums
from ._tracing import as_array, is_outside, typed

__all__ = [
    "FORWARD_MODE",
    "KnownFunction",
    "Packing",
    "Program",
    "SMALL",
    "SMALL_LOOPS",
    "again",
    "as_array",
    "as_sums",
    "cache",
    "collector_at_rest",
    "content_of",
    "equations",
    "export",
    "factor",
    "fingerprint",
    "follow_precision",
    "is_outside",
    "jit",
    "lapack",
    "load_program",
    "of_kind",
    "one_kernel",
    "options",
    "over_rows",
    "product",
    "report_compiles",
    "reverse_only",
    "sets_marks",
    "summed",
    "take",
    "typed",
]
