"""Branches of cycles: each part of one kind of stability is one line, so that its dashes are seen."""

import matplotlib.pyplot as plt
import numpy as np

from jaxmbs import viz

from .test_viz_labels import branch


def test_parts_are_whole_lines():
    shown = branch()
    ax = viz.plot_branches(shown, "x")
    parts = [line for line in ax.lines if line.get_marker() == "None"]
    assert sorted(len(line.get_xdata()) for line in parts) == [12, 12, 18]
    dashed = [line.get_linestyle() != "-" for line in parts]
    assert sum(dashed) == 1
    np.testing.assert_allclose(parts[dashed.index(True)].get_xdata(), shown.values[11:29])
    plt.close("all")
