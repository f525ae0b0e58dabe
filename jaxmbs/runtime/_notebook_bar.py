"""Bars of notebooks; imported with the first bar, as `tqdm` is."""

import html
import io
import uuid

from tqdm import tqdm


class NotebookBar(tqdm):
    """A bar that a notebook shows and keeps as one output, which also reads as a line of text."""

    def __init__(self, *args, **options):
        self._place, self._is_shown = uuid.uuid4().hex, False
        super().__init__(*args, **(options | {"file": io.StringIO(), "ncols": 80}))

    def display(self, msg=None, pos=None):
        """Show the bar, or change the one that is shown."""
        from IPython.display import display

        display(self._bundle(), raw=True, display_id=self._place, update=self._is_shown)
        self._is_shown = True

    def _bundle(self):
        """The bar as HTML and as text."""
        state = self.format_dict
        line = self.format_meter(**state)
        before, _, after = self.format_meter(**(state | {"bar_format": "{l_bar}|{r_bar}"})).partition("|")
        bar = f'<progress value="{self.n}" max="{self.total}" style="width:16em;vertical-align:middle"></progress>'
        after = after.lstrip("| ")
        style = "font-family:monospace;white-space:pre"
        return {
            "text/plain": line,
            "text/html": f'<div style="{style}">{html.escape(before)} {bar} {html.escape(after)}</div>',
        }
