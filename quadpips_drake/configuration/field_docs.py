"""The line of documentation below each field of a configuration class, read from its source."""

import ast
import inspect
import itertools
import re
import textwrap
from functools import cache


@cache
def field_docs(schema: type) -> dict[str, str]:
    """Returns what stands below the fields of a class and its bases, by name, each in one line; {} without the source."""
    docs = {}
    for cls in reversed(schema.__mro__[:-1]):
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(cls)))
        except (OSError, TypeError, SyntaxError):
            continue
        body = tree.body[0].body
        for statement, following in itertools.pairwise(body):
            if isinstance(statement, ast.AnnAssign) and isinstance(following, ast.Expr):
                docs[statement.target.id] = " ".join(inspect.cleandoc(ast.literal_eval(following.value)).split())
    return docs


def field_unit(schema: type, name: str) -> str:
    """The unit of a number, or units of a list's numbers, as its documentation names them in brackets: 'm', 'm/s, rad/s'.

    Empty for numbers without dimension, and where no unit is named.
    """
    units = re.findall(r"\[([^\]]+)\]", field_docs(schema).get(name, ""))
    return ", ".join(dict.fromkeys(unit for unit in units if unit not in ("-", "1")))
