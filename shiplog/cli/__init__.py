"""The command line: arguments, console output, and the verbs of the core.

Verbs of other packages are found by their entry points; nothing here imports them.
"""
