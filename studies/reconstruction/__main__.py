"""Command line of the study: ``python -m studies.reconstruction``, from the root of the repository."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NoReturn

from printhammer.cli.main import build_program, run_program
from studies.reconstruction.verbs import EXAMPLE, HELP, VERBS

if TYPE_CHECKING:
    from collections.abc import Sequence

NAME: Final = "python -m studies.reconstruction"

app: Final = build_program(NAME, HELP, EXAMPLE, VERBS, {})


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the program with command-line arguments, by default those of the process, and exit."""
    run_program(app, NAME, arguments)


if __name__ == "__main__":
    main()
