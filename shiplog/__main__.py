"""`python -m shiplog`."""

from .cli import main

raise SystemExit(main())
