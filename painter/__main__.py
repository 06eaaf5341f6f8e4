"""`python -m painter` is the `painter` command."""

from painter.cli.main import main

if __name__ == "__main__":
    main()
