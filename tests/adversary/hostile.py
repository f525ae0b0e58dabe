"""Hostile model files: mutations of good ones, and what reading one of them may do: give a model or our own error.

`python -m tests.adversary.hostile 1000000` tries a million in processes of their own, so that a crash is counted and
not met.
"""

import collections
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

import jaxmbs as mbs
from tests.io.texts import ARM_SDF, ARM_URDF, BENCH_MJCF, LOOPS_MJCF

TOKENS = (
    *("nan", "inf", "-1", "1e308", "1e400", "0", "", "-0.0", "99999999999999999999", "NaN", "true", "null", "[]"),
    *("{}", '"x"', "../../../../etc/passwd", "/dev/zero", "file:///etc/passwd", "&lol;", "<!ENTITY a 'b'>", "\x00"),
    *("<include file='model.xml'/>", "<!DOCTYPE x>", "]]>", "<![CDATA[", "\ufeff", "ground", "drives", "__class__"),
    *('"type"', '"function"', '"os.system"', '"mapping"', "<plugin/>", "<body/>", "<geom/>", "<joint/>", "<link/>"),
)


def seeds(folder: Path) -> dict[str, tuple]:
    """Good files by ending of their name, and what reads them."""
    builder = mbs.SystemBuilder()
    builder.body("arm", 2.0, (0.5, 0.0, 0.0), (0.0, 0.1, 0.1))
    builder.body("hand", 1.0, inertia=np.diag([0.1, 0.2, 0.25]), position=(1.0, 0.0, 0.0))
    builder.joint("pin", mbs.Revolute("y"), "ground", "arm")
    builder.joint("ball", mbs.Spherical(), "arm", "hand", (1.0, 0.0, 0.0), mbs.Pose((0.1, 0.0, 0.0)))
    builder.force("table", mbs.Table([-1.0, 0.0, 2.0], [-3.0, 0.0, 4.0]), joint="pin")
    builder.force("stop", mbs.BumpStop(1e3, lower=-1.0), joint="pin")
    builder.force("push", mbs.Force(mbs.forces.Spline([0.0, 1.0, 2.0], np.eye(3))), on=("hand", (0.0, 0.0, 1.0)))
    builder.constraint("rod", mbs.joints.Distance(2.0), between=("ground", "hand"))
    mbs.save_model(builder, folder / "seed.json")
    return {
        ".urdf": ([ARM_URDF], mbs.io.read_urdf),
        ".sdf": ([ARM_SDF], mbs.io.read_sdf),
        ".xml": ([BENCH_MJCF, LOOPS_MJCF], mbs.io.read_mjcf),
        ".json": ([(folder / "seed.json").read_text()], mbs.load_model),
    }


def mutated(text: str, random) -> bytes:
    """Some bytes, tokens, lines or numbers of a text changed, cut out, doubled or swapped."""
    content = bytearray(text.encode())
    for _ in range(random.integers(1, 4)):
        a = int(random.integers(0, len(content) + 1))
        b = min(len(content), a + int(random.geometric(0.05)))
        kind = random.choice([0, 1, 2, 3, 4, 4, 4, 4, 5])
        if kind == 0 and a < len(content):
            content[a] = random.integers(0, 256)
        elif kind == 1:
            del content[a:b]
        elif kind == 2:
            content[a:a] = content[a:b]
        elif kind == 3:
            content[a:b] = TOKENS[random.integers(0, len(TOKENS))].encode()
        elif kind == 4:
            content = _number_changed(content, random)
        else:
            c = int(random.integers(0, len(content) + 1))
            content[c:c] = content[a:b]
    return bytes(content)


def _number_changed(content, random):
    """A quoted value or a number between commas gets a token in its place: the text stays well-formed more often."""
    text = content.decode("utf-8", "replace")
    marks = [k for k, letter in enumerate(text) if letter in '"[, ']
    if len(marks) < 2:
        return content
    k = int(random.integers(0, len(marks) - 1))
    token = TOKENS[random.integers(0, len(TOKENS))]
    return bytearray((text[: marks[k] + 1] + token + text[marks[k + 1] :]).encode())


def judged(path: Path, read) -> str:
    """ "model" or "refused"; anything else is raised."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = read(path)
            if isinstance(found, mbs.io.Imported):
                found.builder.faults()
    except (mbs.ModelFileError, mbs.ModelError):
        return "refused"
    return "model"


def tried(count: int, seed: int, folder: Path) -> collections.Counter:
    """Outcomes of so many mutated files, by ending."""
    random, found = np.random.default_rng(seed), collections.Counter()
    kinds = seeds(folder)
    for _ in range(count):
        ending = list(kinds)[random.integers(0, len(kinds))]
        texts, read = kinds[ending]
        file = folder / f"hostile{ending}"
        content = mutated(texts[random.integers(0, len(texts))], random)
        file.write_bytes(content)
        try:
            found[ending, judged(file, read)] += 1
        except Exception:
            (folder / f"found{ending}").write_bytes(content)
            raise
    return found


def main() -> None:
    """So many files (first argument), a thousand to a process."""
    import multiprocessing

    count, total = int(sys.argv[1]), collections.Counter()
    context = multiprocessing.get_context("forkserver")
    for first in range(0, count, 1000):
        with tempfile.TemporaryDirectory() as folder:
            process = context.Process(target=_thousand, args=(first, Path(folder)))
            process.start()
            process.join()
            if process.exitcode:
                kept = [
                    str(file.rename(f"hostile-{first}{file.suffix}"))
                    for file in Path(folder).glob("*")
                    if file.name.startswith(("found", "hostile"))
                ]
                print(f"seed {first}: exit {process.exitcode}, {kept}", flush=True)
            total[process.exitcode] += 1
    print(f"{count} files in processes that ended with {dict(total)}")


def _thousand(seed, folder):
    print(seed, dict(tried(1000, seed, folder)), flush=True)


if __name__ == "__main__":
    main()
