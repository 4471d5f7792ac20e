"""Lets ``python -m vibrokit.cli`` run the command line."""

import sys

from vibrokit.cli import main

sys.exit(main())
