"""Resampled signals: statistics, held inputs, moments, concatenation.

Imports nothing else of `analysis`.
"""
