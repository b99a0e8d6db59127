"""Simulated trials: a manoeuvre, a ship model and sensors as a source of samples.

`manoeuvres` gives the orders, `trajectory` integrates the ship's motion, `sensors` adds the errors
of real sensors, `simulate` joins the three, and `cli` offers them as ``shiplog record simulate``.
This folder must not import `analysis`.
"""
