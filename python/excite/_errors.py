"""Errors, warnings, interruption."""

from __future__ import annotations

import warnings
from typing import Iterable, NamedTuple

from ._excite import Error

__all__ = ["Error", "ExciteWarning", "Notice"]

#: Warnings of one call that are shown one by one.
_MOST = 12


class ExciteWarning(UserWarning):
    """Something imperfect that did not stop the work; all of it is in ``result.warnings``."""


class Notice(NamedTuple):
    """Something imperfect that did not stop the work."""

    kind: str
    """what kind of imperfection it is, as in the reports"""
    subject: str
    """what it is about: a link, a joint, a file, a channel"""
    message: str
    """what was found and what was assumed instead"""

    def __str__(self) -> str:
        return f"{self.subject}: {self.message}"


def unusable(text: str) -> Error:
    """The error of an argument that cannot be."""
    error = Error(text)
    error.kind = "argument"
    return error


def notices(raw: Iterable["tuple[str, str, str]"]) -> "list[Notice]":
    """Warnings as they come from the library."""
    return [Notice(*w) for w in raw]


def emit(found: "list[Notice]", level: int = 3) -> None:
    """Hand warnings to Python's ``warnings``."""
    for notice in found[:_MOST]:
        warnings.warn(str(notice), ExciteWarning, stacklevel=level)
    if len(found) > _MOST:
        more = f"and {len(found) - _MOST} more, all of them in .warnings"
        warnings.warn(more, ExciteWarning, stacklevel=level)
