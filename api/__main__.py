"""``python -m signorini``."""

from signorini.cli import main

if __name__ == "__main__":
    main()
