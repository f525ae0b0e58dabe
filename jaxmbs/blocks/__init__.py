"""Blocks: controllers, filters and delays that read signals of a mechanism and drive its force elements."""

from ._base import AbstractBlock

__all__ = ["AbstractBlock"]
