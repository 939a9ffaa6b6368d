"""Subcommands of ``kop``, one module each: HELP, DESCRIPTION, EXAMPLES, `arguments(parser)` and
`run(args) -> status`.

A command is added by adding its module to NAMES; a module whose name would be a keyword ends in an
underscore. Modules import what they compute with inside `run`, so that ``kop --help`` stays quick.
All take --json (see `output`), --quiet and --verbose.
"""

NAMES = (
    "simulate",
    "check",
    "fit",
    "optimize",
    "tradeoff",
    "import",
    "view",
    "export",
    "examples",
    "completion",
)
