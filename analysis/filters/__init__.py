"""State estimators of yaw and surge, their noise models and the smoother.

`factory` finds a filter by its name (entry points ``shiplog.filters``,
docs/how_to_add_a_filter.md). This folder must not import the replay, reports, views or recorders.
"""
