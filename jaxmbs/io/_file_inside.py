"""Files that a file names, which must lie in its own folder."""

from collections.abc import Iterator
from pathlib import Path


def file_inside(folder: Path, name: str, *beside: Path) -> Path | None:
    """The file of that name in the folder or those `beside`, links followed; None if there is none inside `folder`.

    Names may come from Windows: with `\\`, and in other capitals where only one file fits.
    """
    return next((path for path in _candidates(folder, name, *beside) if path.is_file()), None)


def leaves_folder(folder: Path, name: str, *beside: Path) -> bool:
    """True if that name leads out of the folder from every place."""
    return next(_candidates(folder, name, *beside), None) is None


def _candidates(folder: Path, name: str, *beside: Path) -> Iterator[Path]:
    """Paths inside of the folder that the name may mean, there or not, exact ones first."""
    home, spelt = folder.resolve(), dict.fromkeys((name, name.replace("\\", "/")))
    for change in (lambda path: path, _in_any_case):
        for text in spelt:
            for place in (folder, *beside):
                try:
                    found = change(place / text).resolve()
                    if found.is_relative_to(home):
                        found.is_file()
                        yield found
                except (OSError, ValueError, RuntimeError):  # names too long, with zero bytes, links in a ring
                    continue


def _in_any_case(path: Path) -> Path:
    """The path with the capitals of what is there, where only one name fits at every level."""
    missing = [path, *path.parents]
    there = next(k for k, parent in enumerate(missing) if parent.exists())
    found = missing[there]
    for part in [step.name for step in reversed(missing[:there])]:
        fits = [other for other in found.iterdir() if other.name.casefold() == part.casefold()]
        if len(fits) != 1:
            return path
        found = fits[0]
    return found
