"""How many programs XLA compiled: those somebody waited for, without a tape's that compiles beside the questions."""

import threading

import jax

_EVENT = "/jax/core/compile/backend_compile_duration"
_names: list[str] = []


def is_waited_for(event: str) -> bool:
    # the thread of an earlier question may end while the next one is asked (`runtime._tiers`)
    return event == _EVENT and threading.current_thread().name != "jaxmbs compiler"


@jax.monitoring.register_event_duration_secs_listener
def _listen(event, *_, fun_name="", **__):
    if is_waited_for(event):
        _names.append(fun_name)


def compiled(ask) -> list[str]:
    """Names of the programs that are compiled while something is asked."""
    before = len(_names)
    ask()
    return _names[before:]
