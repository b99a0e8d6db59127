"""Regression check: replays compared with their references, and the differences drawn.

A reference is a log of a replay's results. Imports `replay` and `view`; only the `cli` imports it.
"""
