"""Results as tables for people and as plain numbers for JSON.

Imports the results of `replay` and `identification` and computes nothing of a ship itself; never
imports `view` or `check`.
"""
