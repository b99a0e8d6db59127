"""Manoeuvres of a log: what was sailed, indices with intervals, and verdicts against the norm.

The folder reads from a log what `analysis.manoeuvres` needs, and gathers what that finds as a
`TrialAnalysis`. It imports `analysis.manoeuvres`, and no filter, report or review.
"""
