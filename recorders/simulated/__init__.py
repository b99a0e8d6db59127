"""A simulated trial: manoeuvre, ship and sensors as a `Source`.

`manoeuvres` gives the orders, `trajectory` integrates the ship's motion, `sensors` distorts it as
real sensors do, and `simulate` joins the three.
"""
