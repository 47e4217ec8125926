# SPDX-License-Identifier: Apache-2.0
"""What the measured tables of docs/ are made of, for scripts/measure."""

TABLES = {}


def table(page, sources, form, runs, timed=False):
    """A table with the name of the function that follows.

    page     of docs/
    sources  files and folders whose change makes it old
    form     its head, and a row with a field of Python's format() for each cell
    runs     commands by key; --json is added
    timed    its caption says what share of the processors other programs used

    The function gets what the commands have printed, by key, and yields rows of numbers and texts.
    """
    def add(rows):
        TABLES[rows.__name__] = {"page": page, "sources": sources, "form": form,
                                 "runs": dict(runs), "rows": rows, "timed": timed}
        return rows
    return add
