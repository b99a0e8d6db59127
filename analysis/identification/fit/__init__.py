"""Output error: fit of a ship model to segments, with its noise and its uncertainty.

`problem` lays out the unknowns, `initial_guess` starts the search, `least_squares` minimises,
`residual_noise` and `swell` estimate the noise, `output_error` iterates noise and fit, and
`uncertainty` with `agreement` evaluates the result. Imports nothing else of
`analysis.identification`.
"""
