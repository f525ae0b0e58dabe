"""The manual, built by `sphinx-build -W docs site`: pages of Markdown, and the API from the docstrings."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent / "_ext"), str(Path(__file__).parent.parent)]

project = "jaxmbs"
author = "the jaxmbs authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "faces", "scenes"]
exclude_patterns = ["_ext", "_build", "scenes"]
html_theme = "furo"
html_title = "jaxmbs"
html_static_path = []

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

default_role = "code"  # docstrings write code in single backquotes
smartquotes = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_use_param = False  # one line for several names, as in "displacement, velocity: ..."
napoleon_custom_sections = [("Attributes", "params_style")]
napoleon_use_rtype = False
