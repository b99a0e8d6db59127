"""Resampled signals: statistics, held inputs, moments, concatenation.

The folder holds what filters, observers and regression share: arrays and `Signals` in, statistics
and `Signals` out. It must not import anything else of `analysis`.
"""
