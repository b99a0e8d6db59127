"""Entry point of ``python -m shiplog``."""

from shiplog.cli.main import main

raise SystemExit(main())
