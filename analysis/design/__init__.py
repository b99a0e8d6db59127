"""Matrices and gains, for any linear system; each module is one idea."""
