"""Limits of what a file may claim; a claim beyond them is refused before memory is taken for it.

They are far beyond real logs: MCAP writers begin a new chunk after about 1 MiB, and a chunk exceeds
that only where one message does. What a file holds is thus bounded by its own size.
"""

MAX_MCAP_CHUNK_BYTES = 1 << 26  # before and after compression; an image of 8192 x 8192 bytes fits
MAX_WINDOW_BYTES = 1 << 27  # of zstd, at its highest level of compression
MAX_RECORD_BYTES = 1 << 26  # of other records; a longer attachment is not read
MAX_DESCRIPTION_BYTES = 1 << 24  # of a header, schema, channel or metadata record
MAX_MAP_ENTRIES = 1 << 14  # of the metadata of a channel or of the file
MAX_SUMMARY_BYTES = 1 << 28  # 1.8 million MCAP chunks of 6 channels
# Messages are at least 31 bytes with two times that grow; the best compression of a real log,
# constant values at a steady rate, leaves some bytes of each.
MAX_MESSAGES_PER_BYTE = 8
