"""NMEA 2000: frames of a CAN bus, live or from the text formats of gateways and loggers.

`line_formats` reads the frames of a line, `line_times` its time; `pgn_decoder` assembles messages
and turns them into samples as `pgns` states; `can_bus` is the transport of a live bus. Everything
but the options needs the libraries of the extra ``shiplog[nmea2000]``, which `canboat_library`
imports.
"""
