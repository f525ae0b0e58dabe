"""Response over frequency."""

from .direct import direct_response
