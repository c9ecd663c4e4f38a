"""`python -m rtctl`."""

from rtctl.cli import main

if __name__ == "__main__":
    main()
