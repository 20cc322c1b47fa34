"""`iiwa-sim check-cell`: prints what is in a cell, or what is wrong with it."""

from collections.abc import Sequence

from iiwa_sim.cli.names import CHECK_CELL
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    from iiwa_sim.cell.cell import load_cell
    from iiwa_sim.cell.summary import summary
    from iiwa_sim.dialect.dialects import fitting_dialects
    from iiwa_sim.simulator import Simulator

    dialects = fitting_dialects(load_cell(options.cell).description)
    say(summary(Simulator(cell=options.cell, dialects=dialects).cell))  # checks all but listening
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {CHECK_CELL}",
        description="Prints what is in a cell, or what is wrong with it.",
        examples={"examples/table.toml": "a table to probe"},
    )
    parser.add_argument("cell", metavar="CELL.toml", help="the file")
    return parser
