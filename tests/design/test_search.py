"""Bookkeeping of a search: values alone while a line search backtracks, the best point with finite gradients."""

import numpy as np
import pytest
from tqdm import tqdm

from jaxmbs.design._search import Search
from jaxmbs.design._variables import read_variables


class Recorder:
    """f = x^2 as a program of values and slopes and one of values; no slopes where |x| is below `kink`."""

    def __init__(self, kink=0.0):
        self.asked, self.kink = [], kink

    def slopes(self, x):
        self.asked.append(("slopes", float(x[0])))
        slope = np.nan if abs(x[0]) < self.kink else 2.0 * x[0]
        return x[0] ** 2, np.array([slope]), np.zeros(0), np.zeros((0, 1)), (False,)

    def values(self, x):
        self.asked.append(("values", float(x[0])))
        return x[0] ** 2, np.zeros(0), (False,)


def begin(recorder):
    variables = read_variables(np.array([3.0]), None)
    return Search(recorder.slopes, variables, 1e-8, None, tqdm(disable=True), evaluate_values=recorder.values)


def test_values_alone_from_the_first_trial_that_was_not_taken():
    recorder = Recorder()
    search = begin(recorder)
    search.accept(search.evaluate(np.array([2.0]), slopes=False), by_decrease=False)  # a first trial that is taken
    for trial in (-4.0, -1.5):
        search.evaluate(np.array([trial]), slopes=False)
    point = search.evaluate(np.array([-1.5]))  # the line search asks for the slope there
    assert point.has_slopes and search.evaluate(np.array([-1.5]), slopes=False) is point
    expected = [("slopes", 3.0), ("slopes", 2.0), ("slopes", -4.0), ("values", -1.5), ("slopes", -1.5)]
    assert recorder.asked == expected
    search.accept(point, by_decrease=False)
    np.testing.assert_array_equal(search.optimum().history.evaluations, [1, 2, 4])  # each design counts once


@pytest.mark.parametrize(("kink", "best"), [(0.0, 0.1), (0.5, 2.0)])
def test_the_best_point_has_finite_slopes(kink, best):
    """One found by its value alone is evaluated again, and counts for nothing where its slope is not finite."""
    search = begin(Recorder(kink))
    for trial in (2.0, 0.1):
        search.evaluate(np.array([trial]), slopes=False)
    assert search.optimum().design == best and search.best.has_slopes
