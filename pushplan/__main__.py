"""``python -m pushplan`` is the same as ``pushplan``."""

import sys

from pushplan.cli import main

sys.exit(main())
