"""Results as tables for people and as plain numbers for JSON.

Imports results of `replay` and `identification`; computes nothing itself.
"""
