"""A bar of how far a motion has come, without a call from its program: another thread looks at the tape that runs."""

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import numpy as np
from jax.ad_checkpoint import checkpoint_name
from jaxtyping import Array, Float

from ..checks import is_concrete
from . import _tuning as tuning
from ._step_bar import is_notebook, step_bar
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
def progress_bar(
    title: str, begin: Any, end: Any, is_wanted: bool | None, advice: Callable[[], str] | None = None
) -> Iterator[None]:
    """Show a bar of the numbers that are exposed by the tapes that run meanwhile, the least of several, on their way
    from one number to another; none where no tape runs, or where these are traced.

    Args:
        is_wanted: None for a bar after some seconds, where a person looks on.
        advice: words on what takes so long, asked for when it will take minutes.
    """
    if is_wanted is False or not is_concrete(begin, end):
        yield
        return
    # as arrays of NumPy, whose methods compile nothing
    first, last = float(np.min(np.asarray(begin))), float(np.max(np.asarray(end)))
    watched = _Watched(title, first, last, is_wanted, advice)
    token = WATCH.set(watched.watch)
    try:
        yield
    finally:
        WATCH.reset(token)
        watched.end()


class _Watched:
    """A run that a thread looks at, to show how far it is and to say why it takes long."""

    def __init__(self, title, first, last, is_wanted, advice):
        self.title, self.first, self.last, self.is_wanted, self.advice = title, first, last, is_wanted, advice
        self.done, self.views, self.thread = threading.Event(), [], None

    def watch(self, view):
        """Called by a tape with the numbers that it exposes, before it runs."""
        view[:] = self.first
        self.views.append(view)
        if self.thread is None:
            self.thread = threading.Thread(target=self.show, daemon=True)
            self.thread.start()

    def end(self):
        self.done.set()
        if self.thread is not None:
            self.thread.join()

    def share(self):
        return _share(self.views[-1], self.first, self.last)

    def show(self):
        began = time.perf_counter()
        if self.is_wanted is None and self.done.wait(tuning.SECONDS_TO_BAR):
            return
        if self.is_wanted is None and not _is_looked_at():
            self._advise(began)
            return
        with step_bar(100, self.title, unit="%", bar_format=_FORMAT) as bar:
            while not self.done.wait(_EVERY):
                bar.update(round(self.share()) - bar.n)
                if self.advice and time.perf_counter() - began > tuning.SECONDS_TO_ADVICE:
                    self._advise(began, bar.write)
            bar.update(round(self.share()) - bar.n)

    def _advise(self, began, say=None):
        """Say once what takes so long, where the rest will take minutes."""
        left = tuning.SECONDS_TO_ADVICE - (time.perf_counter() - began)
        advice, self.advice = self.advice, None
        if advice is None or left > 0 and self.done.wait(left):
            return
        spent, share = time.perf_counter() - began, self.share()
        if spent < tuning.SLOW_SECONDS * share / 100.0:
            return
        with contextlib.suppress(Exception):  # advice may never end a run
            words = f"jaxmbs: {self.title}: {share:.2g} % after {spent:.0f} s{advice()}"
            say(words, file=sys.stderr) if say else print(words, file=sys.stderr, flush=True)


def _is_looked_at():
    """True in a terminal and in a notebook."""
    return sys.stderr.isatty() or is_notebook()


def _share(view, first, last):
    """Part of the way [%]."""
    return float(np.clip((np.min(view) - first) / (last - first), 0.0, 1.0)) * 100.0 if last > first else 100.0
