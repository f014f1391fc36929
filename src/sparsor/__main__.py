"""`python -m sparsor`."""

from sparsor.cli.main import main

if __name__ == "__main__":
    main()
