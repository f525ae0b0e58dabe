"""A report on the installation: versions, devices, and the settings that decide speed and accuracy."""

import importlib.metadata
import platform

import jax

from .runtime import flag_advice, is_double, sets_marks, trick_states

_PACKAGES = ("jaxmbs", "jax", "jaxlib", "equinox", "diffrax", "numpy")
_BAD_RELEASES = {("jax", "0.11.1"): "makes scans with stacked outputs quadratic on CPU: take another"}


def report() -> str:
    """Versions, devices and settings, one to a line, then advice where something can be better."""
    versions = {name: _version(name) for name in _PACKAGES}
    lines = [f"{'python':<10} {platform.python_version()} on {platform.platform()}"]
    lines += [f"{name:<10} {version}" for name, version in versions.items()]
    lines += [f"{'devices':<10} {', '.join(str(device) for device in jax.devices())}"]
    lines += [f"{'x64':<10} {'on' if is_double() else 'off'}"]
    folder = jax.config.values["jax_compilation_cache_dir"]
    lines += [f"{'cache':<10} {folder or 'off: `mbs.cache()` keeps compiled programs'}"]
    lines += [""] + _tricks()
    advice = _advice(versions)
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


def _advice(versions: dict[str, str]) -> list[str]:
    advice = [f"{name} {bad} {why}." for (name, bad), why in _BAD_RELEASES.items() if versions[name] == bad]
    if not is_double():
        advice += ['x64 is off: call jax.config.update("jax_enable_x64", True) before building a model.']
    return advice + flag_advice(versions["jax"], sets_marks(versions["jax"]))
