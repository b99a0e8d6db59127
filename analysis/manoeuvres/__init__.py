"""Manoeuvring indices of one run: turning circles and zig-zags.

The folder recognises the manoeuvre by its rudder and heading and computes the indices of IMO
MSC.137(76): advance, transfer, tactical diameter, overshoots, initial turning time, period. Arrays
in, numbers out, SI. It imports nothing else of `analysis`, and no log or segment types.
"""
