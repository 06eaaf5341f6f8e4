"""Counts lines of code by folder, without blanks, comments and docstrings.

Run `python -m benchmarks.support.code_size [FOLDER ...]`. A line counts if a token that
is neither comment nor docstring begins, ends or continues on it.
"""

import ast
import io
import sys
import tokenize
from pathlib import Path

FOLDERS = ("painter", "perception", "models")
_NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


def main() -> None:
    """Prints a line for each folder and one for all of them."""
    folders = sys.argv[1:] or list(FOLDERS)
    counts = [
        sum(code_lines(path.read_text()) for path in Path(folder).rglob("*.py"))
        for folder in folders
    ]
    for folder, count in zip([*folders, "all"], [*counts, sum(counts)], strict=True):
        print(f"{folder:12} {count:6d}")


def code_lines(source: str) -> int:
    """Returns how many lines of a module hold code."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - docstring_lines(ast.parse(source)))


def docstring_lines(tree: ast.Module) -> set[int]:
    """Returns the lines of all docstrings below a module."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(
            node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
        ) and ast.get_docstring(node, clean=False):
            docstring = node.body[0]
            lines.update(range(docstring.lineno, (docstring.end_lineno or 0) + 1))
    return lines


if __name__ == "__main__":
    main()
