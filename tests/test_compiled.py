import os
import subprocess
import sys
from pathlib import Path

CODE = """
import sys
from shiplog.compiled import compiled, is_compiled
print(is_compiled("shiplog"), end=" ")
from shiplog.ship import Coefficients, rudder_effect
c = Coefficients(*[1.0] * 12)
print(rudder_effect(c, 0.0, 2.0), is_compiled("shiplog"))
"""


def test_machine_code_is_kept_for_later_runs_and_a_first_run_is_known(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    said = [
        subprocess.run(
            [sys.executable, "-c", CODE],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert said == [["False", "2.0", "True"], ["True", "2.0", "True"]]
