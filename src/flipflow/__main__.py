"""``python -m flipflow``: the command line where no script is installed, or not on the path."""

from __future__ import annotations

from flipflow.cli.main import main

if __name__ == "__main__":
    main()
