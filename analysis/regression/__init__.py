"""Least squares on the equations of motion in integral form.

`weak_form` builds the rows, `sliding` solves them over the whole trial and over windows with
`window_qr` and `batched_qr`, `newey_west` computes the standard errors, `coefficients` gives the
ship's coefficients, and `changes` tests whether one changed during the trial. Imports `signals`.
"""
