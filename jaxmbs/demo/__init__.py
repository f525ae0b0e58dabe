"""The demo: a slider-crank simulated, its joint loads checked, its design improved by gradients."""

from .story import run as run
