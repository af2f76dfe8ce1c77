"""`python -m motiongen`."""

from __future__ import annotations

from motiongen.application import main

if __name__ == "__main__":
    main()
