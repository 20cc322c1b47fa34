"""`python -m iiwa_sim` is `iiwa-sim`."""

import sys

from iiwa_sim.cli import main

if __name__ == "__main__":
    sys.exit(main())
