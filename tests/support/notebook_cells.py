"""Runs the cells of a notebook in this process, as a notebook does, without Jupyter."""

import ast
import json
from pathlib import Path
from typing import Any


def run_cells(path: Path) -> list[Any]:
    """
    Run the code cells in order in one namespace; return what each shows (None for nothing).

    What a cell ends with is shown as a notebook would: by `_repr_html_` where there is one.
    """
    space: dict[str, Any] = {'__name__': '__main__'}
    shown = []
    for number, cell in enumerate(json.loads(path.read_text())['cells'], 1):
        if cell['cell_type'] != 'code':
            continue
        body = ast.parse(''.join(cell['source']), f'{path.name}, cell {number}')
        last = body.body.pop() if body.body and isinstance(body.body[-1], ast.Expr) else None
        exec(compile(body, f'{path.name}, cell {number}', 'exec'), space)
        value = None
        if last is not None:
            code = compile(ast.Expression(last.value), f'{path.name}, cell {number}', 'eval')
            value = eval(code, space)
        html = getattr(value, '_repr_html_', None)
        shown.append(html() if html else value)
    return shown
