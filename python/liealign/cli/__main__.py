"""`python -m liealign.cli`."""

from liealign.cli import main

main()
