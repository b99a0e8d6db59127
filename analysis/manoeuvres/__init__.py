"""Manoeuvres of a trial: detection, indices with their uncertainty, and the limits of the norms.

`detection` finds what was sailed in signals of any length, `assessment` computes the indices of one
manoeuvre (IMO MSC.137(76), ITTC 7.5-04-02-01) with their intervals and verdicts; `indices` compares
those of a measured and a simulated run. Arrays in, results out, SI. It imports nothing else of
`analysis`, and no log or segment types.
"""
