"""Run a command and say, as JSON, how long it took and how much memory: for `measure.run`.

Imports nothing large: on Linux the peak told of a child is at least that of its parent.
"""

import json
import os
import subprocess
import sys
import time


def main(command: list[str]) -> int:
    """The command's exit code; its standard output is dropped, its errors are passed on."""
    start = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    peak = None
    if hasattr(os, "wait4"):
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = code = os.waitstatus_to_exitcode(status)
        peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    else:
        code = child.wait()
    print(json.dumps({"secs": time.perf_counter() - start, "peak_bytes": peak}))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
