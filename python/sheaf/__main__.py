# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""``python -m sheaf VERB ...`` is the command."""

import os
import sys

from . import _sheaf

# The command waits for signals (Ctrl-C) on a thread of its own, and so has to be there before any
# other thread, such as those of NumPy's linear algebra: the compiled part alone, in a new process
# in place of this one, has none.
PROGRAM = """
import importlib.util, signal, sys
spec = importlib.util.spec_from_file_location("_sheaf", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
signal.signal(signal.SIGINT, signal.SIG_DFL)
sys.exit(module.run_command(["sheaf", *sys.argv[2:]]))
"""


def main() -> None:
    assert _sheaf.__file__ is not None
    python = sys.executable
    os.execv(python, [python, "-I", "-S", "-c", PROGRAM, _sheaf.__file__, *sys.argv[1:]])


if __name__ == "__main__":
    main()
