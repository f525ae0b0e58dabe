"""Reports of results whose fields are single numbers."""

from typing import Any

from ..quantities import Quantity
from ..reports import Report


def report_of_fields(result: Any, **units: str) -> Report:
    """The fields of a result by their names, underlines as spaces, with their units; "" for none."""
    return Report([Quantity(name.replace("_", " "), getattr(result, name), unit) for name, unit in units.items()])
