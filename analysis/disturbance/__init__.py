"""The disturbance observer: its design, its loop, and the disturbances it estimates.

`observer_design` places its poles, `loop` runs ship and observer sample by sample, `observer`
applies them to a log. Imports `signals`, `design` and `filters` of `analysis`, and must not import
anything else of it.
"""
