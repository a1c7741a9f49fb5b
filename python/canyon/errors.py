"""Exceptions that Canyon raises."""

from __future__ import annotations

from typing import Any, Optional, Tuple

__all__ = ["InputError", "Interrupted", "OutputError"]


class _Error(Exception):
    def __init__(
        self,
        problem: str,
        cure: str = "",
        file: Optional[str] = None,
        line: Optional[int] = None,
        message: Optional[str] = None,
    ) -> None:
        super().__init__(message or (f"{problem}; {cure}" if cure else problem))
        self.problem = problem
        self.cure = cure
        self.file = file
        self.line = line


class InputError(_Error, ValueError):
    """Bad input: a scenario, a file, an array.

    Attributes
    ----------
    problem : str
        The error, with the invalid value.
    cure : str
        Hint how to correct it; may be empty.
    file : str or None
        The file with the error.
    line : int or None
        The line of that file, from 1.

    Examples
    --------
    >>> import canyon
    >>> try:
    ...     canyon.Scenario(city={"open": True, "origin": {"latitude_deg": 0, "longitude_deg": 0}}, sed=7)
    ... except canyon.InputError as error:
    ...     print(error.problem, "|", error.cure)
    unknown key 'sed' | did you mean 'seed'?
    """


class OutputError(_Error, RuntimeError):
    """An output cannot be written: a full disk, a quota, a removed disk. Attributes as of :class:`InputError`."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a run early. Results until then are kept.

    Attributes
    ----------
    result : object
        The partial result of the call.
    """

    def __init__(self, message: str, result: Any) -> None:
        super().__init__(message)
        self.result = result

    def __reduce__(self) -> Tuple[Any, ...]:
        return Interrupted, (self.args[0], self.result)
