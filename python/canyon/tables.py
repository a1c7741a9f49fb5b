"""Columns of results, as dicts of arrays, pandas frames and xarray datasets."""

from __future__ import annotations

import difflib
from typing import Any, Dict, Iterator, Mapping, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _canyon

__all__ = ["Table"]


class Table(Mapping[str, NDArray[Any]]):
    """Columns of equal length, by the names of docs/reference/columns.md, with ``time`` (UTC) first.

    Unknown numbers are NaN, flags 0 and 1. Arrays are read-only: make a ``copy()`` to change one.

    Attributes
    ----------
    units : dict
        Of each column, in UDUNITS notation.
    """

    def __init__(self, name: str, columns: Dict[str, NDArray[Any]], attributes: Mapping[str, Any]) -> None:
        self.name = name
        self._columns = columns
        self.attributes = dict(attributes)
        about = _canyon.columns(name)
        self.units: Dict[str, str] = {column: about[column][0] for column in columns if about[column][0]}
        self._about = about
        for values in columns.values():
            values.flags.writeable = False

    def __reduce__(self) -> Tuple[Any, ...]:
        return Table, (self.name, self._columns, self.attributes)

    def __getitem__(self, column: str) -> NDArray[Any]:
        if column not in self._columns:
            close = difflib.get_close_matches(str(column), self._columns, 1)
            raise KeyError(f"{self.name} has no column {column!r}; " + (f"did you mean {close[0]!r}?" if close else f"it has {', '.join(self)}"))
        return self._columns[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """int: Length of the columns."""
        return len(next(iter(self._columns.values())))

    def column_attributes(self, column: str) -> Dict[str, str]:
        """CF attributes of a column: ``long_name``, ``units``, and ``standard_name`` if the conventions have one."""
        unit, standard_name, meaning = self._about[column]
        attributes = {"units": unit, "standard_name": standard_name, "long_name": meaning}
        return {name: text for name, text in attributes.items() if text}

    def to_structured(self) -> NDArray[Any]:
        """One structured array with a record per row. Copies."""
        rows = np.empty(self.rows, dtype=[(name, values.dtype) for name, values in self._columns.items()])
        for name, values in self._columns.items():
            rows[name] = values
        return rows

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``; units are in ``frame.attrs["units"]``. pandas is imported here."""
        import pandas

        frame = pandas.DataFrame(self._columns)
        frame.attrs = {**self.attributes, "units": dict(self.units)}
        return frame

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset`` with CF attributes. xarray is imported here.

        Epochs have the dimension ``time``; other tables have the dimension ``row``, with ``time`` as a coordinate.
        """
        import xarray

        dimension = "time" if self.name == "epochs" else "row"
        data = {
            name: (dimension, values.copy(), self.column_attributes(name))
            for name, values in self._columns.items()
            if name != dimension
        }
        coordinates = {}
        if dimension == "time":
            coordinates["time"] = ("time", self._columns["time"], {"standard_name": "time"})
        return xarray.Dataset(data, coordinates, {"Conventions": "CF-1.10", **self.attributes})

    def __repr__(self) -> str:
        return f"<canyon.Table {self.name!r}: {self.rows} rows, {len(self)} columns>"
