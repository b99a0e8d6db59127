"""The disturbance observer: its design, its loop, and what it estimates.

`observer_design` places its poles, `loop` runs ship and observer sample by sample, `observer`
applies them to a log. Imports `signals`, `design` and `filters`.
"""
