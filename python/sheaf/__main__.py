# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""``python -m sheaf VERB ...`` is the command."""

import signal
import sys

from ._sheaf import run_command


def main() -> int:
    # The command handles signals itself, as it does where no Python is around it.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["sheaf", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
