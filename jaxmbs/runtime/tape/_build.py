"""Building of the machine with the system's C compiler; as a script it builds that of a checkout."""

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

FOLDER = Path(__file__).parent
LIBRARY = FOLDER / "machine.so"
#: No -ffast-math and no contraction of products and sums: results are those of IEEE arithmetic on every CPU.
FLAGS = ("-O3", "-fno-math-errno", "-ffp-contract=off", "-std=c11", "-shared", "-fPIC")


def sources_number() -> int:
    """A number of 63 bits by which the machine knows the sources that it was built from."""
    text = b"".join((FOLDER / name).read_bytes() for name in ("opcodes.h", "machine.c"))
    return int.from_bytes(hashlib.blake2b(text, digest_size=8).digest(), "little") >> 1


def build_machine(library: Path = LIBRARY) -> bool:
    """Compile the machine to a file; False, and no file, where there is no C compiler or it fails."""
    compiler = os.environ.get("CC") or next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    library.unlink(missing_ok=True)
    if not compiler:
        return False
    fresh = library.with_suffix(".new")
    define = f"-DSOURCES={sources_number()}"
    command = [*compiler.split(), *FLAGS, define, "-o", str(fresh), str(FOLDER / "machine.c"), "-lm"]
    try:
        subprocess.run(command, check=True, capture_output=True)
        fresh.replace(library)  # at once: another process may be loading the old one
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


if __name__ == "__main__":
    print(LIBRARY if build_machine() else "no C compiler, or it failed")
