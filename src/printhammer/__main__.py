"""Run the command line as ``python -m printhammer``."""

from printhammer.cli.main import main

if __name__ == "__main__":
    main()
