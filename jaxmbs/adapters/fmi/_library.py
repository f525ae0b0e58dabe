"""The shared library of an FMU: one C file, compiled by the compiler of the system at export."""

import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from pathlib import Path

from ...errors import ModelError

SOURCE = Path(__file__).parent / "fmu.c"


def platform_name() -> str:
    """The name that FMI 3.0 gives this platform.  Raises: ModelError for one that is not Linux."""
    if not sys.platform.startswith("linux"):
        raise ModelError(
            [f"the shared library is made on Linux alone, this is {sys.platform}: export there"], "export_fmu"
        )
    machine = platform.machine().lower()
    return {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine) + "-linux"


def compiler() -> list[str]:
    """The command of the C compiler: that of the environment variable CC, else cc, gcc or clang.

    Raises: ModelError where there is none.
    """
    names = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    for name in names:
        command = name.split()
        if command and shutil.which(command[0]):
            return command
    raise ModelError(
        [
            f"the shared library of an FMU needs a C compiler, and there is no {' nor '.join(names)}: install one "
            "(on Debian and Ubuntu `apt install gcc`), or name yours in the environment variable CC"
        ],
        "export_fmu",
    )


def python_library() -> str:
    """The shared library of this interpreter, which hosts that are no Python load."""
    name = sysconfig.get_config_var("INSTSONAME") or sysconfig.get_config_var("LDLIBRARY") or ""
    folder = sysconfig.get_config_var("LIBDIR") or ""
    return str(Path(folder) / name) if ".so" in name else ""


def sizes_header(sizes: Mapping[str, int], token: str) -> str:
    """The text of `sizes.h`."""
    texts = {
        "TOKEN": token,
        "PYTHON_LIBRARY": python_library(),
        "PYTHON_PROGRAM": sys.executable,
        "PYTHON_VERSION": platform.python_version(),
    }
    lines = [f"#define {name} {value}" for name, value in sizes.items()]
    return "\n".join([*lines, *(f"#define {name} {_quoted(value)}" for name, value in texts.items())]) + "\n"


def _quoted(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def compile_library(header: str) -> bytes:
    """The shared library.  Raises: ModelError with the words of the compiler where it fails."""
    command = compiler()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "sizes.h").write_text(header, encoding="utf-8")
        shutil.copy(SOURCE, folder)
        options = ["-std=gnu11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-o", "fmu.so", "fmu.c"]
        done = subprocess.run([*command, *options, "-ldl", "-lpthread"], cwd=folder, capture_output=True, text=True)
        if done.returncode:
            raise ModelError([f"{command[0]} cannot compile the shared library: {done.stderr[:2000]}"], "export_fmu")
        return (Path(folder) / "fmu.so").read_bytes()
