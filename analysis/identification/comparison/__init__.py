"""Other identification methods, run beside the fit for comparison.

An extended Kalman filter with the parameters as states, sliding windows in integral form, and the
scheme of the identification paper; each returns a `ParameterHistory`.
"""
