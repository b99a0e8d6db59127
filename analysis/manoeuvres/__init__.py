"""Manoeuvring indices of a run: advance, transfer, overshoots, periods.

Arrays in, numbers out; imports nothing else of `analysis`.
"""
