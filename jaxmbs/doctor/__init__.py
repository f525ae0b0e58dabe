"""A report on the installation: versions, devices, the settings that decide speed and accuracy, and a check of the
compiler by small programs."""

import importlib.metadata
import platform

import jax

from ..runtime import flag_advice, is_double, missing_primitives, release_advice, sets_marks, store, trick_states
from ._compiler_check import WrongProgram, wrong_programs
from ._compiler_programs import COMPILER_PROGRAMS

_PACKAGES = ("jaxmbs", "jax", "jaxlib", "equinox", "diffrax", "numpy")


def report() -> str:
    """Versions, devices and settings, one to a line, then advice where something can be better."""
    versions = {name: _version(name) for name in _PACKAGES}
    lines = [f"{'python':<10} {platform.python_version()} on {platform.platform()}"]
    lines += [f"{name:<10} {version}" for name, version in versions.items()]
    lines += [f"{'devices':<10} {', '.join(str(device) for device in jax.devices())}"]
    lines += [f"{'x64':<10} {'on' if is_double() else 'off'}"]
    folder = jax.config.values["jax_compilation_cache_dir"]
    lines += [f"{'cache':<10} {folder or 'off: `mbs.cache()` keeps compiled programs'}"]
    lines += [f"{'store':<10} {store().folder or 'off: every process traces its programs anew'}"]
    lines += [""] + _tricks()
    lines += ["", f"{'tapes':<10} leave programs with these operations to XLA: {', '.join(missing_primitives())}"]
    wrong = list(wrong_programs())
    lines += ["", f"{'compiler':<10} {_compiler_verdict(wrong)}"]
    advice = _advice(versions, wrong)
    return "\n".join([*lines, "", *(advice or ["no issues found"])])


def main() -> int:
    """Print the report; the exit status is 0."""
    print(report())
    return 0


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _tricks() -> list[str]:
    """A line on each trick that the library plays on the compiler (`JAXMBS_TRICKS` switches them)."""
    found = trick_states()
    width, wide = (max(len(text) for text in column) for column in list(zip(*found, strict=True))[:2])
    return [
        f"{trick.name:<{width}}  {trick.state:<{wide}}  {trick.gain}{f' ({trick.reason})' if trick.reason else ''}"
        for trick in found
    ]


def _compiler_verdict(wrong: list[WrongProgram]) -> str:
    names = {program.name for program in wrong}
    return f"{len(COMPILER_PROGRAMS) - len(names)} of {len(COMPILER_PROGRAMS)} small programs compute what NumPy does"


def _advice(versions: dict[str, str], wrong: list[WrongProgram]) -> list[str]:
    advice = release_advice(versions["jax"]) + [f"compiled wrongly: {program}" for program in wrong]
    if wrong and len(advice) == len(wrong):
        advice += ["this jax computes wrong numbers on this machine: take another release, and tell its makers."]
    if not is_double():
        advice += ['x64 is off: call jax.config.update("jax_enable_x64", True) before building a model.']
    return advice + flag_advice(versions["jax"], sets_marks(versions["jax"]))
