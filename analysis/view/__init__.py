"""Reviews in Rerun: series, panels, tracks, and the recordings that hold them.

Only modules that write a recording import rerun.
"""
