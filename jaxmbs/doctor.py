"""A report on the installation: versions, devices, and the settings that decide speed and accuracy."""

import importlib.metadata
import os
import platform

import jax

from .runtime import SMALL_LOOPS, sets_marks

_PACKAGES = ("jaxmbs", "jax", "jaxlib", "equinox", "diffrax", "numpy")
_BAD_RELEASES = {("jax", "0.11.1"): "makes scans with stacked outputs quadratic on CPU: take another"}
SMALL_LOOPS_FLAG = f"--xla_backend_extra_options={SMALL_LOOPS}=100000000"


def report() -> str:
    """Versions, devices and settings, one to a line, then advice where something can be better."""
    versions = {name: _version(name) for name in _PACKAGES}
    lines = [f"{'python':<10} {platform.python_version()} on {platform.platform()}"]
    lines += [f"{name:<10} {version}" for name, version in versions.items()]
    lines += [f"{'devices':<10} {', '.join(str(device) for device in jax.devices())}"]
    lines += [f"{'x64':<10} {'on' if jax.config.jax_enable_x64 else 'off'}"]
    lines += [f"{'cache':<10} {jax.config.jax_compilation_cache_dir or 'off: `mbs.cache()` keeps compiled programs'}"]
    if needs_small_loops_flag(versions["jax"]):
        lines += [f"{'XLA':<10} small CPU loops compiled as one kernel: {_one_kernel_by(versions['jax'])}"]
    advice = _advice(versions)
    return "\n".join([*lines, "", *(advice or ["nothing to advise"])])


def main() -> int:
    """Print the report; the exit status is 0."""
    print(report())
    return 0


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def needs_small_loops_flag(jax_version: str) -> bool:
    """True for releases of jax that compile small CPU loops well only when asked to."""
    return tuple(int(part) for part in jax_version.split(".")[:2]) < (0, 12)


def _one_kernel_by(jax_version):
    if SMALL_LOOPS in os.environ.get("XLA_FLAGS", ""):
        return "by XLA_FLAGS, in all programs"
    return "by the library, in its own programs and those of `mbs.jit`" if sets_marks(jax_version) else "off"


def _advice(versions: dict[str, str]) -> list[str]:
    advice = [f"{name} {bad} {why}." for (name, bad), why in _BAD_RELEASES.items() if versions[name] == bad]
    if not jax.config.jax_enable_x64:
        advice += ['x64 is off: call jax.config.update("jax_enable_x64", True) before building a model.']
    if jax.default_backend() != "cpu" or not needs_small_loops_flag(versions["jax"]):
        return advice
    given = SMALL_LOOPS in os.environ.get("XLA_FLAGS", "")
    if sets_marks(versions["jax"]) and given:
        advice += [f"XLA_FLAGS sets {SMALL_LOOPS}: the library then leaves small loops to XLA."]
        advice += [
            "  Take it out and compile by `mbs.jit`, whose loops are faster; `jax.jit` alone gains by the flag."
        ]
    if not sets_marks(versions["jax"]) and not given:
        advice += [f'jax {versions["jax"]} on CPU: set XLA_FLAGS="{SMALL_LOOPS_FLAG}"']
        advice += ["  before Python starts; motions and long trees then run several times faster."]
    return advice
