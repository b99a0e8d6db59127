"""Limits of what a file may claim; a claim beyond them is refused before memory is taken for it.

They are far beyond real logs: MCAP writers begin a new chunk after about 1 MiB, and a chunk exceeds
that only where one message does. What a file holds is thus bounded by its own size.
"""

MAX_MCAP_CHUNK_BYTES = 1 << 26  # before and after compression; an image of 8192 x 8192 bytes fits
MAX_WINDOW_BYTES = 1 << 27  # of zstd, at its highest level of compression
MAX_RECORD_BYTES = 1 << 26  # of other records; a longer attachment is not read
MAX_DESCRIPTION_BYTES = 1 << 24  # of a header, schema, channel or metadata record
MAX_MAP_ENTRIES = 1 << 14  # of the metadata of a channel, and of the file
MAX_CHANNELS = 1 << 12  # described in a file; large vehicles have some hundred topics
MAX_DESCRIPTIONS_BYTES = 1 << 25  # of all schemas and channels together, in memory
MAP_ENTRY_BYTES = 200  # in memory, in addition to its texts
MAX_OTHER_RECORDS = 1 << 16  # attachments and metadata records of other programs
MAX_SUMMARY_BYTES = 1 << 28  # 1.8 million MCAP chunks of 6 channels
# Messages are at least 31 bytes with two times that grow. Constant values at a steady rate leave
# five bytes of each at the best compression of zstd.
MAX_MESSAGES_PER_BYTE = 1
# Messages that are held as they are in the file, such as raw packets for a copy: texts and numbers
# of sensors become a tenth.
MAX_HELD_BYTES = 1 << 26
MAX_HELD_PER_BYTE = 32  # in addition, for each byte of the file
