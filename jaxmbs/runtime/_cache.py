"""Compiled programs kept on disk between processes."""

import hashlib
import os
import platform
from os import PathLike
from pathlib import Path

import jax
import jaxlib
from jax.experimental.compilation_cache import compilation_cache

_CPU_INFO = Path("/proc/cpuinfo")


def cache(path: str | PathLike | None = None, size: int = 2 * 2**30) -> Path:
    """Keep compiled programs on disk: the next process finds them and starts in seconds.

    It sets JAX's persistent cache for the whole process, also for programs that are not this library's, with no least
    size or time of compilation.  Call it once, best before the first computation.

    Args:
        path: folder (default: `jaxmbs` in the user's folder for caches); it may be deleted at any time.
        size: what is kept of it now [bytes]; the programs not used for longest go.

    Returns: the folder in it for this jaxlib and this kind of CPU, since programs run on no other.

    Raises: OSError if the folder cannot be made.
    """
    folder = Path(path).expanduser() if path is not None else user_folder() / "jaxmbs"
    folder = folder / f"jaxlib-{jaxlib.__version__}-{cpu_name()}"
    folder.mkdir(parents=True, exist_ok=True)
    _shrink(folder, size)
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    compilation_cache.reset_cache()  # JAX looks at these settings once, at its first compilation
    return folder


def _shrink(folder: Path, size: int) -> None:
    """Here and not by JAX, whose limit asks for one more package."""
    files = [(file, file.stat()) for file in folder.iterdir()]
    kept = 0
    for file, about in sorted(files, key=lambda found: max(found[1].st_atime, found[1].st_mtime), reverse=True):
        kept += about.st_size
        if kept > size:
            file.unlink(missing_ok=True)


def user_folder() -> Path:
    """The user's folder for caches.  Raises: RuntimeError for a user without a home."""
    if platform.system() == "Windows":
        return Path(os.environ.get("LOCALAPPDATA", "~")).expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser()


def cpu_name() -> str:
    """A name for CPUs that have the same instructions."""
    lines = _CPU_INFO.read_text().splitlines() if _CPU_INFO.exists() else []
    flags = next((line for line in lines if line.startswith(("flags", "Features"))), platform.processor())
    return hashlib.sha256(f"{platform.machine()} {flags}".encode()).hexdigest()[:12]
