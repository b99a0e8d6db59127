"""Checks of raw channels: statistics, stuck values, signs, biases and data quality.

Each check takes a log chunk by chunk and returns statistics or warnings; none changes a sample.
This folder must not import `shiplog.mcap`, `shiplog.tables` or `shiplog.vessel`.
"""
