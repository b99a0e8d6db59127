"""Other identification methods, run beside the fit for comparison.

An extended Kalman filter with the parameters as states, sliding windows in integral form, and the
scheme of the identification paper; each returns a `ParameterHistory`. Imports the fit's modules
(`problem`, `least_squares`, `output_error`, ...), `filters` and `regression`, but neither
`identify` nor anything of `report` or `view`.
"""
