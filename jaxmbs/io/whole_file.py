"""Files that are there as a whole or not at all: `jaxmbs.whole_file`."""

from ..whole_file import whole_file, whole_path

__all__ = ["whole_file", "whole_path"]
