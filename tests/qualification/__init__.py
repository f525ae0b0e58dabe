"""Random, sine and shock tests have the responses and damage of published cases (here), closed forms and pyYeti."""

import json
from pathlib import Path


def read_case(name: str) -> dict[str, float]:
    """Values by quantity of a case in `tests/cases`."""
    text = (Path(__file__).parent.parent / "cases" / f"{name}.json").read_text(encoding="utf-8")
    return {row["quantity"]: row["value"] for row in json.loads(text)["outputs"]}
