"""Version number of shiplog."""

__version__ = "0.1.0"
