"""The compiler's room: all that the library needs to know of JAX and XLA beside their public functions."""

from . import _lapack as lapack
from ._cache import cache
from ._compile_log import report_compiles
from ._content import KnownFunction, content_of
from ._export import Program, export, load_program
from ._fingerprint import fingerprint
from ._gather import gather_static, map_chunked, product, segment_sum_static
from ._jaxpr import equations
from ._jit import SMALL, collector_at_rest, jit, of_kind, options
from ._packing import Packing
from ._precision import follow_precision
from ._remat import remat, save_factor
from ._reverse_only import FORWARD_MODE, reverse_only
from ._small_call import SMALL_LOOPS, sets_marks, small_call
from ._small_products import as_sums
from ._tracing import as_array, as_dtype, not_tracing

__all__ = [
    "FORWARD_MODE",
    "KnownFunction",
    "Packing",
    "Program",
    "SMALL",
    "SMALL_LOOPS",
    "as_array",
    "as_dtype",
    "as_sums",
    "cache",
    "collector_at_rest",
    "content_of",
    "equations",
    "export",
    "fingerprint",
    "follow_precision",
    "gather_static",
    "jit",
    "lapack",
    "load_program",
    "map_chunked",
    "not_tracing",
    "of_kind",
    "options",
    "product",
    "remat",
    "report_compiles",
    "reverse_only",
    "save_factor",
    "segment_sum_static",
    "sets_marks",
    "small_call",
]
