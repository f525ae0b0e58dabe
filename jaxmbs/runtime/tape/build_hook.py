"""Builds the tape machine with the system's C compiler when the library is installed; without one it is left out."""

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDER = Path(__file__).parent
#: No -ffast-math and no contraction of products and sums: results are those of IEEE arithmetic on every CPU.
FLAGS = ("-O3", "-fno-math-errno", "-ffp-contract=off", "-std=c11", "-shared", "-fPIC")


class TapeMachineHook(BuildHookInterface):
    """Adds `machine.so` to a wheel, or to the checkout of an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the machine; a wheel that holds it is one for this platform."""
        if self.target_name != "wheel":
            return
        library = FOLDER / "machine.so"
        if build_machine(library):
            build_data["artifacts"].append(str(library.relative_to(self.root)))
            build_data["pure_python"] = False
            build_data["infer_tag"] = True
        else:
            self.app.display_warning("no C compiler: programs are compiled by XLA where they could run at once")


def build_machine(library: Path) -> bool:
    """Compile the machine to a file; False, and no file, where there is no C compiler or it fails."""
    compiler = os.environ.get("CC") or next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    library.unlink(missing_ok=True)
    if not compiler:
        return False
    fresh = library.with_suffix(".new")
    command = [*compiler.split(), *FLAGS, "-o", str(fresh), str(FOLDER / "machine.c"), "-lm"]
    try:
        subprocess.run(command, check=True, capture_output=True)
        fresh.replace(library)  # at once: another process may be loading the old one
    except (OSError, subprocess.CalledProcessError):
        return False
    return True
