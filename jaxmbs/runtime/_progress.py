"""A bar of how far a motion has come, without a call from its program: another thread looks at the tape that runs."""

import contextlib
import threading
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np
from jax.ad_checkpoint import checkpoint_name
from jaxtyping import Array, Float

from ..checks import is_concrete
from .tape import SHOWN, WATCH

#: Whether the program that is traced now runs on a tape, which shows its progress itself; part of the key of JAX's
#: caches.
ON_TAPE = jax.make_user_context(False)
_EVERY = 0.1  # s, between two looks
_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"


def expose(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """The same numbers, which a `progress_bar` sees while a tape runs."""
    return checkpoint_name(x, SHOWN)


@contextlib.contextmanager
def progress_bar(title: str, begin: Any, end: Any, is_wanted: bool) -> Iterator[None]:
    """Show a bar of the numbers that are exposed by the tapes that run meanwhile, the least of several, on their way
    from one number to another; none where no tape runs, or where these are traced."""
    if not (is_wanted and is_concrete(begin, end)):
        yield
        return
    from tqdm import tqdm

    first, last = float(np.min(begin)), float(np.max(end))
    started, done, views = threading.Event(), threading.Event(), []

    def watch(view):
        view[:] = first
        views.append(view)
        started.set()

    def show():
        started.wait()
        if not views:
            return
        with tqdm(total=100, desc=title, unit="%", bar_format=_FORMAT) as bar:
            while not done.wait(_EVERY):
                bar.update(round(_share(views[-1], first, last)) - bar.n)
            bar.update(round(_share(views[-1], first, last)) - bar.n)

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    token = WATCH.set(watch)
    try:
        yield
    finally:
        WATCH.reset(token)
        done.set()
        started.set()
        thread.join()


def _share(view, first, last):
    """Part of the way [%]."""
    return float(np.clip((np.min(view) - first) / (last - first), 0.0, 1.0)) * 100.0 if last > first else 100.0
