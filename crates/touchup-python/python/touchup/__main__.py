"""``python -m touchup``: the command ``touchup``."""

import sys

from .command import main

sys.exit(main())
