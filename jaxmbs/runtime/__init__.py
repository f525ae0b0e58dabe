"""The compiler's room: all that the library needs of JAX and XLA beside their public functions.

Other rooms import from this face alone, and nothing of JAX's inner parts: `jax.extend`, `jax.interpreters`,
`jax.experimental`, `equinox.internal`.  `tuning` holds every number that is there for speed alone.
"""

from . import _lapack as lapack
from . import _tuning as tuning
from ._barrier import fusion_barrier
from ._batch_program import bytes_for_chunk, bytes_of_arrays, compile_batch, is_motion, working_bytes
from ._batched import any_in_batch, lazy_where
from ._cache import cache
from ._compile_log import report_compiles
from ._compiler_options import check_kind, flag_advice, set_quick_flags
from ._content import KnownFunction, as_argument, content_of
from ._export import Program, export, load_program
from ._fingerprint import fingerprint
from ._gather import chunked_vmap, constant_product, gather_static, map_chunked, segment_sum_static
from ._host_call import host_call
from ._jaxpr import jaxpr_function, without_unused
from ._jit import SMALL_PROGRAM, compile_kind, garbage_collection_paused, jit
from ._library_calls import with_library_calls
from ._notes import note, take_notes
from ._packing import Packing
from ._precision import follow_precision, forget_with_programs, is_double
from ._progress import ON_TAPE, expose, progress_bar
from ._public_calls import public_call
from ._registry import TrickState, trick_states
from ._releases import release_advice, warn_of_wrong_release
from ._remat import remat, save_factor
from ._reverse_only import FORWARD_MODE, reverse_only
from ._small_call import kernel_options, one_kernel, sets_marks, small_call
from ._step_bar import step_bar
from ._store import store
from ._tiers import kept_tiers, may_run_on_tapes
from ._traced_function import TracedFunction
from ._tracer_errors import explain_error, tracer_errors_in_words
from ._tracing import as_array, as_dtype, as_host_array, not_tracing
from ._tricks import is_on, without_tricks
from ._user_jit import jit as user_jit
from .tape import UnsupportedError, missing_primitives

__all__ = [
    "FORWARD_MODE",
    "KnownFunction",
    "ON_TAPE",
    "Packing",
    "Program",
    "SMALL_PROGRAM",
    "TracedFunction",
    "TrickState",
    "UnsupportedError",
    "any_in_batch",
    "as_argument",
    "as_array",
    "as_dtype",
    "as_host_array",
    "bytes_for_chunk",
    "bytes_of_arrays",
    "cache",
    "check_kind",
    "chunked_vmap",
    "compile_batch",
    "compile_kind",
    "constant_product",
    "content_of",
    "explain_error",
    "export",
    "expose",
    "fingerprint",
    "flag_advice",
    "follow_precision",
    "forget_with_programs",
    "fusion_barrier",
    "garbage_collection_paused",
    "gather_static",
    "host_call",
    "is_double",
    "is_motion",
    "is_on",
    "jaxpr_function",
    "jit",
    "kept_tiers",
    "may_run_on_tapes",
    "kernel_options",
    "lapack",
    "lazy_where",
    "load_program",
    "map_chunked",
    "missing_primitives",
    "not_tracing",
    "note",
    "one_kernel",
    "progress_bar",
    "public_call",
    "release_advice",
    "remat",
    "report_compiles",
    "reverse_only",
    "save_factor",
    "segment_sum_static",
    "set_quick_flags",
    "sets_marks",
    "small_call",
    "step_bar",
    "store",
    "take_notes",
    "tracer_errors_in_words",
    "trick_states",
    "tuning",
    "user_jit",
    "warn_of_wrong_release",
    "with_library_calls",
    "without_tricks",
    "without_unused",
    "working_bytes",
]
