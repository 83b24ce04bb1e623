"""``python -m excite``: the program ``excite``."""

from __future__ import annotations

import signal
import sys

from . import _excite


def main() -> int:
    """Run the program with the arguments of this process and give its exit status."""
    # the program listens for Ctrl-C itself where it has something to keep
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _excite.main(["excite", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
