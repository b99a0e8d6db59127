"""Design of observers, filters and regulators for any linear system; one method a module.

This folder knows no ship and no log; of this project it must import the errors and types only.
"""
