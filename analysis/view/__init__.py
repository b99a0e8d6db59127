"""Reviews in Rerun: series, panels, tracks, and the recordings that hold them.

Only the modules that write a recording import rerun (`rerun_io` and the reviews); the others know
nothing of the program that draws. Never imports `check`.
"""
