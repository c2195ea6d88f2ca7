"""``python -m tsuya``."""

from tsuya.cli import main

main(prog_name="tsuya")
