"""Makes the pictures of the manual anew: `python -m tests.viz.gallery` from the root of the repository.

The Python on the pages makes the plots, a browser photographs the scenes.
"""

import os
import re
import shutil
import tempfile
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PAGES, IMAGES = (DOCS / "guide" / "pictures.md", DOCS / "gallery.md"), DOCS / "images"
SCENES = {
    "scene.png": ("motion.html", "#t=0.42", (900, 520)),
    "mode.png": ("mode.html", "#t=0", (900, 520)),
    "report.png": ("crank.html", "", (760, 700)),
    "report-loads.png": ("crank.html", "#part4", (760, 560)),
    "crane.png": ("crane.html", "", (640, 420)),
    "ring.png": ("ring.html", "", (640, 420)),
}
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def shown() -> set[str]:
    """Names of the pictures on the pages, and of those that the README shows."""
    readme = (DOCS.parent / "README.md").read_text("utf-8")
    return set(re.findall(r"\]\((?:\.\./|docs/)?images/([\w.-]+)\)", readme + _text()))


def saved() -> set[str]:
    """Names of the pictures that their Python writes, or a browser takes."""
    return set(re.findall(r'"([\w-]+\.png)"', _text())) | set(SCENES)


def _text() -> str:
    return "".join(page.read_text("utf-8") for page in PAGES)


def _only(page: Path, address: str) -> Path:
    """A page, or a copy with one of its sections alone."""
    if not address.startswith("#part"):
        return page
    style = f"<style>body > :not({address}) {{ display: none; }}</style></head>"
    copy = page.with_stem(f"{page.stem}-{address[1:]}")
    copy.write_text(page.read_text("utf-8").replace("</head>", style), "utf-8")
    return copy


def main() -> None:
    """Run the pages in a folder of their own and keep the pictures."""
    from matplotlib import pyplot

    from tests.viz.scenes.test_page import photographed

    pyplot.switch_backend("Agg")
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for page in PAGES:
            names: dict = {}
            for code in _BLOCK.findall(page.read_text("utf-8")):
                exec(compile(code, str(page), "exec"), names)
        for picture, (scene, address, size) in SCENES.items():
            photographed(_only(Path(folder, scene), address), Path(folder, picture), address, size)
        for name in sorted(saved()):
            shutil.copy(name, IMAGES / name)
            print(f"{name}: {Path(name).stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
