"""What all tests share: pictures are drawn without a display."""

import os

os.environ["MPLBACKEND"] = "Agg"
