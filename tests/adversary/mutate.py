"""Files spoilt at random, and whether a reader answers each with a model or with an error of ours.

`python -m tests.io.mutate --count 1000000` tries many; it prints the first file that gets another answer, and ends
with 1.
"""

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

#: What is put into files: limits of numbers, words of the formats, bytes that are no text.
WORDS = (
    *(b"0", b"-1", b"1", b"2147483648", b"99999999", b"1e400", b"1.-999", b"nan", b"inf", b"-0.", b"1.", b"0.5"),
    *(b"THRU", b"INCLUDE '/etc/passwd'", b"INCLUDE '../up.bdf'", b"INCLUDE 'deck.bdf'", b"BEGIN BULK", b"ENDDATA"),
    *(b"$", b",", b"*", b"+", b"=", b"\n", b"\r", b"\t", b"\x00", b"\xff\xfe", b"'", b'"', b" " * 80, b"A" * 300),
)


def mutated(data: bytes, random: random.Random) -> bytes:
    """The bytes with one change or some."""
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        data = random.choice(_CHANGES)(data, random)
    return data


def outcomes(seeds: list[bytes], reader: Callable[[Path], object], name: str, count: int, seed: int = 0) -> Counter:
    """How many of `count` spoilt files were read and how many refused.

    Raises: AssertionError with the file for any error that is not one of `EXPECTED`.
    """
    found, chance = Counter(), random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        for k in range(count):
            data = mutated(chance.choice(seeds), chance)
            path.write_bytes(data)
            found[answer(reader, path, f"file {k} of seed {seed}")] += 1
    return found


def answer(reader, path, label) -> str:
    """ "read" or "refused"."""
    from jaxmbs.errors import ModelError

    began = time.process_time()
    try:
        reader(path)
        result = "read"
    except ModelError as error:
        assert error.faults, label
        result = "refused"
    except BaseException as error:
        raise AssertionError(f"{label}: {type(error).__name__}: {error}\n{path.read_bytes()!r}") from error
    assert time.process_time() - began < 20, f"{label} took too long\n{path.read_bytes()!r}"
    return result


def _places(data, random) -> Iterator[int]:
    return sorted(random.randrange(len(data) + 1) for _ in range(2))


def _flip(data, random):
    if not data:
        return data
    k = random.randrange(len(data))
    return data[:k] + bytes([random.randrange(256)]) + data[k + 1 :]


def _cut(data, random):
    a, b = _places(data, random)
    return data[:a] + data[min(b, a + 40) :]


def _repeat(data, random):
    a, b = _places(data, random)
    return data[:b] + data[a:b][:400] + data[b:]


def _insert(data, random):
    k = random.randrange(len(data) + 1)
    return data[:k] + random.choice(WORDS) + data[k:]


def _number(data, random):
    """Another word in place of one."""
    a, _ = _places(data, random)
    end = a
    while end < len(data) and data[end : end + 1] not in (b",", b" ", b"\n"):
        end += 1
    return data[:a] + random.choice(WORDS) + data[end:]


def _swap(data, random):
    lines = data.split(b"\n")
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def _drop(data, random):
    lines = data.split(b"\n")
    del lines[random.randrange(len(lines))]
    return b"\n".join(lines)


def _end(data, random):
    return data[: random.randrange(len(data) + 1)]


_CHANGES = (_flip, _flip, _cut, _repeat, _insert, _number, _number, _swap, _drop, _end)


def main() -> int:
    """Decks and meshes in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    from tests.adversary.test_spoilt_decks import READERS

    share = -(-options.count // len(READERS))
    for name, (seeds, reader, file) in READERS.items():
        try:
            print(name, dict(outcomes(seeds(), reader, file, share, options.seed)), flush=True)
        except AssertionError as error:
            print(name, error, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
