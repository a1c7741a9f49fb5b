"""Exceptions that Canyon raises."""

from __future__ import annotations

from typing import Any, Optional, Tuple

__all__ = ["InputError", "Interrupted", "OutputError"]


class InputError(ValueError):
    """Bad input: a scenario, a file, an array.

    Attributes
    ----------
    problem : str
        What is wrong, with the offending value.
    cure : str
        What to do about it; may be empty.
    file : str or None
        The file that it stands in.
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


class OutputError(InputError):
    """The machine does not take an output: a full disk, a quota, a disk that is gone."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a run early. What was done until then is kept.

    Attributes
    ----------
    result : object
        What the call would have returned, as far as it came.
    """

    def __init__(self, message: str, result: Any) -> None:
        super().__init__(message)
        self.result = result

    def __reduce__(self) -> Tuple[Any, ...]:
        return Interrupted, (self.args[0], self.result)
