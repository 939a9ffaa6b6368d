"""``python -m kop_exudyn``: the same as the command ``kop``."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
