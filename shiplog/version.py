"""The version of shiplog."""

__version__ = "0.1.0"
