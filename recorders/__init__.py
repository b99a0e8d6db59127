"""Recorders: sources of samples, and the loop that writes a source to a log.

A source is a simulated trial, a serial line, a file of another system. An installed package adds
one to the command line by an entry point of the group ``shiplog.recorders``
(docs/how_to_add_a_recorder.md). This folder must not import `analysis`: a recorder and an estimator
meet only in a file.
"""
