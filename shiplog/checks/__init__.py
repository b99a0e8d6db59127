"""Checks of raw channels: statistics, stuck values, signs, biases, data quality.

Each check takes channels chunk by chunk and returns statistics or warnings; none changes a sample.
Imports nothing of `shiplog.mcap`, `shiplog.tables` or `shiplog.vessel`.
"""
