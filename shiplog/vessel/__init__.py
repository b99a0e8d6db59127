"""Vessel files: a ship's coefficients, steering gear, simulation model and replay settings.

`vessel_parser` reads a file and reports all its errors at once, `presets` has the files that come
with shiplog, `settings` defines the keys of `[filter]`, `[disturbance]` and `[identifier]`,
`model_section` those of `[model]`, `hull` those of `[hull]`, `ship` makes the ship for simulation.
This folder must not import `shiplog.mcap`, `shiplog.tables`, recorders or estimators.
"""
