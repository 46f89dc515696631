"""What a worker needs, imported once by the process that all workers are forked from.

Importing this module is what it is for.
"""

from __future__ import annotations

import os
from contextlib import suppress
from importlib import import_module

from cfplan_core.errors import CfplanError

# Libraries of linear algebra read these when they are loaded; dask sets them too late for that.
for _name in ('OMP_NUM_THREADS', 'MKL_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
    os.environ.setdefault(_name, '1')
for _name in ('distributed', 'mujoco', 'cfplan_core.study.running'):
    import_module(_name)
# Where it is missing each run that needs it says so.
with suppress(CfplanError):
    import_module('cfplan_core.trajectory.parameterization').import_toppra()
