"""What shiplog is fast at, measured against the straightforward peer in the same run."""

import os

# Windows are small matrices. Where something else is running too, BLAS's threads do little but
# wait for each other, and the peers would look ten times slower than they are.
for _threads in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
