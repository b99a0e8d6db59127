"""Transports: the connections from which packets come while a recording runs, one module each.

`address` makes a `Transport` of an address such as ``udp://127.0.0.1:10110``; `live_stream` reads
one in a thread of its own, opens it again when it fails, and bounds what waits to be decoded. They
know nothing of the formats of the packets.
"""
