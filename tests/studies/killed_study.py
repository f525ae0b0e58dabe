"""A study in a process of its own, to be killed: run by `test_study.py`."""

import sys

import jax
import jax.numpy as jnp

import jaxmbs as mbs
from jaxmbs.studies import _store as store

jax.config.update("jax_enable_x64", True)
PLAN = mbs.studies.grid(x=jnp.arange(20.0), y=jnp.arange(10.0))


def answers(design):
    x, y = design["x"], design["y"]
    return {"sum": x + 100.0 * y, "powers": jnp.stack([x, x**2, x**3]), "root": jnp.sqrt(x - 2.0)}


if __name__ == "__main__":
    write = store.StudyStore.write

    def told(self, number, arrays):
        write(self, number, arrays)
        print(number, flush=True)

    store.StudyStore.write = told
    mbs.studies.sweep(answers, PLAN, sys.argv[1], chunk=7, progress=False)
    print("end", flush=True)
