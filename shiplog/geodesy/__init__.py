"""Positions on the earth and in a local north/east frame, and the conversion between them.

Nothing outside this folder converts latitude and longitude to metres. It takes and returns arrays
and must not import any other folder of shiplog.
"""

from .local_frame import LocalFrame
from .positions import GeographicPositions, LocalPositions, Positions, positions_of

__all__ = ["GeographicPositions", "LocalFrame", "LocalPositions", "Positions", "positions_of"]
