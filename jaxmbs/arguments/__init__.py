"""Wrong arguments in words, for all public functions at once."""

from ._explain import as_public_call, explain_arguments, surround_calls
from ._faults import argument_faults

__all__ = ["argument_faults", "as_public_call", "explain_arguments", "surround_calls"]
