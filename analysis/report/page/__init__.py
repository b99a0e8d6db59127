"""The report of a trial as one page of HTML, to print and to sign.

A `TrialReport` gathers what was computed; modules turn its parts into texts, tables and figures,
and templates put these on the page. It computes no index itself, and imports no review.
"""
