"""A small process that runs a command and prints its duration, processor time and peak memory.

As JSON, for `measure.run`. It imports nothing large: on Linux the peak reported for a child process
is at least the memory of its parent.
"""

import json
import os
import subprocess
import sys
import time


def main(command: list[str]) -> int:
    """Run the command and return its exit code; its stdout is dropped, its stderr is passed on."""
    start = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    peak = processor = None
    if hasattr(os, "wait4"):
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = code = os.waitstatus_to_exitcode(status)
        peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        processor = usage.ru_utime + usage.ru_stime
    else:
        code = child.wait()
    secs = time.perf_counter() - start
    print(json.dumps({"secs": secs, "processor_secs": processor, "peak_bytes": peak}))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
