"""`.. scene:: shaper`: a scene in a page, turned and played there, from what `docs/scenes/shaper.json` recorded.

`python docs/_ext/scenes.py tasks/shaper ...` runs the Python of these pages and records the scenes that they write;
`python docs/_ext/scenes.py demo` records that of the demo.
"""

import json
import os
import re
import sys
import tempfile
from pathlib import Path

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

_DOCS = Path(__file__).parent.parent
_BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_DATA = re.compile(r'<script type="application/json" id="scene-data">(.*?)</script>', re.DOTALL)


class EmbeddedScene(SphinxDirective):
    """The recorded scene, played by the player of the library at hand."""

    required_arguments = 1

    def run(self):
        from jaxmbs.viz import Scene

        path = Path(self.env.srcdir) / "scenes" / f"{self.arguments[0]}.json"
        self.env.note_dependency(str(path))
        if not path.exists():
            raise self.error(f"there is no {path}: record it by `python docs/_ext/scenes.py PAGE`")
        return [nodes.raw("", Scene(json.loads(path.read_text("utf-8")))._repr_html_(), format="html")]


def setup(app):
    app.add_directive("scene", EmbeddedScene)
    return {"parallel_read_safe": True}


def run_page(page):
    """Run the Python of a page from top to bottom in the current folder."""
    names = {"__name__": "__manual__"}
    for code in _BLOCK.findall((_DOCS / f"{page}.md").read_text("utf-8")):
        exec(compile(code, page, "exec"), names)


def run_demo():
    """The demo, its scene under the name of the demo."""
    from jaxmbs import cli

    assert cli.main(["demo", "--output", "."]) == 0
    Path("scene.html").rename("demo.html")


def record(page):
    """Write the scenes of a page that some page embeds to `docs/scenes`."""
    pages = "".join(path.read_text("utf-8") for path in _DOCS.rglob("*.md"))
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        run_demo() if page == "demo" else run_page(page)
        for path in Path(folder).glob("*.html"):
            if f"{{scene}} {path.stem}\n" not in pages:
                continue
            data = json.loads(_DATA.search(path.read_text("utf-8")).group(1))
            target = _DOCS / "scenes" / f"{path.stem}.json"
            target.write_text(json.dumps(data, separators=(",", ":")) + "\n", "utf-8")
            print(f"{target}: {target.stat().st_size / 1e6:.2f} MB")
        os.chdir(_DOCS)


if __name__ == "__main__":
    for _page in sys.argv[1:]:
        record(_page)
