"""Lets tests import what stands beside them: plain programs, generator, mutation study, adapters."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [folder for folder in (str(HERE), str(HERE / "adapters")) if folder not in sys.path]

collect_ignore_glob = ["adapters/more/*"]  # they need libraries that the tests do not install
