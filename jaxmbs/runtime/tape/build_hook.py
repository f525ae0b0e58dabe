"""Builds the tape machine with the system's C compiler when the library is installed; without one it is left out."""

import importlib.util
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class TapeMachineHook(BuildHookInterface):
    """Adds `machine.so` to a wheel, or to the checkout of an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the machine; a wheel that holds it is one for this platform."""
        if self.target_name != "wheel":
            return
        building = _building()
        if building.build_machine():
            build_data["artifacts"].append(str(building.LIBRARY.relative_to(self.root)))
            build_data["pure_python"] = False
            build_data["infer_tag"] = True
        else:
            self.app.display_warning("no C compiler: tapes run in NumPy, slower")


def _building() -> Any:
    """The module beside this one, which is not installed yet."""
    place = importlib.util.spec_from_file_location("building", Path(__file__).with_name("_build.py"))
    assert place is not None and place.loader is not None
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    return module
