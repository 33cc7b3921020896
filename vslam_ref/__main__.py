"""``python -m vslam_ref``: the same as the command ``vslam-ref``."""

from vslam_ref.cli import main

raise SystemExit(main())
