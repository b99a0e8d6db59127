"""Signal K: deltas as JSON, one in each line, from a server or a log of one.

`signalk_paths` states which path is which channel; `delta_decoder` reads the deltas; `cli` makes it
a format of streams. Only values of the own ship are recorded.
"""
