"""Estimation of any linear system from the channels of a log, by every method of the papers.

`system_file` reads a system file: plant, channels, noise, disturbances, method, regulator.
`estimator_model` joins the plant with its disturbances and shaping filters, `methods` designs the
gain, `estimate` runs the estimator over a log, chunk by chunk. Imports nothing of
`analysis.identification`, `analysis.report` or `analysis.view`.
"""
