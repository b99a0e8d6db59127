"""Checks of channels against each other: units, signs, zeros and lags that physics contradicts.

All conclusions are drawn by one procedure (`consistency_check`), so that causes are assigned to one
channel consistently. This folder must not import `shiplog.mcap`, `shiplog.tables` or
`shiplog.vessel`.
"""
