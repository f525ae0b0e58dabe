"""Makes the pictures of the manual anew: `python -m tests.viz.gallery` from the root of the repository.

The Python on the page makes the plots, a browser photographs the scenes.
"""

import os
import re
import shutil
import tempfile
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PAGE, IMAGES = DOCS / "guide" / "pictures.md", DOCS / "images"
SCENES = {
    "scene.png": ("motion.html", "#t=0.42", (900, 520)),
    "mode.png": ("mode.html", "#t=0", (900, 520)),
    "report.png": ("crank.html", "", (760, 700)),
}
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def shown() -> set[str]:
    """Names of the pictures on the page, and of those that the README shows."""
    readme = (PAGE.parents[2] / "README.md").read_text("utf-8")
    return set(re.findall(r"\]\((?:\.\.|docs)/images/([\w.]+)\)", PAGE.read_text("utf-8") + readme))


def saved() -> set[str]:
    """Names of the pictures that its Python writes, or a browser takes."""
    return set(re.findall(r'savefig\("([\w.]+)"', PAGE.read_text("utf-8"))) | set(SCENES)


def main() -> None:
    """Run the page in a folder of its own and keep the pictures."""
    from matplotlib import pyplot

    from tests.viz.scenes.test_page import photographed

    pyplot.switch_backend("Agg")
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        names: dict = {}
        for code in _BLOCK.findall(PAGE.read_text("utf-8")):
            exec(compile(code, str(PAGE), "exec"), names)
        for picture, (page, address, size) in SCENES.items():
            photographed(Path(folder, page), Path(folder, picture), address, size)
        for name in sorted(saved()):
            shutil.copy(name, IMAGES / name)
            print(f"{name}: {Path(name).stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
