"""Values as words."""

from __future__ import annotations

from typing import SupportsFloat, Union

Number = Union[int, float]


def word(text: str) -> str:
    """The text, if it is one word: so that a name cannot hide a command."""
    if not text or text.split() != [text]:
        raise ValueError(f"{text!r} is not a name; expected one word")
    return text


def number(name: str, value: object) -> float:
    """The value of a parameter that is a number; its unit is in its name."""
    if isinstance(value, SupportsFloat) and not isinstance(value, str):
        return float(value)
    raise TypeError(f"{name} is {value!r}; expected a number")


def setting(name: str, value: Union[int, float, str]) -> str:
    """The value of a parameter as the words of a file."""
    if isinstance(value, (int, float, str)):
        return str(value).lower() if isinstance(value, bool) else str(value)
    raise TypeError(f"{name} is set to {value!r}; expected a number or a text")
