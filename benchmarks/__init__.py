"""Measurements of shiplog's speed and accuracy.

`python -m benchmarks` measures the time of each piece of work and of the whole replay as a ratio to
a straightforward peer in the same run; `python -m benchmarks.identification` and
`python -m benchmarks.changes` print the pages on accuracy. The packages of shiplog must not import
this folder.
"""

import os

# The windows are small matrices. On a busy machine BLAS's threads mostly wait for each other, and
# the peers would appear ten times slower than they are.
for _threads in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
